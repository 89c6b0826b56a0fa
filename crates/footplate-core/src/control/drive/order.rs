//! What an operator or a program can order a train to do.

use core::fmt;

use crate::ids::{SpeedStep, TrainId, TurnoutId};
use crate::time::TimeSpan;
use crate::track::Landmark;
use crate::units::{Length, Ratio, Speed};

/// An order to a train or a turnout.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// Run at a step from now on; step 0 stops the train.
    Speed {
        /// The train.
        train: TrainId,
        /// The step.
        step: SpeedStep,
    },
    /// Stop, reverse, then run at a step; step 0 stays at rest.
    Reverse {
        /// The train.
        train: TrainId,
        /// The step after reversing.
        then: SpeedStep,
    },
    /// Throw a turnout.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// Stop with the leading end of the pickup at a place.
    Stop(StopOrder),
    /// From rest, move ahead by a distance.
    Move {
        /// The train.
        train: TrainId,
        /// The distance.
        distance: Length,
    },
    /// Run at a mean speed, which may lie between those of two steps.
    Hold {
        /// The train.
        train: TrainId,
        /// The speed.
        speed: Speed,
    },
    /// Follow another train at a gap.
    Follow {
        /// The train.
        train: TrainId,
        /// The train ahead.
        leader: TrainId,
        /// The gap.
        gap: Gap,
    },
    /// Stop with the leading end of the pickup at a place, at a given time.
    Arrive {
        /// The train.
        train: TrainId,
        /// The place, measured from where this train's pickup closes the sensor.
        target: Landmark,
        /// The time from now until the train is at rest there.
        within: TimeSpan,
    },
}

/// The gap between two trains.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Gap {
    /// From a detection of the train ahead to the follower's at the same sensor.
    Time(TimeSpan),
    /// From the rear of the train ahead to the front of the follower.
    Way(Length),
}

/// An order to stop at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StopOrder {
    /// The train.
    pub train: TrainId,
    /// The place, measured from where this train's pickup closes the sensor.
    pub target: Landmark,
    /// Which quantile of the predicted rest shall be there.
    pub aim: Aim,
    /// The step to stop from; `None` to let the driver choose.
    pub step: Option<SpeedStep>,
    /// On a circuit: pass the place once before.
    pub next_round: bool,
}

impl StopOrder {
    /// A stop with its median at a place, the first time the train can.
    pub const fn at(train: TrainId, target: Landmark) -> Self {
        Self { train, target, aim: Aim::Median, step: None, next_round: false }
    }
}

/// Which quantile of the rest shall meet the target; stops vary.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Aim {
    /// The median.
    Median,
    /// The train shall come to rest beyond the target with at most this probability.
    NotBeyond(Ratio),
}

impl Order {
    /// The train that the order is for.
    pub const fn train(&self) -> Option<TrainId> {
        match self {
            Self::Speed { train, .. }
            | Self::Reverse { train, .. }
            | Self::Move { train, .. }
            | Self::Hold { train, .. }
            | Self::Follow { train, .. }
            | Self::Arrive { train, .. } => Some(*train),
            Self::Stop(stop) => Some(stop.train),
            Self::Turnout { .. } => None,
        }
    }
}

/// The number of an accepted order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct OrderId(pub(super) u32);

impl fmt::Display for OrderId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
