//! What stands in a calibration file.

use footplate_core::calibration::{Direction, LawKind};
use footplate_core::{Approach, SpeedStep, TrainId};
use serde::{Deserialize, Serialize};

/// Names the formulas that made the numbers: it changes when the same measurements would give others.
pub const MODEL_VERSION: &str = "1";

/// A number as it travels in files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// The best value.
    pub value: f64,
    /// One standard deviation.
    pub uncertainty: f64,
    /// The unit of both.
    pub unit: String,
    /// Measurements behind it.
    pub measurements: u32,
    /// When the newest of them was made, in seconds since the Unix epoch, where the recording tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_at_s: Option<f64>,
}

/// A whole calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationFile {
    /// [`MODEL_VERSION`] of the program that made it.
    pub model_version: String,
    /// The layout it was made on.
    pub layout: String,
    /// The rhythm of the link of each recording.
    pub polling: Vec<PollingForm>,
    /// Its trains.
    pub trains: Vec<TrainForm>,
}

/// The rhythm of a link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PollingForm {
    /// The recording.
    pub recording: String,
    /// From one reading to the next when nothing was reported (ms); `None` where the reports show no rhythm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period: Option<Quantity>,
    /// From a reading that reported something to the next (ms).
    pub after_report_ms: f64,
    /// One standard deviation of a poll about its place in the rhythm (ms).
    pub jitter_ms: f64,
}

/// What is known of a train.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainForm {
    /// Its number.
    pub train: TrainId,
    /// Steady speeds by step and approach (mm/s).
    pub speeds: Vec<SpeedForm>,
    /// Steps that were reached from both sides.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hysteresis: Vec<HysteresisForm>,
    /// How far a run as a whole deviates from the table, one standard deviation (%).
    pub run_deviation_percent: f64,
    /// Scatter of its contacts about their usual place (mm).
    pub contact_scatter_mm: f64,
    /// How much longer than surveyed the way between two contacts is for it (mm).
    pub sections: Vec<SectionForm>,
    /// The laws by which it changes speed, by direction, where enough changes were seen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub laws: Vec<LawForm>,
    /// Stops measured by hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stops: Option<StopForm>,
    /// Measurements that were taken out because chance hardly allows them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub suspicious: Vec<SuspicionForm>,
}

/// A steady speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpeedForm {
    /// The step.
    pub step: SpeedStep,
    /// From which side it was reached.
    pub approach: Approach,
    /// The speed (mm/s); measurements are hops from contact to contact.
    pub speed: Quantity,
    /// Stretches of running behind it.
    pub runs: u32,
}

/// How a step differs by the side from which it was reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HysteresisForm {
    /// The step.
    pub step: SpeedStep,
    /// Speed from above less speed from below (mm/s).
    pub difference: Quantity,
    /// Whether the data tell the two apart.
    pub told_apart: bool,
}

/// The correction of a section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SectionForm {
    /// The contact at one end, by name.
    pub from: String,
    /// The contact at the other.
    pub to: String,
    /// Surveyed length (mm).
    pub surveyed_mm: f64,
    /// What to add to it for this train (mm).
    pub correction: Quantity,
}

/// The law of one direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawForm {
    /// Faster or slower.
    pub direction: Direction,
    /// Changes of speed behind it.
    pub changes: u32,
    /// Whether the best law explains the data within what poll and scatter allow.
    pub fits: bool,
    /// Whether criterion and held-out error agree on it.
    pub agreed: bool,
    /// The law to use.
    pub best: ComparedLawForm,
    /// All others, best first.
    pub others: Vec<ComparedLawForm>,
}

/// One law as fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComparedLawForm {
    /// Which.
    pub law: LawKind,
    /// Its name for people.
    pub name: String,
    /// Its pace: mm/s² where the mean acceleration is constant, s where the time is, s a step for a ramp.
    pub pace: Quantity,
    /// From command to effect (s).
    pub delay: Quantity,
    /// Covariance of ln pace and delay.
    pub covariance: [[f64; 2]; 2],
    /// Sum of squared residuals over their variances, by degree of freedom.
    pub chi_square_by_freedom: f64,
    /// Akaike's corrected criterion; smaller is better.
    pub criterion: f64,
    /// Root mean square error on changes held out of the fit (mm).
    pub held_out_mm: f64,
    /// For a table: times in units of the change's own time, and the share of the change done by then.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub table: Vec<[f64; 2]>,
}

/// Stops of a train.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StopForm {
    /// Since when distances and times are counted: always `from_command`.
    pub counted: String,
    /// By step.
    pub steps: Vec<StopStepForm>,
    /// d = τ v + v²/2a through all steps; `None` with fewer than two different ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<StopLawForm>,
}

/// Stops from one step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StopStepForm {
    /// The step.
    pub step: SpeedStep,
    /// Mean speed before the stops (mm/s).
    pub speed_mm_per_s: f64,
    /// Mean distance from the command (mm).
    pub distance: Quantity,
    /// Mean time from the command (s), where somebody watched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<Quantity>,
    /// Scatter of single stops (mm), where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter_mm: Option<f64>,
    /// Distance less what the law says (mm).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_mm: Option<f64>,
}

/// The two-term law of stopping distance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StopLawForm {
    /// τ (s).
    pub delay: Quantity,
    /// a (mm/s²).
    pub deceleration: Quantity,
    /// Root mean square of the residuals (mm).
    pub rms_mm: f64,
}

/// A measurement that was taken out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SuspicionForm {
    /// The recording, the run and the line that tell it.
    pub recording: String,
    /// See `recording`.
    pub run: u32,
    /// See `recording`.
    pub line: u64,
    /// Its number in the store, where it came from one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stored_as: Option<i64>,
    /// The contact, by name.
    pub sensor: String,
    /// How much later than the fit the report was (ms).
    pub late_ms: f64,
    /// How far that is in way (mm).
    pub late_mm: f64,
    /// How likely chance makes a report at least this far off.
    pub probability: f64,
}
