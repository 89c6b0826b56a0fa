//! Stop commands and their confirmation: by the link in time, and by the trains after that.

use alloc::collections::BTreeMap;

use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};

/// The power goes off if a stop command has not left after this. On a link that answers it takes a tenth of a second.
pub(super) const CONFIRMED_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);
/// A train that does not stop reaches the sensor ahead within this after it should be at rest.
pub(super) const WATCHED_FOR: TimeSpan = TimeSpan::from_s(10.0);

/// One train that was commanded to stop.
#[derive(Debug, Clone, Copy)]
struct Stop {
    asked: Timestamp,
    /// When it should be at rest, once the command has left.
    stands: Option<Timestamp>,
}

/// All stop commands.
#[derive(Debug, Clone, Default)]
pub(super) struct Stops {
    stops: BTreeMap<TrainId, Stop>,
}

impl Stops {
    /// A train is being commanded to stop.
    pub(super) fn ask(&mut self, train: TrainId, now: Timestamp) {
        self.stops.insert(train, Stop { asked: now, stands: None });
    }

    /// The command has left; the train is at rest by a time.
    pub(super) fn left(&mut self, train: TrainId, stands: Timestamp) {
        if let Some(stop) = self.stops.get_mut(&train) {
            stop.stands.get_or_insert(stands);
        }
    }

    /// It is commanded to move again, or the power is off.
    pub(super) fn forget(&mut self, train: TrainId) {
        self.stops.remove(&train);
    }

    /// Whether the stop command of a train has not left yet.
    pub(super) fn waits(&self, train: TrainId) -> bool {
        self.stops.get(&train).is_some_and(|stop| stop.stands.is_none())
    }

    /// When a train is at rest after its stop command; `None` until that has left.
    pub(super) fn stands(&self, train: TrainId) -> Option<Timestamp> {
        self.stops.get(&train)?.stands
    }

    /// Whether a train should be at rest, and for so short a time that a sensor ahead may still show that it is not.
    pub(super) fn should_stand(&self, train: TrainId, now: Timestamp) -> bool {
        self.stands(train).is_some_and(|stands| now > stands && now - stands < WATCHED_FOR)
    }

    /// A train whose stop command has not left in time.
    pub(super) fn overdue(&self, now: Timestamp) -> Option<TrainId> {
        let late = |stop: &Stop| stop.stands.is_none() && now - stop.asked >= CONFIRMED_WITHIN;
        self.stops.iter().find(|(_, stop)| late(stop)).map(|(train, _)| *train)
    }

    /// When the next stop command has to have left.
    pub(super) fn next(&self) -> Option<Timestamp> {
        let open = self.stops.values().filter(|stop| stop.stands.is_none());
        open.map(|stop| stop.asked + CONFIRMED_WITHIN).min()
    }
}
