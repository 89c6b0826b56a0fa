//! What a driver has to say while it drives.

use alloc::string::String;

use crate::event::Command;
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::Landmark;
use crate::tracking::{DueContact, PassedContact};
use crate::units::{Length, Speed};

use super::order::OrderId;
use super::pacing::ArrivalProfile;
use super::refusal::Refusal;

/// What happened, and what is going to.
#[derive(Debug, Clone, PartialEq)]
pub enum DriveNotice {
    /// A train passed a contact.
    Passed {
        /// The train.
        train: TrainId,
        /// What was reported, beside what had been expected.
        passed: PassedContact,
        /// What comes next.
        next: Option<DueContact>,
    },
    /// When a train commanded to stop will be told so, for the first time or again because something was learnt.
    Planned(PlannedStop),
    /// It was too late for the target: the train was commanded to stop at once, and will come to rest beyond.
    Overshoots {
        /// The order.
        order: OrderId,
        /// The train.
        train: TrainId,
        /// By how much, in the middle of what may be.
        by: Length,
    },
    /// From now on a train that was told to hold a speed keeps to a line.
    Paced(PacedLine),
    /// How a train that shall be somewhere in time is going to do that.
    Arrives(PlannedArrival),
    /// A follower has been commanded to stop, because it would have come too near to its leader or nobody knows where that is.
    /// It goes on by itself.
    HeldBack {
        /// The order.
        order: OrderId,
        /// The follower.
        train: TrainId,
        /// The one ahead.
        leader: TrainId,
    },
    /// A train has been told a slower step than it was asked to run at, because of a zone that it is in or comes to. It gets
    /// faster again by itself.
    Restrained {
        /// The train.
        train: TrainId,
        /// The step it was told.
        step: SpeedStep,
        /// The name of the zone.
        zone: String,
        /// The zone's limit.
        limit: Speed,
    },
    /// An order has been carried out.
    Done(Finished),
    /// An order was given up on the way; the train has been commanded to stop.
    GivenUp {
        /// The order.
        order: OrderId,
        /// The train.
        train: TrainId,
        /// Why.
        why: Refusal,
    },
    /// Another order took its place.
    Replaced {
        /// The order.
        order: OrderId,
        /// The train.
        train: TrainId,
    },
    /// A turnout has been told how to lie.
    Thrown {
        /// The order; `None` if nobody here asked for it.
        order: Option<OrderId>,
        /// The turnout.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// A train took the other leg: the turnout did not lie as it was told.
    TurnoutLiesOtherwise {
        /// The turnout.
        turnout: TurnoutId,
        /// How it lies, as the train showed.
        curved: bool,
        /// The train.
        train: TrainId,
    },
    /// A contact should have reported a train by now and did not.
    Overdue {
        /// The train.
        train: TrainId,
        /// The contact.
        sensor: SensorId,
        /// By how much.
        by: TimeSpan,
    },
    /// The track ends ahead of a train. It has been commanded to stop.
    TrackEnds {
        /// The train.
        train: TrainId,
        /// Where.
        end: NodeId,
    },
    /// What a train may enter ends ahead of it. It has been commanded to stop.
    AtLimit {
        /// The train.
        train: TrainId,
    },
    /// Nobody knows any more where a train is. It has been commanded to stop.
    Lost {
        /// The train.
        train: TrainId,
    },
    /// A contact that may have been closed by one train or another, or by none. What is believed of them stays as it was
    /// until other contacts tell.
    Ambiguous {
        /// The contact.
        sensor: SensorId,
        /// When it was seen closed.
        time: Timestamp,
        /// The train that most likely did.
        likeliest: TrainId,
        /// The next likely; `None` if that is nobody.
        or: Option<TrainId>,
    },
    /// A contact has closed again and again where no train can be: it is not believed any more.
    ContactStuck {
        /// The contact.
        sensor: SensorId,
    },
    /// A contact that was stuck has behaved for a while, and is believed again.
    ContactBehaves {
        /// The contact.
        sensor: SensorId,
    },
    /// A contact that no train can have closed.
    Unexplained {
        /// The contact.
        sensor: SensorId,
        /// When it was seen closed.
        time: Timestamp,
    },
    /// A command has not left for a long time. It will be said again if it is a stop.
    Unconfirmed {
        /// The command.
        command: Command,
    },
}

/// How a stop is going to be made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedStop {
    /// The order.
    pub order: OrderId,
    /// The train.
    pub train: TrainId,
    /// When the last bit of the command shall have left.
    pub leaves: Timestamp,
    /// The last contact that the train passes while the command can still be moved.
    pub trigger: Option<SensorId>,
    /// How long after that contact the command leaves.
    pub after_trigger: Option<TimeSpan>,
    /// Where it will come to rest against the target.
    pub promise: Promise,
}

/// Where a train is from now on that holds a speed, in surveyed lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PacedLine {
    /// The order.
    pub order: OrderId,
    /// The train.
    pub train: TrainId,
    /// A contact of its way.
    pub node: NodeId,
    /// So far past it ...
    pub way: Length,
    /// ... at this time, and onwards ...
    pub time: Timestamp,
    /// ... at this speed.
    pub speed: Speed,
}

/// How a train comes to rest at a place in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedArrival {
    /// The order.
    pub order: OrderId,
    /// The train.
    pub train: TrainId,
    /// When it shall stand there.
    pub by: Timestamp,
    /// For a train at rest: when it starts, and at which step.
    pub starts: Option<(Timestamp, SpeedStep)>,
    /// How it runs until it stops; `None` for a start and a stop with nothing in between.
    pub profile: Option<ArrivalProfile>,
}

/// Where a train comes to rest, counted from the target, negative short of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Promise {
    /// The middle.
    pub median: Length,
    /// 2.5 % of stops end before.
    pub low: Length,
    /// 2.5 % of stops end beyond.
    pub high: Length,
}

/// An order carried out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finished {
    /// The order.
    pub order: OrderId,
    /// The train.
    pub train: TrainId,
    /// When.
    pub time: Timestamp,
    /// Where the train is as far as is known; `None` if that is not known.
    pub achieved: Option<Achieved>,
    /// What was promised when the stop was commanded; only if there was a target.
    pub promise: Option<Promise>,
    /// A contact that should have reported the train on its way and did not: it was missed, or the train stands short of
    /// it, and what is believed of it is wrong.
    pub unseen: Option<SensorId>,
}

/// Where a train came to rest, as is believed without having measured it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Achieved {
    /// The place.
    pub at: Landmark,
    /// One standard deviation of it.
    pub uncertainty: Length,
    /// How far beyond the target that is, negative short of it; only if there was a target.
    pub error: Option<Length>,
}
