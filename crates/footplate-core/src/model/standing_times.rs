//! When a train that was commanded to stop stands, by the [kind of decoder](DecoderKind) that it most likely has.
//!
//! One set of numbers describes the stopping distances of all decoders, and says little of their times: a stop that dies away and one that ends
//! may be as long and half a second, or two, apart. No sensor sees a train come to rest, so the kind shows in how distances
//! grow with speed.
//!
//! | kind | stands after |
//! |---|---|
//! | lagging | `q + θ ln(1 + v/fθ)`, when friction ends it |
//! | even | `q + 2D`: it is as late at the end as in the middle |
//! | counted | `q + D/m`, `m` the mean of the speeds passed over the first |
//!
//! with `q` the delay until it takes effect and `D` the distance from there over the speed `v`. The numbers are those that the kind
//! makes of the model's.

use alloc::vec::Vec;

use super::decoder_kind::DecoderKind;
use super::motion_model::MotionModel;
use super::parameters::Answers;
use super::segment::{Pace, Segment, SpeedCommand};

/// When a train stands that was commanded to stop.
#[derive(Debug, Clone)]
pub(crate) struct StandingTimes<'m> {
    model: &'m MotionModel,
    kind: DecoderKind,
    /// Its numbers, if it is of the kind.
    values: Vec<f64>,
}

impl MotionModel {
    /// When it stands that was commanded to stop.
    pub(crate) fn standing_times(&self) -> StandingTimes<'_> {
        let (kind, supposed) = self.supposed();
        StandingTimes { model: self, kind, values: supposed.values }
    }
}

impl StandingTimes<'_> {
    /// How long after the command has left a train stands that ran at a speed (m/s), in s.
    pub(crate) fn after(&self, speed: f64) -> f64 {
        let answers = Answers::new(&self.values, self.model.steps());
        let stop = self.stop(&answers, speed);
        let late = stop.distance_to_rest() / speed.max(f64::MIN_POSITIVE);
        match self.kind {
            DecoderKind::Lagging => stop.settled(),
            DecoderKind::Even => stop.begins + 2.0 * late,
            DecoderKind::Counted => stop.begins + late / self.mean_part(&answers, speed),
        }
    }

    /// By how much later (s) that is than the model's law for all trains ends.
    pub(crate) fn later(&self, speed: f64) -> f64 {
        if speed <= 0.0 {
            return 0.0;
        }
        self.after(speed) - self.stop(&self.model.answers(), speed).settled()
    }

    fn stop(&self, answers: &Answers<'_>, speed: f64) -> Segment {
        let commanded = SpeedCommand { sent: 0.0, from: self.model.step_near(speed), to: 0, at_rest: false };
        Segment::of(&commanded, answers, Pace::steady(speed))
    }

    /// The mean of the speeds that a counter passes as it falls, as part of the first.
    fn mean_part(&self, answers: &Answers<'_>, speed: f64) -> f64 {
        let at = answers.step_at(usize::from(self.model.step_near(speed)), speed);
        let whole = at as usize;
        let (mut sum, mut below) = (0.0, 0.0);
        for step in 1..=whole {
            let here = answers.speed(step, true).min(speed);
            sum += 0.5 * (below + here);
            below = here;
        }
        sum += 0.5 * (below + speed) * (at - whole as f64);
        sum / (at * speed).max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{SpeedStep, TrainId};
    use crate::model::parameters::{FRICTION, SPEEDS, speed_at};

    /// A train of which stopping distances are known well from 0.1 to 0.5 m/s, whatever the numbers are that give them:
    /// each distance is a measurement of a sum of numbers, give or take 1 mm.
    fn known(distance: impl Fn(f64) -> f64, table: impl Fn(f64) -> f64) -> MotionModel {
        let mut model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        for step in 1..=14 {
            model.values[speed_at(step)] = libm::log(table(step as f64));
        }
        // Gauss and Newton, from what is thought of any train.
        for _ in 0..6 {
            let before = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
            let mut at = before.values.clone();
            at[SPEEDS..].copy_from_slice(&model.values[SPEEDS..]);
            let covariance = (0..SPEEDS * SPEEDS).map(|i| before.spread.between(i / SPEEDS, i % SPEEDS));
            let mut covariance: Vec<f64> = covariance.collect();
            for step in 2..=12_u8 {
                let speed = table(f64::from(step));
                let commanded = SpeedCommand { sent: 0.0, from: step, to: 0, at_rest: false };
                let of = |values: &[f64]| {
                    let stop = Segment::of(&commanded, &Answers::new(values, 14), Pace::steady(speed));
                    speed * stop.begins + stop.distance_to_rest()
                };
                let here = of(&model.values);
                let slopes: Vec<f64> = (0..SPEEDS)
                    .map(|place| {
                        let mut moved = model.values.clone();
                        moved[place] += 1e-4;
                        (of(&moved) - here) / 1e-4
                    })
                    .collect();
                let with: Vec<f64> = (0..SPEEDS)
                    .map(|i| (0..SPEEDS).map(|j| slopes[j] * covariance[i * SPEEDS + j]).sum())
                    .collect();
                let variance: f64 = (0..SPEEDS).map(|i| slopes[i] * with[i]).sum::<f64>() + 1e-6;
                let linear: f64 = (0..SPEEDS).map(|i| slopes[i] * (at[i] - model.values[i])).sum();
                let off = distance(speed) - here - linear;
                for i in 0..SPEEDS {
                    at[i] += with[i] * off / variance;
                    for j in 0..SPEEDS {
                        covariance[i * SPEEDS + j] -= with[i] * with[j] / variance;
                    }
                }
            }
            model.values = at;
            let side = model.values.len();
            let lower: Vec<f64> = (0..side)
                .flat_map(|i| (0..=i).map(move |j| (i, j)))
                .map(
                    |(i, j)| {
                        if i < SPEEDS { covariance[i * SPEEDS + j] } else { before.spread.between(i, j) }
                    },
                )
                .collect();
            model.spread = super::super::spread::Spread::of_lower_triangle(side, &lower);
        }
        model
    }

    /// Speeds of steps as an even train has them and a steep one.
    fn even(step: f64) -> f64 {
        0.045 * step
    }

    fn steep(step: f64) -> f64 {
        0.0032 * step * step
    }

    #[test]
    fn a_train_that_brakes_evenly_stands_when_its_ramp_is_over() {
        // 0.2 m/s², after 0.2 s.
        for table in [even, steep] {
            let model = known(|speed| 0.2 * speed + speed * speed / 0.4, table);
            let times = model.standing_times();
            assert_eq!(times.kind, DecoderKind::Even);
            for speed in [0.2, 0.3, 0.4] {
                let stands = 0.2 + speed / 0.2;
                assert!((times.after(speed) - stands).abs() < 0.1, "{} {stands}", times.after(speed));
            }
        }
    }

    #[test]
    fn a_train_whose_decoder_counts_down_stands_when_its_counter_does() {
        // 0.25 s a step, 0.2 s before, on a steep train: half of its speed is gone after three tenths of that.
        let distance = |speed: f64| {
            let steps = libm::sqrt(speed / 0.0032);
            0.2 * speed + 0.25 * 0.0032 * steps * steps * steps / 3.0
        };
        let model = known(distance, steep);
        let times = model.standing_times();
        assert_eq!(times.kind, DecoderKind::Counted);
        for speed in [0.2, 0.3, 0.4] {
            let stands = 0.2 + 0.25 * libm::sqrt(speed / 0.0032);
            assert!((times.after(speed) - stands).abs() < 0.15, "{} {stands}", times.after(speed));
        }
    }

    #[test]
    fn a_train_that_lags_stands_when_friction_ends_it() {
        // 1.2 s and 20 mm/s² of friction, after 0.2 s.
        let (lag, friction) = (1.2, 0.020);
        let lasts = |speed: f64| lag * libm::log1p(speed / (friction * lag));
        let model = known(|speed| (0.2 + lag) * speed - friction * lag * lasts(speed), steep);
        let times = model.standing_times();
        assert_eq!(times.kind, DecoderKind::Lagging);
        assert!((times.values[FRICTION] - friction).abs() < 0.002, "{}", times.values[FRICTION]);
        for speed in [0.2, 0.3, 0.4] {
            let stands = 0.2 + lasts(speed);
            assert!((times.after(speed) - stands).abs() < 0.15, "{} {stands}", times.after(speed));
        }
    }

    #[test]
    fn the_shape_of_a_stop_is_trusted_where_a_lag_is_clearly_the_kind() {
        let (lag, friction) = (1.2, 0.020);
        let lasts = |speed: f64| lag * libm::log1p(speed / (friction * lag));
        let lagging = known(|speed| (0.2 + lag) * speed - friction * lag * lasts(speed), steep);
        let braking = known(|speed| 0.2 * speed + speed * speed / 0.4, steep);
        assert!(lagging.stop_shape_error() < 0.5 * braking.stop_shape_error());
        // Of a train that has not stopped yet, nothing is known.
        let unknown = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        assert!((unknown.stop_shape_error() - braking.stop_shape_error()).abs() < 1e-12);
    }

    #[test]
    fn what_is_later_counts_from_when_the_law_for_all_ends() {
        let model = known(|speed| 0.2 * speed + speed * speed / 0.4, even);
        let (times, step) = (model.standing_times(), SpeedStep::new(6).expect("a step"));
        let stop = model.stop(step, crate::event::Approach::Below).time.as_s();
        let speed = even(6.0);
        assert!((times.later(speed) - (times.after(speed) - stop)).abs() < 1e-9);
        assert!(times.later(0.0).abs() < 1e-12);
    }
}
