//! The notices of a dispatcher.

use alloc::vec::Vec;

use crate::control::drive::{DriveNotice, OrderId, Refusal};
use crate::control::supervise::WatchdogNotice;
use crate::ids::TrainId;
use crate::time::TimeSpan;
use crate::track::Landmark;
use crate::units::Length;

/// What has happened to a train, or is about to.
#[derive(Debug, Clone, PartialEq)]
pub enum DispatchNotice {
    /// A notice of the driver.
    Drive(DriveNotice),
    /// A notice of the watchdog.
    Watch(WatchdogNotice),
    /// All the track to the destination of a train, or to where it steps aside, is reserved.
    RouteSet {
        /// The train.
        train: TrainId,
        /// The predicted running time.
        takes: TimeSpan,
        /// Reversals on the way.
        turns: usize,
    },
    /// A train has to wait for others.
    Waits {
        /// The train.
        train: TrainId,
        /// The trains that have reserved track on its path.
        on: Vec<TrainId>,
    },
    /// Trains at rest block each other: some of them step aside.
    Deadlock {
        /// The blocked train.
        train: TrainId,
        /// Those that step aside, in this order; none if no moves were found, and one train goes anywhere else.
        moves: Vec<TrainId>,
    },
    /// A train moves to make room for another.
    StepsAside {
        /// The train.
        train: TrainId,
        /// The train that it makes room for.
        makes_room_for: TrainId,
        /// Where to.
        to: Landmark,
    },
    /// The authority of a train at rest could not be used and was withdrawn; the dispatcher tries again later.
    Withdrawn {
        /// The train.
        train: TrainId,
        /// Why the driver refused it, if it did.
        why: Option<Refusal>,
    },
    /// A train has come to its destination.
    Arrived {
        /// The journey.
        order: OrderId,
        /// The train.
        train: TrainId,
        /// How far beyond the destination it is at rest, as estimated, in the direction that it faces.
        error: Option<Length>,
        /// The time since the journey was ordered.
        took: TimeSpan,
    },
    /// A train is not on its reserved track: it was stopped, and so were the trains that it could have met.
    Diverged {
        /// The train.
        train: TrainId,
        /// The trains that were stopped for it.
        stopped: Vec<TrainId>,
    },
    /// The place of a train is unknown. The track that it may be on stays reserved.
    HeldAsUnknown {
        /// The train.
        train: TrainId,
    },
}
