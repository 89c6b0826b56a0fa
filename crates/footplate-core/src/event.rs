//! Reports and commands: the entries of every recording.

use core::fmt;

use crate::ids::{FunctionNumber, SensorId, SpeedStep, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::units::Length;

/// One entry of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Event {
    /// When the host received or sent it.
    pub time: Timestamp,
    /// What happened.
    pub kind: EventKind,
}

/// The kinds of entries.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum EventKind {
    /// A sensor reported a train.
    Sensor(Report),
    /// The detector of a block reported that no train is in it any more. The rear of the train left the block earlier, by the
    /// release delay of the detector.
    Freed(Report),
    /// A throttle step was commanded.
    Speed {
        /// The train.
        train: TrainId,
        /// The step.
        step: SpeedStep,
    },
    /// The train was commanded to reverse.
    Reverse {
        /// The train.
        train: TrainId,
    },
    /// A turnout was thrown.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// An operator measured where and when a train came to rest.
    Stopped {
        /// The train.
        train: TrainId,
        /// The sensor that the tape was laid from.
        landmark: SensorId,
        /// How far past it the train's pickup came to rest.
        offset: Length,
    },
}

/// A report of a sensor, and the uncertainty of its time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Report {
    /// The sensor.
    pub sensor: SensorId,
    /// The interval of the poll that reported it, from the reading before to the reading that saw the sensor closed,
    /// where the host recorded it: the sensor closed within this span before the reading. Where sensors report by
    /// themselves, the range of possible delays of the report, as the link's session knows it.
    pub poll_interval: Option<TimeSpan>,
}

/// A command to the command station.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Command {
    /// Run a train at a throttle step; step 0 stops it by its decoder's braking law.
    Speed {
        /// The train.
        train: TrainId,
        /// The step.
        step: SpeedStep,
    },
    /// Reverse a train. Only for a train at rest: a moving one stops at once.
    Reverse {
        /// The train.
        train: TrainId,
    },
    /// Throw a turnout.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// Switch a function of a train.
    Function {
        /// The train.
        train: TrainId,
        /// The function.
        function: FunctionNumber,
        /// On or off.
        on: bool,
    },
    /// Switch track power off.
    PowerOff,
    /// Switch track power on.
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
            Self::Function { train, function, on } => {
                write!(f, "{function} {} for train {train}", if *on { "on" } else { "off" })
            }
            Self::PowerOff => f.write_str("power off"),
            Self::PowerOn => f.write_str("power on"),
        }
    }
}

/// From which side a speed was reached; a throttle step reached from above is faster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Approach {
    /// From a lower step or from rest.
    Below,
    /// From a higher step.
    Above,
    /// Unknown: the train was already running when the recording began.
    Unknown,
}
