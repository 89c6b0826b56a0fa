//! What a person or a program can ask of a train, in its own words.

use core::fmt;

use crate::ids::{SpeedStep, TrainId, TurnoutId};
use crate::time::TimeSpan;
use crate::track::Landmark;
use crate::units::{Length, Ratio, Speed};

/// Something to be done.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// Run at a step, from now on. Step 0 brings the train to rest wherever that is.
    Speed {
        /// The train.
        train: TrainId,
        /// The step.
        step: SpeedStep,
    },
    /// Come to rest, turn around, and go on at a step; step 0 stays.
    Reverse {
        /// The train.
        train: TrainId,
        /// What to do then.
        then: SpeedStep,
    },
    /// Throw a turnout.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// Come to rest with the leading end of the pickup at a place.
    Stop(StopOrder),
    /// From rest, move on by a distance.
    Move {
        /// The train.
        train: TrainId,
        /// How far, ahead.
        distance: Length,
    },
    /// Run at a mean speed, whatever steps that takes.
    Hold {
        /// The train.
        train: TrainId,
        /// The speed.
        speed: Speed,
    },
    /// Run behind another train and keep the gap to it.
    Follow {
        /// The train.
        train: TrainId,
        /// The one ahead.
        leader: TrainId,
        /// The gap.
        gap: Gap,
    },
    /// Come to rest with the leading end of the pickup at a place, and do so in a time.
    Arrive {
        /// The train.
        train: TrainId,
        /// The place, counted from where this train's pickup closes the contact.
        target: Landmark,
        /// How long from now it shall take until the train stands.
        within: TimeSpan,
    },
}

/// How far one train keeps behind another.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Gap {
    /// From a contact's being closed by the train ahead until the follower closes it.
    Time(TimeSpan),
    /// From the rear end of the train ahead to the front of the follower.
    Way(Length),
}

/// Come to rest at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StopOrder {
    /// The train.
    pub train: TrainId,
    /// The place, counted from where this train's pickup closes the contact.
    pub target: Landmark,
    /// Which part of all rests that may come of it shall be there.
    pub aim: Aim,
    /// The step from which to stop; `None` leaves the choice.
    pub step: Option<SpeedStep>,
    /// On a circuit: pass the place once before.
    pub next_round: bool,
}

impl StopOrder {
    /// The plain order: the middle of all rests at a place, as soon as it is reached.
    #[must_use]
    pub const fn at(train: TrainId, target: Landmark) -> Self {
        Self { train, target, aim: Aim::Median, step: None, next_round: false }
    }
}

/// Stops scatter; which of them shall meet the target.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Aim {
    /// As many short of it as beyond it.
    Median,
    /// Beyond it at most in this share of stops, for what must not be entered.
    NotBeyond(Ratio),
}

impl Order {
    /// The train it is for.
    #[must_use]
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

/// An order that was taken, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct OrderId(pub(super) u32);

impl fmt::Display for OrderId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
