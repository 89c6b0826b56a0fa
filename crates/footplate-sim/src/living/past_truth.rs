//! Standstills of trains and passages of sensors as they really were, which only scorers may see.

use footplate_core::track::Position;
use footplate_core::{EdgeId, Length, SensorId, Timestamp, TrainId};

use crate::sensors::Cause;

/// A train stood still.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestTruth {
    /// The train.
    pub train: TrainId,
    /// The leading end of its shoe, in true lengths.
    pub position: Position,
    /// When it came to rest.
    pub since: Timestamp,
    /// When it moved again; nothing while it stands.
    pub until: Option<Timestamp>,
    /// The distance it had run under its own power.
    pub odometer: Length,
}

impl RestTruth {
    pub(crate) fn new(train: TrainId, place: (EdgeId, f64), since: Timestamp, odometer_mm: f64) -> Self {
        let (edge, offset_mm) = place;
        let position = Position { edge, offset: Length::from_mm(offset_mm) };
        Self { train, position, since, until: None, odometer: Length::from_mm(odometer_mm) }
    }
}

/// A passage of a sensor, or a spurious detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassTruth {
    /// The sensor.
    pub sensor: SensorId,
    /// When.
    pub at: Timestamp,
    /// The train whose shoe reached it; `None` for a spurious detection.
    pub train: Option<TrainId>,
    /// Why.
    pub cause: Cause,
    /// Whether it closed; `false` for a missed train.
    pub closed: bool,
    /// What the train's odometer showed, in mm.
    pub odometer_mm: f64,
}
