//! What a calibration is to make small, as one number.
//!
//! The sum over steps and both approaches of `(u_stop² + u_run²) / s²`, with `u_stop` the uncertainty of a stop made there,
//! `u_run` the uncertainty of the distance in half a second of running (a stop is commanded about so long after the last detection),
//! and `s` the scatter that no knowledge would narrow; and over some short moves the same with their own uncertainty.
//!
//! A measurement sees a sum `hᵀx + noise` of the model's numbers `x`, whose covariance is `P`. It takes
//! `(gᵀPh)² / (hᵀPh + n)` from the variance of every other sum `gᵀx` (Kalman, 1960), which needs no measured value: so the
//! gain of an experiment is known before it is made.

use alloc::vec::Vec;

use super::expected_information::{ExpectedInformation, Seen, stop_distance};
use super::motion_model::MotionModel;
use super::short_moves::move_distance;
use crate::event::Approach;
use crate::ids::SpeedStep;

/// From the last detection to the command a stop runs about this long (s), by its speed as it is known.
const RUN_BEFORE_STOP: f64 = 0.5;

/// A scatter counts as no less than this (m): no one sees the difference on a railway of this size.
const LEAST_SCATTER: f64 = 0.006;

/// Short moves that should be known: runs (s) at every second step ...
const MOVES: [f64; 2] = [0.9, 1.6];
const MOVES_EVERY: usize = 2;
/// ... that is no faster than this (m/s): no one makes short moves at full speed.
const FASTEST_MOVE: f64 = 0.3;
/// Part of its distance by which a short move may be off.
const MOVE_PART: f64 = 0.02;

/// What is wanted of a model, with its slopes and how much it counts.
#[derive(Debug, Clone, PartialEq)]
pub struct Objective {
    targets: Vec<(Vec<(usize, f64)>, f64)>,
}

impl Objective {
    /// Stops, speeds and short moves at some steps.
    pub fn of(model: &MotionModel, steps: &[SpeedStep]) -> Self {
        let mut targets = Vec::new();
        for step in steps.iter().map(|step| step.get()) {
            for above in [false, true] {
                let speed = model.answers().speed(usize::from(step), above);
                let scatter = model.scatter.of_stop(speed).max(LEAST_SCATTER);
                let weight = 1.0 / (scatter * scatter);
                targets.push((model.slopes(|answers| stop_distance(answers, step, above)), weight));
                let run = |answers: &super::parameters::Answers<'_>| {
                    RUN_BEFORE_STOP * answers.speed(usize::from(step), above)
                };
                targets.push((model.slopes(run), weight));
            }
        }
        let slow = |step: &u8| model.answers().speed(usize::from(*step), false) <= FASTEST_MOVE;
        for step in steps.iter().map(|step| step.get()).filter(slow).step_by(MOVES_EVERY) {
            for run in MOVES {
                let may_be_off = (MOVE_PART * move_distance(&model.answers(), step, run)).max(LEAST_SCATTER);
                let weight = 1.0 / (may_be_off * may_be_off);
                targets.push((model.slopes(|answers| move_distance(answers, step, run)), weight));
            }
        }
        Self { targets }
    }

    /// Its value: the squared uncertainties relative to the scatter, summed.
    pub fn value(&self, model: &MotionModel) -> f64 {
        self.targets.iter().map(|(slopes, weight)| weight * model.spread.variance_along(slopes)).sum()
    }

    /// By how much an experiment is expected to lower it.
    pub fn gain(&self, model: &MotionModel, prospect: &ExpectedInformation) -> f64 {
        let mut before: Vec<(&Seen, f64)> = Vec::new();
        let mut gain = 0.0;
        for seen in &prospect.seen {
            // What the sums seen before it leave of this one: Gram and Schmidt in the metric of the covariance.
            let mut left = model.spread.variance_along(&seen.slopes) + seen.variance;
            for (other, variance) in &before {
                let shared = model.spread.covariance_of(&seen.slopes, &other.slopes);
                left -= shared * shared / variance;
            }
            let left = left.max(seen.variance);
            for (target, weight) in &self.targets {
                let mut shared = model.spread.covariance_of(target, &seen.slopes);
                for (other, variance) in &before {
                    let with_target = model.spread.covariance_of(target, &other.slopes);
                    let with_seen = model.spread.covariance_of(&seen.slopes, &other.slopes);
                    shared -= with_target * with_seen / variance;
                }
                gain += weight * shared * shared / left;
            }
            before.push((seen, left));
        }
        gain
    }
}

impl MotionModel {
    /// The uncertainty of a stop at a step once an experiment has been made (m), for showing what a plan would reach.
    pub fn stop_doubt_after(
        &self,
        step: SpeedStep,
        approach: Approach,
        prospect: &ExpectedInformation,
    ) -> f64 {
        let slopes = self.slopes(|answers| stop_distance(answers, step.get(), approach == Approach::Above));
        let one = Objective { targets: alloc::vec![(slopes, 1.0)] };
        libm::sqrt((one.value(self) - one.gain(self, prospect)).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TrainId;
    use crate::time::TimeSpan;
    use std::vec::Vec as List;

    fn step(number: u8) -> SpeedStep {
        SpeedStep::new(number).unwrap()
    }

    #[test]
    fn an_experiment_gains_most_where_it_is_made_and_never_more_than_there_is() {
        let model = MotionModel::unknown(TrainId(24), step(14));
        let steps: List<SpeedStep> = (4..=10).map(step).collect();
        let objective = Objective::of(&model, &steps);
        let prospect = model.prospect_of_stop(step(8), Approach::Below, step(3), None);
        let gain = objective.gain(&model, &prospect);
        assert!(gain > 0.0 && gain < objective.value(&model));
        let part = |at: u8| {
            let before = model.stop(step(at), Approach::Below).doubt.as_m();
            model.stop_doubt_after(step(at), Approach::Below, &prospect) / before
        };
        assert!(part(8) < part(9) && part(8) < part(4), "{} {} {}", part(8), part(9), part(4));
    }

    #[test]
    fn speeds_and_moves_gain_something_too() {
        let model = MotionModel::unknown(TrainId(24), step(14));
        let objective = Objective::of(&model, &[step(6), step(9)]);
        let speed = model.prospect_of_speed(step(9), Approach::Above);
        let short = model.prospect_of_move(step(6), TimeSpan::from_s(1.2), step(3));
        assert!(objective.gain(&model, &speed) > 0.0);
        assert!(objective.gain(&model, &short) > 0.0);
    }
}
