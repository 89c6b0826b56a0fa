//! What a train is busy with, and how far it is with it.

use crate::ids::{SensorId, SpeedStep};
use crate::time::Timestamp;
use crate::track::Landmark;
use crate::tracking::WayPoint;

use super::order::{Aim, OrderId};
use crate::control::Promise;

/// An order being carried out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task {
    pub(super) order: OrderId,
    pub(super) goal: Goal,
    pub(super) phase: Phase,
}

/// What comes of it in the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Goal {
    /// Run at the step it is told.
    Run,
    /// Rest, wherever that is.
    Rest,
    /// Rest at a place.
    RestAt(Destination),
    /// Rest, then the other direction, then this step.
    Reverse(SpeedStep),
    /// Keep to a pace, which the train knows.
    Pace,
}

/// The place to come to rest at, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Destination {
    /// As it was named; a move has no name for it.
    pub(super) named: Option<Landmark>,
    /// On the way, counted from the last contact passed; `None` until the train has been found.
    pub(super) at: Option<WayPoint>,
    pub(super) aim: Aim,
    /// The step to stop from, if it was named.
    pub(super) step: Option<SpeedStep>,
    pub(super) next_round: bool,
    /// When it shall stand there, if anybody asked for that: what hops are like is learnt on the way then, the way counted anew,
    /// and the step to stop from chosen by it.
    pub(super) in_time: Option<Timestamp>,
}

/// How far a task is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Phase {
    /// The train runs until a contact says where it is.
    Finding { since: Timestamp },
    /// The train runs, and the stop is being planned.
    Running { plan: Option<Plan> },
    /// A step has been asked for, mostly 0, and has not left yet.
    Commanding { promise: Option<Promise> },
    /// Step 0 has left, and the train comes to rest by this time.
    Settling { promise: Option<Promise>, until: Timestamp },
    /// It has been commanded to reverse.
    Turning,
    /// It is commanded step after step.
    Pacing,
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plan {
    /// When the last bit of the command shall have left.
    pub(super) leaves: Timestamp,
    /// Contacts that come before it, the last one and the one before that.
    pub(super) triggers: [Option<SensorId>; 2],
    pub(super) promise: Promise,
}
