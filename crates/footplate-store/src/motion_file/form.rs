//! The content of a motion model file.

use footplate_core::{Approach, SpeedStep, TrainId};
use serde::{Deserialize, Serialize};

use crate::quantity::Quantity;

/// The version of the formulas behind the numbers. Raise it when the same events lead to other numbers: with every
/// change of the fit in `model::fit` of core, or of the events that [`MotionReplay`](crate::MotionReplay)
/// feeds it. Stored models and replays are then computed again from the events. A test pins the numbers of every
/// version.
pub const MOTION_MODEL_VERSION: &str = "13";

/// The motion model of one train on one layout.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionFile {
    /// [`MOTION_MODEL_VERSION`] of the program that computed it.
    pub model_version: String,
    /// The layout on which it was fitted.
    pub layout: String,
    /// The train.
    pub train: TrainId,
    /// The highest step of its decoder.
    pub highest_step: SpeedStep,
    /// Steps that do not move the train, or not reliably.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unreliable_steps: Vec<SpeedStep>,
    /// Speed and stop of the steps that move it, lowest first.
    pub steps: Vec<MotionStepForm>,
    /// Path lengths between sensors, relative to the survey, for sections that the train has run over.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<MotionSectionForm>,
    /// Stop offsets by direction, for edges that stops of the train ran over.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stop_offsets: Vec<StopOffsetForm>,
    /// How exactly each sensor trips that the train has passed often.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensors: Vec<SensorScatterForm>,
    /// The numbers of the model, for programs.
    pub exact: ExactForm,
}

/// The numbers of a model to the last bit ([`MotionNumbers`](footplate_core::model::MotionNumbers)); the other fields
/// follow from them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExactForm {
    /// The time of the newest event in seconds since the Unix epoch, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_at_s: Option<f64>,
    /// The scatter of stops relative to the prior.
    pub scatter_scale: f64,
    /// The part of the scatter that does not depend on speed (m).
    #[serde(default)]
    pub scatter_floor: f64,
    /// The scatter of the time until a stop begins (s).
    #[serde(default)]
    pub stop_delay_scatter: f64,
    /// The standard deviation of stop offsets (m).
    #[serde(default)]
    pub stop_offset_deviation: f64,
    /// What the laws of stops and of starts leave over, relative to the prior: factors on a standard deviation.
    pub residual_scales: [f64; 2],
    /// The scatter of start delays relative to the prior.
    pub start_scale: f64,
    /// The scatter of a sensor that the train has not passed often, one standard deviation (m).
    pub usual_sensor_scatter: f64,
    /// The change of each of `values` for one standard deviation of the survey's scale.
    pub scale: Vec<f64>,
    /// By step from 0: detections and stops for steps reached from below, and the same from above.
    pub counts: Vec<[u32; 4]>,
    /// By step from 0: `untried`, `moves` or `unreliable`.
    pub uses: Vec<UseForm>,
    /// The parameters of the model, in SI units and in its order.
    pub values: Vec<f64>,
    /// Their covariance: the lower triangle, row by row.
    pub covariance: Vec<f64>,
}

/// The experience with a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UseForm {
    /// Never tried.
    Untried,
    /// It moves the train.
    Moves,
    /// It does not move the train reliably.
    Unreliable,
}

/// A step reached from one side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionStepForm {
    /// The step.
    pub step: SpeedStep,
    /// The side from which it is reached.
    pub approach: Approach,
    /// The steady speed (mm/s); measurements are detections at it.
    pub speed: Quantity,
    /// The stopping distance from the command (mm); measurements are stops.
    pub stop: Quantity,
    /// The scatter of single stops, one standard deviation (mm).
    pub stop_scatter_mm: f64,
    /// The stopping time (s).
    pub stop_s: f64,
}

impl MotionStepForm {
    /// Whether its speed was measured: two detections at least, as a single one fixes a position but no speed.
    pub const fn is_measured(&self) -> bool {
        self.speed.measurements > 1
    }
}

/// The section between two sensors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionSectionForm {
    /// The sensor at one end, by name.
    pub from: String,
    /// The sensor at the other end.
    pub to: String,
    /// Surveyed length (mm).
    pub surveyed_mm: f64,
    /// The path length of this train minus the surveyed length (mm).
    pub add: Quantity,
}

/// The stop offset of an edge, in one direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StopOffsetForm {
    /// The node at which it begins, by name.
    pub from: String,
    /// The node at which it ends.
    pub to: String,
    /// The offset of a stop from 300 mm/s that runs over it alone (mm).
    pub add: Quantity,
}

/// The scatter of a sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SensorScatterForm {
    /// The sensor, by name.
    pub sensor: String,
    /// One standard deviation of where it trips about its usual place (mm).
    pub scatter_mm: f64,
}
