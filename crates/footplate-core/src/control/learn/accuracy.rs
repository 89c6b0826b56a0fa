//! What has been reached: for each step and approach, the speed, the stop and how well both are known.

use alloc::vec::Vec;

use crate::estimate::{Estimate, HALF_95};
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::{MotionModel, StepUse, StopForecast};
use crate::units::{Length, Ratio, Speed};

/// One line of the table of what is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepAccuracy {
    /// The step.
    pub step: SpeedStep,
    /// From where it is reached.
    pub approach: Approach,
    /// The steady speed.
    pub speed: Estimate<Speed>,
    /// The stop from it.
    pub stop: StopForecast,
    /// Stops made from it in this session.
    pub stops: u32,
}

impl StepAccuracy {
    /// What the model says of a step.
    #[must_use]
    pub fn of(model: &MotionModel, step: SpeedStep, approach: Approach, stops: u32) -> Self {
        let (speed, stop) = (model.speed(step, approach), model.stop(step, approach));
        Self { step, approach, speed, stop, stops }
    }

    /// How far from where it is expected a stop may end, in 95 of 100 cases.
    #[must_use]
    pub fn stop_within(&self) -> Length {
        let (doubt, scatter) = (self.stop.doubt.as_m(), self.stop.scatter.as_m());
        Length::from_m(HALF_95 * libm::hypot(doubt, scatter))
    }

    /// How far off the speed may be, in 95 of 100 cases, as a part of it.
    #[must_use]
    pub fn speed_within(&self) -> Ratio {
        let (value, uncertainty) = (self.speed.value.as_m_per_s(), self.speed.uncertainty.as_m_per_s());
        Ratio::from_parts(if value > 0.0 { HALF_95 * uncertainty / value } else { f64::INFINITY })
    }
}

/// The steps with numbers of their own that move the train, lowest first.
#[must_use]
pub fn usable_steps(model: &MotionModel) -> Vec<SpeedStep> {
    model.knots().filter(|step| model.uses(*step) == StepUse::Moves).collect()
}
