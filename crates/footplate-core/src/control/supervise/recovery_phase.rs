//! The phases through which a train comes back.

use crate::control::Outcome;
use crate::control::drive::OrderId;
use crate::ids::{NodeId, SpeedStep};
use crate::time::Timestamp;
use crate::units::Length;

use super::trials::SpeedTrial;

/// The phase of a recovery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RecoveryPhase {
    /// The train comes to rest.
    Stopping,
    /// It is at rest and waits for its turn, for power, for the station, and for clearance to creep.
    Waiting { has_asked: bool },
    /// It creeps to two sensors; `seen` is the first one.
    Locating { step: SpeedStep, pushed: Timestamp, seen: Option<NodeId> },
    /// It reverses, to creep back; `seen` is its last sensor, in the new direction of travel.
    Reversing { step: SpeedStep, seen: Option<NodeId> },
    /// It runs at a step whose speed is measured.
    Measuring { trial: SpeedTrial, from: SpeedStep },
    /// It stops short of a sensor by the new model, with this predicted stopping distance.
    StoppingShort { order: OrderId, distance: Length },
    /// It creeps to that sensor.
    Creeping { distance: Length },
    /// It runs at a step from which it will stop, ...
    LearningSpeed { trial: SpeedTrial, from: SpeedStep },
    /// ... comes to rest ...
    LearningStop { until: Timestamp },
    /// ... and creeps to a sensor that measures where that was.
    LearningRest,
    /// The recovery is complete: it comes to rest ...
    Ending { outcome: Outcome },
    /// ... and is turned to the direction in which it was before, if it reversed an odd number of times, remains located and stands on no
    /// points that it pushed over.
    Turning { outcome: Outcome },
    /// An operator is needed.
    GivenUp,
}
