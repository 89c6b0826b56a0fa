//! What a dispatcher has to say while it dispatches.

use alloc::vec::Vec;

use crate::control::drive::{DriveNotice, OrderId, Refusal};
use crate::control::supervise::WatchdogNotice;
use crate::ids::TrainId;
use crate::time::TimeSpan;
use crate::track::Landmark;
use crate::units::Length;

/// What happened, and what is going to.
#[derive(Debug, Clone, PartialEq)]
pub enum DispatchNotice {
    /// What the driver says.
    Drive(DriveNotice),
    /// What its watchdog says.
    Watch(WatchdogNotice),
    /// A train got all the track to its destination, or to where it steps aside to.
    RouteSet {
        /// The train.
        train: TrainId,
        /// How long it will take, as far as is foreseen.
        takes: TimeSpan,
        /// How often it turns around on the way.
        turns: usize,
    },
    /// A train has to wait for others.
    Waits {
        /// The train.
        train: TrainId,
        /// Those that hold track on its way.
        on: Vec<TrainId>,
    },
    /// Trains at rest are in each other's way: some of them step aside.
    Deadlock {
        /// The train that cannot get through.
        train: TrainId,
        /// Those that will step aside, in this order; none if nothing was found that helps, and one will go anywhere else.
        moves: Vec<TrainId>,
    },
    /// A train is sent out of the way of another.
    StepsAside {
        /// The train.
        train: TrainId,
        /// The one that it makes room for.
        makes_room_for: TrainId,
        /// Where to.
        to: Landmark,
    },
    /// What was granted to a train at rest could not be run, and was taken back; it is tried anew later.
    Withdrawn {
        /// The train.
        train: TrainId,
        /// What the driver had against it, if it was the driver.
        why: Option<Refusal>,
    },
    /// A train has come to its destination.
    Arrived {
        /// The journey.
        order: OrderId,
        /// The train.
        train: TrainId,
        /// How far beyond the destination it stands as far as is known, seen as it faces.
        error: Option<Length>,
        /// How long that took since it was asked for.
        took: TimeSpan,
    },
    /// A train is somewhere else than it should be: it was stopped, and so were these, which it could have met.
    Diverged {
        /// The train.
        train: TrainId,
        /// Those that were stopped for it.
        stopped: Vec<TrainId>,
    },
    /// Nobody knows where a train is. What it may be on stays held.
    HeldAsUnknown {
        /// The train.
        train: TrainId,
    },
}
