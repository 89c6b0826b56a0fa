//! Experiments with a train, and their expected gain of information.

use core::fmt;

use super::accuracy::usable_steps;
use super::planner::creep_step;
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::{ExpectedInformation, MotionModel, Objective};
use crate::time::TimeSpan;
use crate::units::Length;

/// Length of a typical hop (the mean of the built-in layouts' circuits).
pub(super) const TYPICAL_HOP: Length = Length::from_mm(390.0);

/// A stop past a sensor ends this part of the stopping distance beyond it: the train is slow there, so that a poll
/// interval is a short distance, and nearly all of the braking is before the sensor.
const PAST_PART: f64 = 0.12;

/// ... and at least this far beyond it, ...
const LEAST_PAST: Length = Length::from_mm(25.0);

/// ... or this many standard deviations of the stopping distance, so that the train surely passes it.
const PAST_BY: f64 = 1.6;

/// An experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Experiment {
    /// Runs at a step until detections have measured its speed.
    Speed {
        /// The step.
        step: SpeedStep,
        /// From where it is reached.
        approach: Approach,
    },
    /// Stops from a steady step near a sensor, then creeps to the next one.
    Stop {
        /// The step.
        step: SpeedStep,
        /// From where it is reached.
        approach: Approach,
        /// `true`: comes to rest a little past the sensor, which times the braking; `false`: a little short of it.
        is_past: bool,
    },
    /// Runs from rest, stops before the speed is reached, then creeps to the next sensor.
    Move {
        /// The step.
        step: SpeedStep,
        /// Time from the command to start to the command to stop.
        run: TimeSpan,
    },
}

impl Experiment {
    /// The step of the experiment.
    pub const fn step(&self) -> SpeedStep {
        match self {
            Self::Speed { step, .. } | Self::Stop { step, .. } | Self::Move { step, .. } => *step,
        }
    }
}

impl fmt::Display for Experiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let from = |approach: &Approach| match approach {
            Approach::Above => "from above",
            Approach::Below | Approach::Unknown => "from below",
        };
        match self {
            Self::Speed { step, approach } => write!(f, "speed at step {step} {}", from(approach)),
            Self::Stop { step, approach, is_past } => {
                let side = if *is_past { "past" } else { "short of" };
                write!(f, "stop from step {step} {}, {side} a sensor", from(approach))
            }
            Self::Move { step, run } => write!(f, "short move of {:.1} s at step {step}", run.as_s()),
        }
    }
}

/// Why an experiment was chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// The step was never measured.
    NeverTried,
    /// It is the most informative experiment per second of track time: the sum of variances, relative to the
    /// repeatability of stops, falls the most.
    MostPerSecond {
        /// The expected gain.
        gain: f64,
        /// The expected time.
        takes: TimeSpan,
    },
}

/// The objective over the steps that move a train.
pub fn objective(model: &MotionModel) -> Objective {
    Objective::of(model, &usable_steps(model))
}

/// The expected reduction of the objective by an experiment: the only measure of its value.
pub fn gain(model: &MotionModel, objective: &Objective, experiment: &Experiment) -> f64 {
    objective.gain(model, &expected_information(model, experiment))
}

fn expected_information(model: &MotionModel, experiment: &Experiment) -> ExpectedInformation {
    let creep = creep_step(model).unwrap_or(model.highest());
    match *experiment {
        Experiment::Speed { step, approach } => model.prospect_of_speed(step, approach),
        Experiment::Stop { step, approach, is_past } => {
            let past = is_past.then(|| past_by(model, step, approach));
            model.prospect_of_stop(step, approach, creep, past)
        }
        Experiment::Move { step, run } => model.prospect_of_move(step, run, creep),
    }
}

/// How far past a sensor to come to rest so that the train passes it while braking.
pub(super) fn past_by(model: &MotionModel, step: SpeedStep, approach: Approach) -> Length {
    let stop = model.stop(step, approach);
    (PAST_PART * stop.distance).max(LEAST_PAST).max(PAST_BY * stop.deviation())
}
