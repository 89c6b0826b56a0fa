//! What an experiment is expected to bring, from what the model knows and what the experiment would see of it.

use super::accuracy::usable_steps;
use super::experiment::Experiment;
use super::planner::crawl_step;
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::{ExpectedInformation, MotionModel, Objective};
use crate::units::Length;

/// A typical hop, from contact to contact (the mean of the built-in layouts' circuits).
pub(super) const TYPICAL_HOP: Length = Length::from_mm(390.0);

/// A contact that is passed in braking is aimed at about this part of the way to rest before its end: the train is slow
/// there, so that a poll's time is a short way, and nearly all of the stop lies behind it.
const PAST_PART: f64 = 0.12;

/// ... and at least this far before its end, ...
const LEAST_PAST: Length = Length::from_mm(25.0);

/// ... or this many standard deviations of where the stop ends, so that it surely is passed.
const PAST_BY: f64 = 1.6;

/// The objective over the steps that move a train.
#[must_use]
pub fn objective(model: &MotionModel) -> Objective {
    Objective::of(model, &usable_steps(model))
}

/// By how much an experiment is expected to lower the objective: the one place that says what an experiment is worth.
#[must_use]
pub fn gain(model: &MotionModel, objective: &Objective, experiment: &Experiment) -> f64 {
    objective.gain(model, &expected_information(model, experiment))
}

fn expected_information(model: &MotionModel, experiment: &Experiment) -> ExpectedInformation {
    let crawl = crawl_step(model).unwrap_or(model.highest());
    match *experiment {
        Experiment::Speed { step, approach } => model.prospect_of_speed(step, approach),
        Experiment::Stop { step, approach, is_past } => {
            let past = is_past.then(|| past_by(model, step, approach));
            model.prospect_of_stop(step, approach, crawl, past)
        }
        Experiment::Move { step, run } => model.prospect_of_move(step, run, crawl),
    }
}

/// How far past a contact a train is to rest so that it is passed in braking.
pub(super) fn past_by(model: &MotionModel, step: SpeedStep, approach: Approach) -> Length {
    let stop = model.stop(step, approach);
    let sigma = Length::from_m(libm::hypot(stop.doubt.as_m(), stop.scatter.as_m()));
    (PAST_PART * stop.distance).max(LEAST_PAST).max(PAST_BY * sigma)
}
