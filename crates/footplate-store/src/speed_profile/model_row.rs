//! The numbers of a motion model by step, as other programs can take them.

use std::fmt::Write;

use footplate_core::model::{MotionModel, StepUse};
use footplate_core::{Approach, SpeedStep};

/// What a model says about one step, reached from below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelRow {
    /// The step.
    pub step: SpeedStep,
    /// The throttle setting, from 0 to 1.
    pub throttle: f64,
    /// The steady speed (mm/s).
    pub speed_mm_s: f64,
    /// One standard deviation of it.
    pub uncertainty_mm_s: f64,
    /// The stopping distance (mm).
    pub stop_mm: f64,
    /// One standard deviation of it.
    pub stop_uncertainty_mm: f64,
    /// One standard deviation of single stops (mm).
    pub stop_scatter_mm: f64,
    /// The time of a stop (s).
    pub stop_s: f64,
    /// Sensors passed at this step, and stops from it, that were measured.
    pub measurements: [u32; 2],
}

impl ModelRow {
    /// The rows of all steps that have moved the train. Other steps are extrapolations, which no other program could tell from
    /// measurements.
    pub fn of_model(model: &MotionModel) -> Vec<Self> {
        let highest = f64::from(model.highest().get());
        let steps = (1..=model.highest().get()).filter_map(SpeedStep::new);
        let row = |step: SpeedStep| {
            let (speed, stop) = (model.speed(step, Approach::Below), model.stop(step, Approach::Below));
            Self {
                step,
                throttle: f64::from(step.get()) / highest,
                speed_mm_s: speed.value.as_mm_per_s(),
                uncertainty_mm_s: speed.uncertainty.as_mm_per_s(),
                stop_mm: stop.distance.as_mm(),
                stop_uncertainty_mm: stop.doubt.as_mm(),
                stop_scatter_mm: stop.scatter.as_mm(),
                stop_s: stop.time.as_s(),
                measurements: [speed.count, stop.count],
            }
        };
        steps.filter(|step| model.uses(*step) == StepUse::Moves).map(row).collect()
    }
}

/// The rows as CSV. A motion model has one speed for both directions.
pub fn write_profile_table(rows: &[ModelRow]) -> String {
    let mut text =
        "step,forward_mm_s,reverse_mm_s,uncertainty_mm_s,stop_mm,stop_uncertainty_mm,stop_scatter_mm,stop_s,\
                    sensors_passed,stops_measured\n"
            .to_owned();
    for row in rows {
        let [passed, stops] = row.measurements;
        // A string takes all that is written to it.
        let _ = writeln!(
            text,
            "{},{:.2},{:.2},{:.2},{:.1},{:.1},{:.1},{:.2},{passed},{stops}",
            row.step,
            row.speed_mm_s,
            row.speed_mm_s,
            row.uncertainty_mm_s,
            row.stop_mm,
            row.stop_uncertainty_mm,
            row.stop_scatter_mm,
            row.stop_s,
        );
    }
    text
}
