//! One passage of a sensor with all its forecasts.

use footplate_core::tracking::{ForecastPhase, Hit};
use footplate_core::{RunId, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::reference_forecaster::ReferenceForecaster;

/// A passage and the forecasts of its report.
///
/// A forecast states when the sensor that did report would report if it were the next: the forecaster gets the path of
/// the report, but never its time. `hit.named` states whether that sensor had been named as the next.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoredHit {
    /// The run.
    pub run: RunId,
    /// The line of the file that reports it.
    pub line: u64,
    /// The train.
    pub train: TrainId,
    /// The passage and our forecast.
    pub hit: Hit,
    /// The forecast time of each reference, in the order of [`ReferenceForecaster::ALL`].
    pub(super) references: [Option<Timestamp>; ReferenceForecaster::ALL.len()],
}

impl ScoredHit {
    /// When the sensor was reported.
    pub const fn reported(&self) -> Timestamp {
        self.hit.passage.window.until
    }

    /// The commanded step.
    pub const fn step(&self) -> SpeedStep {
        self.hit.passage.drive.step
    }

    /// The phase of motion on the path; `None` without a forecast.
    pub fn phase(&self) -> Option<ForecastPhase> {
        self.hit.forecast.map(|forecast| forecast.phase)
    }

    /// The delay against our forecast.
    pub fn late(&self) -> Option<TimeSpan> {
        self.hit.forecast.map(|forecast| forecast.detection_error(self.reported()))
    }

    /// The delay against the forecast of a reference.
    pub fn late_by(&self, reference: ReferenceForecaster) -> Option<TimeSpan> {
        let expected = self.references.get(reference as usize).copied().flatten()?;
        Some(self.reported() - expected)
    }

    /// A delay at this sensor in millimetres: at the speed that our estimator forecasts there, for all forecasters
    /// alike.
    pub fn distance_mm(&self, late: TimeSpan) -> Option<f64> {
        self.hit.forecast.map(|forecast| (forecast.speed * late).as_mm())
    }

    /// The level of the narrowest central interval of our forecast that contains the report: 0 in the middle, 1 far
    /// outside.
    pub fn level(&self) -> Option<f64> {
        self.hit.forecast.map(|forecast| (2.0 * forecast.probability_by(self.reported()) - 1.0).abs())
    }
}
