//! The motion model of a train, for charts of speeds and stopping distances.

use footplate_core::model::{MotionModel, StepUse, StopForecast};
use footplate_core::{Approach, HALF_95, SpeedStep};
use serde::Serialize;

use super::picture::tenths;

/// A motion model, step by step.
#[derive(Debug, Serialize)]
pub(super) struct ModelPicture {
    train: u16,
    highest: u8,
    steps: Vec<StepPicture>,
}

/// A step reached from one side. Intervals are 95 %.
#[derive(Debug, Serialize)]
struct StepPicture {
    step: u8,
    approach: &'static str,
    /// `untried`, `moves` or `unreliable`.
    uses: StepUse,
    speed_mm_per_s: f64,
    speed_half_mm_per_s: f64,
    /// Detections at this step.
    contacts: u32,
    stop_mm: f64,
    /// Half the interval of the mean stopping distance.
    stop_doubt_half_mm: f64,
    /// Half the interval of a single stop: uncertainty of the mean and scatter together.
    stop_half_mm: f64,
    stop_s: f64,
    /// Stops measured from this step.
    stops: u32,
}

impl ModelPicture {
    pub(super) fn of(model: &MotionModel) -> Self {
        let steps = (1..=model.highest().get()).filter_map(SpeedStep::new);
        let both = [(Approach::Below, "below"), (Approach::Above, "above")];
        let step =
            |step: SpeedStep| both.map(|(approach, name)| StepPicture::of(model, step, approach, name));
        Self {
            train: model.train().0,
            highest: model.highest().get(),
            // The highest step cannot be reached from above.
            steps: steps.flat_map(step).filter(|step| !step.is_above(model.highest())).collect(),
        }
    }
}

impl StepPicture {
    fn of(model: &MotionModel, step: SpeedStep, approach: Approach, name: &'static str) -> Self {
        let speed = model.speed(step, approach);
        let StopForecast { distance, doubt: uncertainty, scatter, time, count } = model.stop(step, approach);
        let both = libm::hypot(uncertainty.as_mm(), scatter.as_mm());
        Self {
            step: step.get(),
            approach: name,
            uses: model.uses(step),
            speed_mm_per_s: tenths(speed.value.as_mm_per_s()),
            speed_half_mm_per_s: tenths(HALF_95 * speed.uncertainty.as_mm_per_s()),
            contacts: speed.count,
            stop_mm: tenths(distance.as_mm()),
            stop_doubt_half_mm: tenths(HALF_95 * uncertainty.as_mm()),
            stop_half_mm: tenths(HALF_95 * both),
            stop_s: tenths(time.as_s()),
            stops: count,
        }
    }

    fn is_above(&self, highest: SpeedStep) -> bool {
        self.step == highest.get() && self.approach == "above"
    }
}
