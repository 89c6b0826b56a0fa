//! What stands in the file of a motion model.

use footplate_core::{Approach, SpeedStep, TrainId};
use serde::{Deserialize, Serialize};

use crate::quantity::Quantity;

/// Names the formulas that made the numbers. Raise it when the same events come to other numbers: with every change of what
/// `calibration::motion` of core makes of them, or of what [`MotionReplay`](crate::MotionReplay) tells it. Models and replays
/// that stores keep are then made anew from the events; a test knows the numbers of every version.
pub const MOTION_MODEL_VERSION: &str = "4";

/// All that is known of how one train moves on one layout.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionFile {
    /// [`MOTION_MODEL_VERSION`] of the program that made it.
    pub model_version: String,
    /// The layout on which it was learnt.
    pub layout: String,
    /// The train.
    pub train: TrainId,
    /// The highest step of its decoder.
    pub highest_step: SpeedStep,
    /// Steps that do not move the train, or not for sure.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unreliable_steps: Vec<SpeedStep>,
    /// What it does at the steps that move it, lowest first.
    pub steps: Vec<MotionStepForm>,
    /// How much longer than surveyed the ways between contacts are for it, where it was there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<MotionSectionForm>,
    /// By how much stops that end between two contacts are longer for it than elsewhere, by direction, where it stopped.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stop_offsets: Vec<StopOffsetForm>,
    /// What the model is made of, for programs.
    pub exact: ExactForm,
}

/// The numbers of a model to the last bit ([`MotionNumbers`](footplate_core::model::MotionNumbers)); what
/// stands above follows from them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExactForm {
    /// When the newest event was, in seconds since the Unix epoch, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_at_s: Option<f64>,
    /// How far stops scatter against what trains usually do.
    pub scatter_scale: f64,
    /// What they scatter by besides (m), whatever their speed.
    #[serde(default)]
    pub scatter_floor: f64,
    /// One standard deviation of the offsets of stops from place to place (m).
    #[serde(default)]
    pub stop_offset_deviation: f64,
    /// How late or early starts from rest are against what trains usually do.
    pub start_scale: f64,
    /// What each of `values` is off by for one standard deviation of the scale of the survey.
    pub scale: Vec<f64>,
    /// By step from 0 on: contacts passed and stops made from below, and the same from above.
    pub counts: Vec<[u32; 4]>,
    /// By step from 0 on: `untried`, `moves` or `unreliable`.
    pub uses: Vec<UseForm>,
    /// The numbers by which it answers its commands, in SI units and the order of the model.
    pub values: Vec<f64>,
    /// Their covariance: the lower triangle, row after row.
    pub covariance: Vec<f64>,
}

/// What experience says of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UseForm {
    /// Never tried.
    Untried,
    /// It moves the train.
    Moves,
    /// Not to be relied upon.
    Unreliable,
}

/// A step reached from one side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionStepForm {
    /// The step.
    pub step: SpeedStep,
    /// From which side it is reached.
    pub approach: Approach,
    /// The steady speed (mm/s); measurements are contacts passed at it.
    pub speed: Quantity,
    /// The way from the command to stand until it stands (mm); measurements are stops.
    pub stop: Quantity,
    /// How single stops scatter, one standard deviation (mm).
    pub stop_scatter_mm: f64,
    /// How long a stop takes (s).
    pub stop_s: f64,
}

impl MotionStepForm {
    /// Whether its speed was measured: a single contact tells where a train was, not how fast it ran.
    #[must_use]
    pub const fn is_measured(&self) -> bool {
        self.speed.measurements > 1
    }
}

/// The way between two contacts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionSectionForm {
    /// The contact at one end, by name.
    pub from: String,
    /// The contact at the other.
    pub to: String,
    /// Surveyed length (mm).
    pub surveyed_mm: f64,
    /// What to add to it for this train (mm).
    pub add: Quantity,
}

/// What stops are longer by that end between two contacts, run over in this direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StopOffsetForm {
    /// The contact passed last, by name.
    pub from: String,
    /// The one that would come next.
    pub to: String,
    /// What to add to a stop from 300 mm/s (mm).
    pub add: Quantity,
}
