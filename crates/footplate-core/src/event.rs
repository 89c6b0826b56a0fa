//! What the railway reports and what it was told: the entries of every recording.

use core::fmt;

use crate::ids::{SensorId, SpeedStep, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::units::Length;

/// One entry of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Event {
    /// When the host saw or sent it.
    pub time: Timestamp,
    /// What it was.
    pub kind: EventKind,
}

/// What can stand in a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum EventKind {
    /// A trackside contact was reported as closed.
    Sensor(Report),
    /// A throttle step was commanded.
    Speed {
        /// The train that was told.
        train: TrainId,
        /// The step it was told.
        step: SpeedStep,
    },
    /// The train was commanded to reverse.
    Reverse {
        /// The train that was told.
        train: TrainId,
    },
    /// A turnout was thrown.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// A person measured where and when the train came to rest.
    Stopped {
        /// The train that stopped.
        train: TrainId,
        /// The contact from which the tape was laid.
        landmark: SensorId,
        /// How far past it the train's pickup came to rest.
        offset: Length,
    },
}

/// A contact that was seen closed, and what is known of the time at which it closed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Report {
    /// The contact.
    pub sensor: SensorId,
    /// The interval of the poll that reported it, from the reading before to the reading that saw it closed,
    /// where the host recorded it; the contact closed within this span before the reading. On a link whose sensors report by
    /// themselves it is the span of the delays that the report may have had, as the link's session knows them.
    pub poll_interval: Option<TimeSpan>,
}

/// What a command station can be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Command {
    /// Run a train at a throttle step; step 0 stops it by its own law.
    Speed {
        /// The train to tell.
        train: TrainId,
        /// The step.
        step: SpeedStep,
    },
    /// Turn a train around. Only for a train at rest: one that runs is stopped dead.
    Reverse {
        /// The train to tell.
        train: TrainId,
    },
    /// Throw a turnout.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// Take the power from the whole track.
    PowerOff,
    /// Give power to the track.
    PowerOn,
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Speed { train, step } => write!(f, "step {step} for train {train}"),
            Self::Reverse { train } => write!(f, "turn around, train {train}"),
            Self::Turnout { turnout, curved } => {
                write!(f, "turnout {turnout} {}", if *curved { "curved" } else { "straight" })
            }
            Self::PowerOff => f.write_str("power off"),
            Self::PowerOn => f.write_str("power on"),
        }
    }
}

/// From which side a speed was reached; the same throttle step reached from above is faster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Approach {
    /// From a lower step or from rest.
    Below,
    /// From a higher step.
    Above,
    /// The recording begins with the train already running.
    Unknown,
}
