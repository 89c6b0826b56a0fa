//! The accuracy of a calibration: speed and stop of each step and approach, with their uncertainties.

use alloc::vec::Vec;

use crate::estimate::{Estimate, HALF_95};
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::{MotionModel, StepUse, StopForecast};
use crate::units::{Length, Ratio, Speed};

/// The accuracy of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepAccuracy {
    /// The step.
    pub step: SpeedStep,
    /// The side from which it is reached.
    pub approach: Approach,
    /// The steady speed.
    pub speed: Estimate<Speed>,
    /// The stop from it.
    pub stop: StopForecast,
    /// Number of stops from it in this session.
    pub stops: u32,
}

impl StepAccuracy {
    /// The accuracy of a step in a model.
    pub fn of(model: &MotionModel, step: SpeedStep, approach: Approach, stops: u32) -> Self {
        let (speed, stop) = (model.speed(step, approach), model.stop(step, approach));
        Self { step, approach, speed, stop, stops }
    }

    /// Half the 95 % interval of the place of rest.
    pub fn stop_within(&self) -> Length {
        HALF_95 * self.stop.deviation()
    }

    /// Half the 95 % interval of the speed, as a fraction of it.
    pub fn speed_within(&self) -> Ratio {
        let (value, uncertainty) = (self.speed.value.as_m_per_s(), self.speed.uncertainty.as_m_per_s());
        Ratio::from_parts(if value > 0.0 { HALF_95 * uncertainty / value } else { f64::INFINITY })
    }
}

/// The steps with numbers of their own that move the train, lowest first.
pub fn usable_steps(model: &MotionModel) -> Vec<SpeedStep> {
    steps(model).filter(|step| model.uses(*step) == StepUse::Moves).collect()
}

/// The steps that a calibration measures, lowest first.
pub(super) fn steps(model: &MotionModel) -> impl DoubleEndedIterator<Item = SpeedStep> + use<> {
    model.knots()
}
