//! Which trains have reserved the track that a train was stopped before.

use alloc::vec::Vec;

use crate::ids::TrainId;
use crate::time::Timestamp;
use crate::units::Length;

use super::dispatcher::Dispatcher;
use super::path::Path;

/// How far beyond the end of authority reservations are looked for: two of the steps in which free track is looked for.
const BEYOND: Length = Length::from_mm(100.0);

impl Dispatcher {
    /// The trains that have reserved the track just beyond a train's end of authority, as the turnouts lie; none where it has
    /// no end within the horizon.
    #[must_use]
    pub fn holders_beyond(&self, train: TrainId, now: Timestamp) -> Vec<TrainId> {
        let found = || {
            let known = self.trains.get(&train)?;
            let limit =
                self.watchdog.driver().position_at(train, self.watchdog.driver().end_of_authority(train)?)?;
            let layout = self.watchdog.driver().layout();
            let room = self.room(now, known);
            let ahead = room.ahead + BEYOND;
            let turnouts = self.watchdog.driver().turnouts();
            let (path, at) = Path::around(layout, turnouts, limit, &known.came, Length::ZERO, ahead);
            let taken = path.reservation(layout, at, at + ahead);
            let others = self.trains.values().filter(|other| other.id != train && other.held.meets(&taken));
            Some(others.map(|other| other.id).collect())
        };
        found().unwrap_or_default()
    }
}
