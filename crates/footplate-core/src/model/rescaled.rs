//! The model of a train that runs otherwise than it did: the old one, as much faster or slower as was measured.
//!
//! Letters: `r` new speed over old. Wheels that slip, a weak supply and a cold motor let everything take the same times
//! over shorter distances: delays, lags and ramps by step stay, ramps by speed (`κ`, s per m/s) become `κ/r`, and what is left
//! over of stops and starts `r` times as long. Decoders that slow down at one rate shorten stops by `r` once more; what
//! lies between the two is uncertain, until a stop is measured.
//!
//! The numbers are scaled by a diagonal matrix `A` and variances are added: `Σ′ = A Σ Aᵀ + N`, with `N` a sum of squares, so
//! that the covariance stays one.

use alloc::vec;
use alloc::vec::Vec;

use super::motion_model::MotionModel;
use super::parameters::{
    DOWN, FRICTION, HYSTERESIS, NODES, SPEEDS, START_NODES, STOP_NODES, UP, hysteresis_at, knots, speed_at,
    stride,
};
use super::spread::Spread;
use crate::ids::SpeedStep;

/// No train becomes faster or slower than this by a factor and is still the same.
const MOST: f64 = 5.0;
/// Steps that were not measured differ from those that were by at least this part (chosen: repeats of one run differ by
/// half as much).
const LEAST_DEVIATION: f64 = 0.01;
/// Speeds of one train differ by no more than this between two sessions (2 % is one deviation over the pairs of sessions of the
/// published logs); more is dirt or another engine.
const OTHER_SPEEDS: f64 = 0.05;
/// Stops that are longer or shorter by more than this part have changed (chosen: twice what differs between two sessions).
const OTHER_STOPS: f64 = 0.10;
/// What is not known of stops where speeds are as they were.
const LEAST_STOP_DEVIATION: f64 = 0.01;

/// A speed measured anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredRatio {
    /// The step.
    pub step: SpeedStep,
    /// Its speed over what the model says.
    pub ratio: f64,
    /// One standard deviation of its logarithm.
    pub deviation: f64,
}

/// How a train has changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Rescaling {
    /// What was measured.
    pub measured: Vec<MeasuredRatio>,
    /// The ratio of all other speeds.
    pub ratio: f64,
    /// One standard deviation of its logarithm: how far the measured ones are from each other.
    pub deviation: f64,
    /// Stopping distances over what the ratio of speeds makes of them.
    pub stops: f64,
    /// One standard deviation of that.
    pub stops_deviation: f64,
}

impl Rescaling {
    /// What follows from speeds measured anew, without a stop: the other steps by the geometric mean. Nothing measured is
    /// no change.
    pub fn of(measured: Vec<MeasuredRatio>) -> Self {
        let usable: Vec<MeasuredRatio> = measured
            .into_iter()
            .filter(|one| (1.0 / MOST..=MOST).contains(&one.ratio) && one.deviation.is_finite())
            .collect();
        let count = usable.len().max(1) as f64;
        let mean = usable.iter().map(|one| libm::log(one.ratio)).sum::<f64>() / count;
        let apart = |one: &MeasuredRatio| libm::pow(libm::log(one.ratio) - mean, 2.0);
        // Of so few the spread is hardly known: by one less than their number, as usual.
        let spread = libm::sqrt(usable.iter().map(apart).sum::<f64>() / (count - 1.0).max(1.0));
        let own = usable.iter().map(|one| one.deviation * one.deviation).sum::<f64>() / count;
        let ratio = libm::exp(mean);
        Self {
            measured: usable,
            ratio,
            deviation: libm::hypot(spread, libm::sqrt(own)).max(LEAST_DEVIATION),
            stops: 1.0,
            stops_deviation: 0.5 * (1.0 - ratio).abs() + LEAST_STOP_DEVIATION,
        }
    }

    /// A train of which it is unknown whether it is as it was or differs by about this part.
    pub const fn uncertain_by(part: f64) -> Self {
        Self { measured: Vec::new(), ratio: 1.0, deviation: part, stops: 1.0, stops_deviation: part }
    }

    /// By how much the ratios are apart: the largest over the smallest.
    pub fn disagreement(&self) -> f64 {
        let ratios = || self.measured.iter().map(|one| one.ratio);
        let (least, most) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
        if least > 0.0 && most > 0.0 { most / least } else { 1.0 }
    }

    /// Stops may be longer or shorter by about such a part of their distance.
    pub fn widen_stops(&mut self, part: f64) {
        if part.is_finite() {
            self.stops_deviation = self.stops_deviation.max(part.abs().min(MOST));
        }
    }

    /// Whether speeds differ by more than from one session to the next.
    pub fn has_other_speeds(&self) -> bool {
        (self.ratio - 1.0).abs() > OTHER_SPEEDS
    }

    /// Whether stops differ by more than its speeds explain.
    pub fn has_other_stops(&self) -> bool {
        (self.stops - 1.0).abs() > OTHER_STOPS
    }

    /// Takes in that a stop went on for so much longer than was forecast, as a part of its distance, with one standard deviation
    /// of what was measured.
    pub fn take_stop(&mut self, longer: f64, deviation: f64) {
        if !longer.is_finite() || !deviation.is_finite() {
            return;
        }
        let (before, seen) = (self.stops_deviation * self.stops_deviation, deviation * deviation);
        let gain = before / (before + seen).max(f64::MIN_POSITIVE);
        self.stops = (self.stops * (1.0 + gain * longer)).clamp(1.0 / MOST, MOST);
        self.stops_deviation = libm::sqrt(before * (1.0 - gain)).max(LEAST_STOP_DEVIATION);
    }
}

/// What a change makes of the numbers of one model: new values, and what is known of them.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangedNumbers {
    values: Vec<f64>,
    /// By what their deviations from the old values count in the new ones.
    scale: Vec<f64>,
    /// Those that were measured anew.
    measured: Vec<usize>,
    /// Deviations that several of them have in common, ...
    common: [Vec<f64>; 3],
    /// ... and the variance of each by itself.
    own: Vec<f64>,
}

impl ChangedNumbers {
    /// What a number is that was off an old value by so much.
    pub(super) fn value(&self, place: usize, off: f64) -> f64 {
        at(&self.values, place) + self.scale(place) * off
    }

    fn scale(&self, place: usize) -> f64 {
        self.scale.get(place).copied().unwrap_or(1.0)
    }

    /// The covariance of two numbers, given what it was. Numbers that are not the train's stay as they are.
    pub(super) fn covariance(&self, one: usize, other: usize, before: f64) -> f64 {
        let shared: f64 = self.common.iter().map(|common| at(common, one) * at(common, other)).sum();
        let own = if one == other { at(&self.own, one) } else { 0.0 };
        self.scale(one) * self.scale(other) * before + shared + own
    }
}

fn at(values: &[f64], place: usize) -> f64 {
    values.get(place).copied().unwrap_or(0.0)
}

impl MotionModel {
    /// The same train changed like this, as uncertain as what was measured leaves it.
    #[must_use]
    pub fn rescaled(&self, change: &Rescaling) -> Self {
        self.with_numbers(&self.changed_numbers(change))
    }

    /// The same train with other numbers.
    pub(crate) fn with_numbers(&self, numbers: &ChangedNumbers) -> Self {
        let side = self.values.len();
        let lower: Vec<f64> = (0..side)
            .flat_map(|i| (0..=i).map(move |j| (i, j)))
            .map(|(i, j)| {
                // What was measured anew owes nothing to what was known.
                let is_new = [i, j].iter().any(|place| numbers.measured.contains(place));
                numbers.covariance(i, j, if is_new { 0.0 } else { self.spread.between(i, j) })
            })
            .collect();
        let mut changed = self.clone();
        changed.values = numbers.values.clone();
        changed.spread = Spread::of_lower_triangle(side, &lower);
        changed
    }

    /// Its numbers once it has changed like this.
    pub fn changed_numbers(&self, change: &Rescaling) -> ChangedNumbers {
        let ratio = change.ratio.clamp(1.0 / MOST, MOST);
        let stops = change.stops.clamp(1.0 / MOST, MOST);
        let (steps, side) = (self.steps(), self.values.len());
        let (knots, stride) = (knots(steps), stride(steps));
        let mut scale = vec![1.0; side];
        let mut set = |place: usize, by: f64| {
            if let Some(slot) = scale.get_mut(place) {
                *slot *= by;
            }
        };
        for place in [UP + 2, DOWN + 2] {
            set(place, 1.0 / ratio);
        }
        for place in [FRICTION, HYSTERESIS] {
            set(place, ratio);
        }
        (1..=knots).for_each(|knot| set(hysteresis_at(knot, steps), ratio));
        let stop_nodes = STOP_NODES..STOP_NODES + NODES;
        let start_nodes = START_NODES..START_NODES + NODES;
        stop_nodes.clone().chain(start_nodes.clone()).for_each(|place| set(place, ratio));
        // Lag and ramps down make the stopping distance.
        let of_stops = || (DOWN + 1..DOWN + 4).chain(stop_nodes.clone());
        let of_starts = || (UP + 1..UP + 4).chain(start_nodes.clone());
        of_stops().for_each(|place| set(place, stops));
        let mut values: Vec<f64> = self.values.iter().zip(&scale).map(|(value, by)| value * by).collect();

        debug_assert_eq!(speed_at(1), SPEEDS);
        // A step between two knots counts for the nearest.
        let knot_of = |step: SpeedStep| ((usize::from(step.get()) + stride / 2) / stride).max(1);
        let measured = |knot: usize| change.measured.iter().find(|one| knot_of(one.step) == knot);
        for knot in 1..=knots {
            let by = measured(knot).map_or(ratio, |one| one.ratio.clamp(1.0 / MOST, MOST));
            if let Some(value) = values.get_mut(speed_at(knot)) {
                *value += libm::log(by);
            }
        }
        let along = |places: &mut dyn Iterator<Item = usize>| {
            let mut deviations = vec![0.0; side];
            for place in places {
                if let Some(slot) = deviations.get_mut(place) {
                    *slot = at(&values, place) * change.stops_deviation;
                }
            }
            deviations
        };
        let mut unmeasured = vec![0.0; side];
        for knot in (1..=knots).filter(|knot| measured(*knot).is_none()) {
            if let Some(slot) = unmeasured.get_mut(speed_at(knot)) {
                *slot = change.deviation;
            }
        }
        // What is not known of steps that were not measured they have once in common, and once each to itself.
        let common = [along(&mut of_stops()), along(&mut of_starts()), unmeasured.clone()];
        let own = |place: usize| {
            let of_speed = (SPEEDS..SPEEDS + knots).contains(&place).then(|| place + 1 - SPEEDS);
            let new = of_speed.and_then(measured).map_or(0.0, |one| one.deviation);
            new * new + at(&unmeasured, place) * at(&unmeasured, place)
        };
        let own = (0..side).map(own).collect();
        let measured = (1..=knots).filter(|knot| measured(*knot).is_some()).map(speed_at).collect();
        ChangedNumbers { values, scale, measured, common, own }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Approach;
    use crate::ids::TrainId;

    fn step(number: u8) -> SpeedStep {
        SpeedStep::new(number).unwrap()
    }

    fn known() -> MotionModel {
        let model = MotionModel::unknown(TrainId(24), step(14));
        let mut numbers = model.numbers();
        numbers.covariance.iter_mut().for_each(|covariance| *covariance *= 1e-4);
        MotionModel::from_numbers(&numbers).unwrap()
    }

    fn ratio(number: u8, ratio: f64) -> MeasuredRatio {
        MeasuredRatio { step: step(number), ratio, deviation: 0.006 }
    }

    #[test]
    fn a_train_with_dirty_wheels_is_slower_at_every_step_and_stops_as_much_shorter() {
        let before = known();
        let change = Rescaling::of(vec![ratio(5, 0.8), ratio(8, 0.8), ratio(11, 0.8)]);
        let after = before.rescaled(&change);
        for number in [3, 5, 9, 14] {
            let speed = |model: &MotionModel| model.speed(step(number), Approach::Below);
            assert!((speed(&after).value / speed(&before).value - 0.8).abs() < 1e-9);
            let stop = |model: &MotionModel| model.stop(step(number), Approach::Below);
            let shorter = stop(&after).distance / stop(&before).distance;
            assert!((shorter - 0.8).abs() < 0.03, "{shorter}");
            // Slowing down at one rate would make it 0.64.
            assert!(stop(&after).doubt > stop(&before).distance * 0.05);
        }
        let measured = after.speed(step(5), Approach::Below);
        let other = after.speed(step(6), Approach::Below);
        assert!(measured.uncertainty < other.uncertainty);
    }

    #[test]
    fn a_measured_step_is_as_uncertain_as_its_measurement_and_others_by_what_they_have_in_common_and_each_to_itself()
     {
        let before = known();
        let change = Rescaling::of(vec![ratio(5, 0.8), ratio(8, 0.8), ratio(11, 0.8)]);
        let after = before.rescaled(&change);
        let part = |model: &MotionModel, number: u8| {
            let speed = model.speed(step(number), Approach::Below);
            speed.uncertainty / speed.value
        };
        // The highest step has a number of its own and was not measured.
        let others = libm::hypot(core::f64::consts::SQRT_2 * change.deviation, part(&before, 14));
        assert!((part(&after, 14) / others - 1.0).abs() < 0.05, "{}, not {others}", part(&after, 14));
        for number in [5, 8, 11] {
            assert!(part(&after, number) > 0.004 && part(&after, number) < 0.5 * others, "{number}");
        }
    }

    #[test]
    fn a_stop_that_was_measured_narrows_what_is_not_known_of_stops() {
        let mut change = Rescaling::of(vec![ratio(8, 0.8)]);
        let before = change.stops_deviation;
        change.take_stop(-0.1, 0.05);
        assert!(change.stops < 0.95 && change.stops > 0.9 && change.stops_deviation < before);
        change.take_stop(f64::NAN, 0.05);
        assert!(change.stops.is_finite());
    }

    #[test]
    fn nothing_measured_is_no_change_but_for_uncertainty() {
        let before = known();
        assert_eq!(before.rescaled(&Rescaling::uncertain_by(0.0)), before);
        let uncertain = before.rescaled(&Rescaling::uncertain_by(0.3));
        let speed = uncertain.speed(step(7), Approach::Below);
        assert!(speed.uncertainty / speed.value > 0.3);
        assert!((Rescaling::of(vec![ratio(5, 0.5), ratio(9, 1.0)]).disagreement() - 2.0).abs() < 1e-12);
        assert!(Rescaling::of(vec![ratio(5, f64::NAN), ratio(5, -1.0)]).measured.is_empty());
    }
}
