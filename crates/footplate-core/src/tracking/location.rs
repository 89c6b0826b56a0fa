//! Where a train is, where it would come to rest, and which sensors it passed and passes next.

use crate::ids::{NodeId, SensorId, SpeedStep};
use crate::link::DetectionWindow;
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Length, Speed};

/// A place on the path of a train, in path lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// The node of the sensor from which it counts.
    pub node: NodeId,
    /// Distance past it, along the path over the turnouts as set.
    pub distance: Length,
}

/// Position and speed of a train, with their uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// The most likely place of its pickup.
    pub at: PathPoint,
    /// One standard deviation of the distance.
    pub uncertainty: Length,
    /// Its speed.
    pub speed: Speed,
    /// One standard deviation of the speed.
    pub speed_uncertainty: Speed,
    /// The step commanded last.
    pub step: SpeedStep,
    /// Whether it is at rest, by the model.
    pub at_rest: bool,
}

/// Where a train would come to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// The most likely place.
    pub at: PathPoint,
    /// One standard deviation of what is unknown: the present place and the stopping distance.
    pub doubt: Length,
    /// One standard deviation of single stops, which no further measurement reduces.
    pub scatter: Length,
    /// When it is predicted to be at rest, at the latest.
    pub time: Timestamp,
}

impl Rest {
    /// One standard deviation of the place.
    pub fn deviation(&self) -> Length {
        Length::from_m(libm::hypot(self.doubt.as_m(), self.scatter.as_m()))
    }
}

/// The next sensor and when its detection is due.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DueSensor {
    /// The sensor.
    pub sensor: SensorId,
    /// When it should close.
    pub time: Timestamp,
    /// One standard deviation of the time.
    pub uncertainty: TimeSpan,
    /// The speed of the train there.
    pub speed: Speed,
}

/// A sensor that the train passed, compared with its prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassedSensor {
    /// The sensor.
    pub sensor: SensorId,
    /// When it closed, by the report.
    pub window: DetectionWindow,
    /// When it closed most likely, by report and prediction together.
    pub at: Timestamp,
    /// By how much the middle of the window was later than predicted, and one standard deviation of that (prediction and
    /// window); `None` for the first sensor after the train was lost.
    pub late: Option<[TimeSpan; 2]>,
    /// The same as a distance: how far the train was short of the sensor at the predicted time.
    pub short: Option<Length>,
    /// Sensors between the one passed before and this one that did not report.
    pub missed: usize,
    /// Whether distances counted from it already: the train had been placed, or had reversed, near it.
    pub is_origin: bool,
}
