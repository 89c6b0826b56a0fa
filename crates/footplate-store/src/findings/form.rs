//! The content of a calibration report.

use footplate_core::model::report::{Direction, LawKind};
use footplate_core::{SpeedStep, TrainId};
use serde::Serialize;

use crate::motion_file::{MotionSectionForm, MotionStepForm};
use crate::quantity::Quantity;

/// The calibration of trains from recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// [`MOTION_MODEL_VERSION`](crate::MOTION_MODEL_VERSION) of the program that computed it.
    pub model_version: String,
    /// The layout.
    pub layout: String,
    /// The polling of the link in each recording.
    pub polling: Vec<PollingForm>,
    /// The trains.
    pub trains: Vec<TrainFindings>,
}

/// The polling of a link.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PollingForm {
    /// The recording.
    pub recording: String,
    /// The period between polls without a report (ms); `None` if the reports show no regular polling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period: Option<Quantity>,
    /// The time from a poll with a report to the next (ms).
    pub after_report_ms: f64,
    /// The jitter of a poll, one standard deviation (ms).
    pub jitter_ms: f64,
}

/// The calibration of a train.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainFindings {
    /// Its number.
    pub train: TrainId,
    /// The highest step of its decoder.
    pub highest_step: SpeedStep,
    /// Runs of the train; `silent_runs` of them have no passage; `contacts` is the number of detections in all.
    pub runs: u32,
    /// See `runs`.
    pub silent_runs: u32,
    /// See `runs`.
    pub contacts: u32,
    /// Speed and stop of every step that moved it, from below and from above.
    pub steps: Vec<MotionStepForm>,
    /// The deviation of a whole run from the speed of its step, one standard deviation (%).
    pub run_deviation_percent: f64,
    /// The scatter of detections about their mean place (mm).
    pub contact_scatter_mm: f64,
    /// Path lengths between sensors, relative to the survey.
    pub sections: Vec<MotionSectionForm>,
    /// The laws of its speed changes, by direction, if enough changes were recorded.
    pub laws: Vec<LawForm>,
    /// Stops measured with a tape.
    pub stops: Vec<TapedStopForm>,
    /// Unlikely reports; they have little weight in the fit.
    pub suspicious: Vec<SuspicionForm>,
}

/// The law of one direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawForm {
    /// Acceleration or deceleration.
    pub direction: Direction,
    /// The number of speed changes that it was fitted to.
    pub changes: u32,
    /// Whether the best law explains the data within polling and scatter.
    pub fits: bool,
    /// Whether criterion and held-out error select the same law.
    pub agreed: bool,
    /// The best law.
    pub best: ComparedLawForm,
    /// All others, best first.
    pub others: Vec<ComparedLawForm>,
}

/// A fitted law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedLawForm {
    /// The kind of law.
    pub law: LawKind,
    /// Its name for people.
    pub name: String,
    /// Its parameter: mm/s² for a constant mean acceleration, s for a constant time, s per step for a ramp.
    pub pace: Quantity,
    /// The delay from command to effect (s).
    pub delay: Quantity,
    /// Chi-square per degree of freedom.
    pub chi_square_by_freedom: f64,
    /// Akaike's corrected criterion; smaller is better.
    pub criterion: f64,
    /// Root mean square error on changes held out of the fit (mm).
    pub held_out_mm: f64,
}

/// A stop measured with a tape.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TapedStopForm {
    /// The recording, and the run in it.
    pub recording: String,
    /// See `recording`.
    pub run: u32,
    /// The step it stopped from.
    pub step: SpeedStep,
    /// The speed at the command (mm/s).
    pub speed_mm_per_s: f64,
    /// The stopping distance from the command (mm).
    pub distance_mm: f64,
    /// Its standard deviation (mm).
    pub uncertainty_mm: f64,
    /// The stopping time from the command (s), if measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
}

/// A measurement that does not fit its neighbours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SuspicionForm {
    /// The recording, run and line of the report.
    pub recording: String,
    /// See `recording`.
    pub run: u32,
    /// See `recording`.
    pub line: u64,
    /// Its number in the store, if it is in one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stored_as: Option<i64>,
    /// The sensor, by name.
    pub sensor: String,
    /// The delay of the report relative to its neighbours (ms).
    pub late_ms: f64,
    /// The distance that the train runs in that time (mm).
    pub late_mm: f64,
    /// The probability of a report at least this late or early by chance.
    pub probability: f64,
}
