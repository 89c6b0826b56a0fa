//! When a train that was told to stop stands, by the kind of decoder that it most likely has.
//!
//! One set of numbers tells the ways of all decoders, and says little of their times: a stop that dies away and one that ends
//! may be as long and half a second, or two, apart. Nobody sees a train come to rest, so that the kind is told by how ways
//! grow with speed. It is one of three, and each knows something beforehand that the [model](MotionModel) of all does not:
//!
//! | kind | its set speed | knows | stands after |
//! |---|---|---|---|
//! | lagging | jumps, the motor lags behind | no ramp: κ and ρ are nothing | `q + θ ln(1 + v/fθ)`, when friction ends it |
//! | even | falls evenly, rounded or eased alike at both ends | ρ is nothing, θ is short | `q + 2D`: it is as late at the end as in the middle |
//! | counted | falls step by step through the speed table | κ is nearly nothing, θ is short | `q + D/m`, `m` the mean of the speeds passed over the first |
//!
//! with `q` the delay until it takes effect and `D` the way from there over the speed `v`. What laws leave over is little in
//! each. What the numbers are for a kind follows from their covariance: what was thought of them beforehand is exchanged for
//! what the kind knows (Gauss; Kalman, 1960), nothing is fitted anew. How well they bear that is the evidence for the kind
//! (MacKay, 1992), and the kind with most of it is taken.
#![expect(
    clippy::indexing_slicing,
    reason = "places of single numbers and nodes are below the side of the matrix"
)]

use alloc::vec::Vec;

use super::model::MotionModel;
use super::parameters::{Answers, DOWN, NODES, PRIOR, SPEEDS, STOP_NODES};
use super::priors::whitened;
use super::segment::{Pace, Segment, Told};

/// Places of lag, `κ` and `ρ` on the way down.
const LAG: usize = DOWN + 1;
const KAPPA: usize = DOWN + 2;
const RHO: usize = DOWN + 3;

/// No ramp by speed (s² per m), give or take a tenth of a second of a usual stop.
const NO_KAPPA: (f64, f64) = (0.0, 0.2);
/// No ramp by step (s), give or take a tenth of a second of a usual stop.
const NO_RHO: (f64, f64) = (0.0, 0.015);
/// The speeds that a counter passes are no straight line: a stop from a faster step takes a little more for each, or less.
const LITTLE_KAPPA: (f64, f64) = (0.0, 1.0);
/// Motors that are held to a set speed follow within a tenth of a second; windows that round a ramp are up to 0.9 s, half of
/// which counts as lag.
const SHORT_LAG: (f64, f64) = (0.15, 0.15);
/// What the law of a kind leaves over, as part of what one for all does (published fits of stops: 1.6 to 3.6 mm by the right
/// law, where others miss by 10 to 16).
const LEFT_OVER: f64 = 0.3;

/// What a decoder makes of a stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Lagging,
    Even,
    Counted,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Lagging, Self::Counted, Self::Even];

    /// What it knows: places with mean and standard deviation.
    const fn knows(self) -> [(usize, (f64, f64)); 2] {
        match self {
            Self::Lagging => [(KAPPA, NO_KAPPA), (RHO, NO_RHO)],
            Self::Even => [(RHO, NO_RHO), (LAG, SHORT_LAG)],
            Self::Counted => [(KAPPA, LITTLE_KAPPA), (LAG, SHORT_LAG)],
        }
    }
}

/// A model's numbers as they are if something is known that its prior did not say.
struct Supposed {
    /// The model's, of which the first [`SPEEDS`] are exchanged.
    values: Vec<f64>,
    /// Their covariance, row after row.
    covariance: Vec<f64>,
    /// ln of how many times as likely it makes what was seen.
    evidence: f64,
}

impl Supposed {
    fn of(model: &MotionModel, kind: Kind) -> Self {
        let covariance =
            (0..SPEEDS * SPEEDS).map(|place| model.spread.between(place / SPEEDS, place % SPEEDS));
        let mut supposed =
            Self { values: model.values.clone(), covariance: covariance.collect(), evidence: 0.0 };
        for (place, known) in kind.knows() {
            supposed.exchange(&[(place, 1.0)], PRIOR[place], known);
        }
        for (node, weights) in whitened().iter().enumerate() {
            let mut sum = [(STOP_NODES, 0.0); NODES];
            for (place, term) in sum.iter_mut().enumerate().take(node + 1) {
                *term = (STOP_NODES + place, weights[place]);
            }
            supposed.exchange(&sum, (0.0, 1.0), (0.0, LEFT_OVER));
        }
        supposed
    }

    /// Of a sum of numbers times slopes `before` was thought; now it is `known`, more narrowly. Both are a mean and a standard
    /// deviation. The ratio of two normal densities is a measurement.
    fn exchange(&mut self, sum: &[(usize, f64)], before: (f64, f64), known: (f64, f64)) {
        let [weight_before, weight] = [before, known].map(|(_, deviation)| 1.0 / (deviation * deviation));
        let precision = weight - weight_before;
        let measured = (weight * known.0 - weight_before * before.0) / precision;
        let mut with = [0.0; SPEEDS];
        for (place, covariance) in with.iter_mut().enumerate() {
            *covariance =
                sum.iter().map(|(other, slope)| slope * self.covariance[place * SPEEDS + other]).sum();
        }
        let variance = sum.iter().map(|(place, slope)| slope * with[*place]).sum::<f64>() + 1.0 / precision;
        let off = measured - sum.iter().map(|(place, slope)| slope * self.values[*place]).sum::<f64>();
        let means = weight * known.0 * known.0
            - weight_before * before.0 * before.0
            - precision * measured * measured;
        self.evidence += libm::log(before.1 / known.1)
            - 0.5 * (means + libm::log(precision * variance) + off * off / variance);
        for place in 0..SPEEDS {
            self.values[place] += with[place] * off / variance;
            for other in 0..SPEEDS {
                self.covariance[place * SPEEDS + other] -= with[place] * with[other] / variance;
            }
        }
    }
}

/// When a train stands that was told to stop.
#[derive(Debug, Clone)]
pub(crate) struct StandingTimes<'m> {
    model: &'m MotionModel,
    kind: Kind,
    /// Its numbers, if it is of the kind.
    values: Vec<f64>,
}

impl MotionModel {
    /// When it stands that was told to stop.
    pub(crate) fn standing_times(&self) -> StandingTimes<'_> {
        let supposed = Kind::ALL.map(|kind| (kind, Supposed::of(self, kind)));
        let best =
            supposed.into_iter().max_by(|(_, one), (_, other)| one.evidence.total_cmp(&other.evidence));
        let (kind, values) =
            best.map_or_else(|| (Kind::Even, self.values.clone()), |(kind, best)| (kind, best.values));
        StandingTimes { model: self, kind, values }
    }
}

impl StandingTimes<'_> {
    /// How long after the command has left a train stands that ran at a speed (m/s), in s.
    pub(crate) fn after(&self, speed: f64) -> f64 {
        let answers = Answers::new(&self.values, self.model.steps());
        let stop = self.stop(&answers, speed);
        let late = stop.way_to_rest() / speed.max(f64::MIN_POSITIVE);
        match self.kind {
            Kind::Lagging => stop.settled(),
            Kind::Even => stop.begins + 2.0 * late,
            Kind::Counted => stop.begins + late / self.mean_part(&answers, speed),
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
        let told = Told { sent: 0.0, from: self.model.step_near(speed), to: 0, at_rest: false };
        Segment::of(&told, answers, Pace::steady(speed))
    }

    /// The mean of the speeds that a counter passes on its way down, as part of the first.
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
    use crate::calibration::motion::parameters::{FRICTION, speed_at};
    use crate::ids::{SpeedStep, TrainId};

    /// A train of which ways are known well that stop from 0.1 to 0.5 m/s, whatever the numbers are by which they are told:
    /// each way is a measurement of a sum of numbers, give or take 1 mm.
    fn known(way: impl Fn(f64) -> f64, table: impl Fn(f64) -> f64) -> MotionModel {
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
                let told = Told { sent: 0.0, from: step, to: 0, at_rest: false };
                let of = |values: &[f64]| {
                    let stop = Segment::of(&told, &Answers::new(values, 14), Pace::steady(speed));
                    speed * stop.begins + stop.way_to_rest()
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
                let off = way(speed) - here - linear;
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
            assert_eq!(times.kind, Kind::Even);
            for speed in [0.2, 0.3, 0.4] {
                let stands = 0.2 + speed / 0.2;
                assert!((times.after(speed) - stands).abs() < 0.1, "{} {stands}", times.after(speed));
            }
        }
    }

    #[test]
    fn a_train_whose_decoder_counts_down_stands_when_its_counter_does() {
        // 0.25 s a step, 0.2 s before, on a steep train: half of its speed is gone after three tenths of that.
        let way = |speed: f64| {
            let steps = libm::sqrt(speed / 0.0032);
            0.2 * speed + 0.25 * 0.0032 * steps * steps * steps / 3.0
        };
        let model = known(way, steep);
        let times = model.standing_times();
        assert_eq!(times.kind, Kind::Counted);
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
        assert_eq!(times.kind, Kind::Lagging);
        assert!((times.values[FRICTION] - friction).abs() < 0.002, "{}", times.values[FRICTION]);
        for speed in [0.2, 0.3, 0.4] {
            let stands = 0.2 + lasts(speed);
            assert!((times.after(speed) - stands).abs() < 0.15, "{} {stands}", times.after(speed));
        }
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
