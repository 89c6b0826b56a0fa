//! Calibrates an unknown train without an operator.

use footplate_core::control::{Calibrator, CalibratorSettings, Machine};
use footplate_core::model::MotionFit;
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::tracking::Locator;
use footplate_core::{SpeedStep, TimeSpan, TrainId};

use super::VirtualLine;

/// The highest step of the simulated decoders.
const HIGHEST: u8 = 14;
/// A calibration that exceeds its budget by this time is ended.
const TIMEOUT: TimeSpan = TimeSpan::from_s(420.0);

/// The results of a calibration, for the next driver.
#[derive(Clone)]
pub struct Calibrated {
    /// The calibrated model.
    pub model: MotionModel,
    /// The fit, to be continued.
    pub fit: MotionFit,
    /// The located train.
    pub locator: Locator,
    /// The turnout positions.
    pub turnouts: TurnoutStates,
    /// Simulated time that it took, in s.
    pub seconds: f64,
    /// How it ended.
    pub ending: String,
}

/// Calibrates an unknown train within a budget of simulated time. No other train may be on the layout.
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
    let patience = began + TIMEOUT + budget;
    // The first timeout starts the calibrator.
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
