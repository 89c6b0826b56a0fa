//! What stands in the report of a batch.

use footplate_core::model::report::{Direction, LawKind};
use footplate_core::{SpeedStep, TrainId};
use serde::Serialize;

use crate::motion_file::{MotionSectionForm, MotionStepForm};
use crate::quantity::Quantity;

/// All that recordings say of trains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// [`MOTION_MODEL_VERSION`](crate::MOTION_MODEL_VERSION) of the program that made it.
    pub model_version: String,
    /// The layout it was made on.
    pub layout: String,
    /// The rhythm of the link of each recording.
    pub polling: Vec<PollingForm>,
    /// Its trains.
    pub trains: Vec<TrainFindings>,
}

/// The rhythm of a link.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PollingForm {
    /// The recording.
    pub recording: String,
    /// From one reading to the next when nothing was reported (ms); `None` where the reports show no rhythm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period: Option<Quantity>,
    /// From a reading that reported something to the next (ms).
    pub after_report_ms: f64,
    /// One standard deviation of a poll about its place in the rhythm (ms).
    pub jitter_ms: f64,
}

/// What recordings say of a train.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainFindings {
    /// Its number.
    pub train: TrainId,
    /// The highest step of its decoder.
    pub highest_step: SpeedStep,
    /// Runs it was in, those of them without a passage, and contacts passed in all.
    pub runs: u32,
    /// See `runs`.
    pub silent_runs: u32,
    /// See `runs`.
    pub contacts: u32,
    /// Speed and stop at every step that moved it, from below and from above.
    pub steps: Vec<MotionStepForm>,
    /// How far a run as a whole deviates from the speed of its step, one standard deviation (%).
    pub run_deviation_percent: f64,
    /// Scatter of its contacts about their usual place (mm).
    pub contact_scatter_mm: f64,
    /// How much longer than surveyed the paths between contacts are for it.
    pub sections: Vec<MotionSectionForm>,
    /// The laws that describe its changes of speed, by direction, where enough changes were seen.
    pub laws: Vec<LawForm>,
    /// Stops measured with a tape.
    pub stops: Vec<TapedStopForm>,
    /// Reports that chance hardly makes; they count little in the fit.
    pub suspicious: Vec<SuspicionForm>,
}

/// The law of one direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawForm {
    /// Faster or slower.
    pub direction: Direction,
    /// Changes of speed behind it.
    pub changes: u32,
    /// Whether the best law explains the data within what poll and scatter allow.
    pub fits: bool,
    /// Whether criterion and held-out error agree on it.
    pub agreed: bool,
    /// The law that describes the changes best.
    pub best: ComparedLawForm,
    /// All others, best first.
    pub others: Vec<ComparedLawForm>,
}

/// One law as fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedLawForm {
    /// Which.
    pub law: LawKind,
    /// Its name for people.
    pub name: String,
    /// Its pace: mm/s² where the mean acceleration is constant, s where the time is, s a step for a ramp.
    pub pace: Quantity,
    /// From command to effect (s).
    pub delay: Quantity,
    /// Sum of squared residuals over their variances, by degree of freedom.
    pub chi_square_by_freedom: f64,
    /// Akaike's corrected criterion; smaller is better.
    pub criterion: f64,
    /// Root mean square error on changes held out of the fit (mm).
    pub held_out_mm: f64,
}

/// A stop that a person measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TapedStopForm {
    /// The recording and its run.
    pub recording: String,
    /// See `recording`.
    pub run: u32,
    /// The step from which it stopped.
    pub step: SpeedStep,
    /// Speed when the command was sent (mm/s).
    pub speed_mm_per_s: f64,
    /// Distance from the command to standstill (mm).
    pub distance_mm: f64,
    /// One standard deviation of it (mm).
    pub uncertainty_mm: f64,
    /// Time from the command to standstill (s), where a person watched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
}

/// A measurement that does not fit its neighbours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SuspicionForm {
    /// The recording, the run and the line that tell it.
    pub recording: String,
    /// See `recording`.
    pub run: u32,
    /// See `recording`.
    pub line: u64,
    /// Its number in the store, where it came from one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stored_as: Option<i64>,
    /// The contact, by name.
    pub sensor: String,
    /// How much later than its neighbours say the report was (ms).
    pub late_ms: f64,
    /// How far the train runs in that time (mm).
    pub late_mm: f64,
    /// How likely chance makes a report at least this late or early.
    pub probability: f64,
}
