//! Stops that have been asked for and have to be confirmed: by the line in time, and by the trains after that.

use alloc::collections::BTreeMap;

use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};

/// A command to stop that has not left after this long is not waited for: the power goes off. On a line that answers it
/// takes a tenth of a second.
pub(super) const CONFIRMED_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);
/// For so long after it should stand a train is expected to close the contact ahead if it does not.
pub(super) const WATCHED_FOR: TimeSpan = TimeSpan::from_s(10.0);

/// One train that was commanded to stop.
#[derive(Debug, Clone, Copy)]
struct Stop {
    asked: Timestamp,
    /// When it should stand, once the command has left.
    stands: Option<Timestamp>,
}

/// All of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Stops {
    stops: BTreeMap<TrainId, Stop>,
}

impl Stops {
    /// A train is being commanded to stop.
    pub(super) fn ask(&mut self, train: TrainId, now: Timestamp) {
        self.stops.insert(train, Stop { asked: now, stands: None });
    }

    /// The command has left; the train stands by a time.
    pub(super) fn left(&mut self, train: TrainId, stands: Timestamp) {
        if let Some(stop) = self.stops.get_mut(&train) {
            stop.stands.get_or_insert(stands);
        }
    }

    /// It is told to move again, or the power is off.
    pub(super) fn forget(&mut self, train: TrainId) {
        self.stops.remove(&train);
    }

    /// Whether a train was commanded to stop and nothing says that this has left.
    pub(super) fn waits(&self, train: TrainId) -> bool {
        self.stops.get(&train).is_some_and(|stop| stop.stands.is_none())
    }

    /// When a train stands that was told to; `None` as long as that has not left.
    pub(super) fn stands(&self, train: TrainId) -> Option<Timestamp> {
        self.stops.get(&train)?.stands
    }

    /// Whether a train should stand, and has for so short a time that a contact ahead may say that it does not.
    pub(super) fn should_stand(&self, train: TrainId, now: Timestamp) -> bool {
        self.stands(train).is_some_and(|stands| now > stands && now - stands < WATCHED_FOR)
    }

    /// A train whose stop is not confirmed in time.
    pub(super) fn overdue(&self, now: Timestamp) -> Option<TrainId> {
        let late = |stop: &Stop| stop.stands.is_none() && now - stop.asked >= CONFIRMED_WITHIN;
        self.stops.iter().find(|(_, stop)| late(stop)).map(|(train, _)| *train)
    }

    /// When the next one has to be confirmed.
    pub(super) fn next(&self) -> Option<Timestamp> {
        let open = self.stops.values().filter(|stop| stop.stands.is_none());
        open.map(|stop| stop.asked + CONFIRMED_WITHIN).min()
    }
}
