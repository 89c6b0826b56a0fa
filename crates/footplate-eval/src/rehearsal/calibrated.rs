//! A train calibrated from nothing, as a person would let it.

use footplate_core::control::{Calibrator, CalibratorSettings, Machine};
use footplate_core::model::MotionFit;
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::tracking::Locator;
use footplate_core::{SpeedStep, TimeSpan, TrainId};

use super::VirtualLine;

/// Steps of the decoders that all figures are about.
const HIGHEST: u8 = 14;
/// A calibration that has not ended so long after its budget is taken as it is.
const PATIENCE: TimeSpan = TimeSpan::from_s(420.0);

/// What a calibration leaves to whoever drives next.
#[derive(Clone)]
pub struct Calibrated {
    /// What was found.
    pub model: MotionModel,
    /// What it follows from, to learn on.
    pub fit: MotionFit,
    /// Where the train is.
    pub locator: Locator,
    /// How turnouts lie.
    pub turnouts: TurnoutStates,
    /// Track time that it took, in s.
    pub seconds: f64,
    /// Why it ended.
    pub ending: String,
}

/// Calibrates a train from nothing, within a budget of track time. It has to be alone on the layout.
pub fn calibrate(
    layout: &Layout,
    line: &mut VirtualLine<'_>,
    train: TrainId,
    budget: TimeSpan,
) -> Calibrated {
    let highest = SpeedStep::new(HIGHEST).unwrap_or(SpeedStep::STAND);
    let settings = CalibratorSettings { budget, ..CalibratorSettings::default() };
    let mut calibrator = Calibrator::new(layout, settings, MotionFit::new(train, highest));
    let began = line.now();
    let patience = began + PATIENCE + budget;
    // It begins with the first word it hears.
    calibrator.handle_timeout(began);
    while line.now() < patience && calibrator.ending().is_none() {
        let _ = line.drive(&mut calibrator, patience);
    }
    let (turnouts, locator) = (calibrator.turnouts().clone(), calibrator.locator().clone());
    let ending = format!("{:?}", calibrator.ending());
    let fit = calibrator.into_fit();
    Calibrated {
        turnouts,
        locator,
        seconds: (line.now() - began).as_s(),
        ending,
        model: fit.model().clone(),
        fit,
    }
}
