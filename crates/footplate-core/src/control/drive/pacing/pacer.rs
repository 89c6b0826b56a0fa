//! What a driver does for the trains that keep to a pace.

use alloc::vec::Vec;

use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::driver::Driver;
use crate::ids::{SensorId, TrainId};
use crate::time::Timestamp;
use crate::units::Length;

impl Driver {
    /// Looks at the trains whose time has come.
    pub(in crate::control::drive) fn pace(&mut self, now: Timestamp) {
        let due = |train: &DrivenTrain| train.next_pacing_update().is_some_and(|at| at <= now);
        let due: Vec<TrainId> =
            self.trains.values().filter(|train| due(train)).map(DrivenTrain::id).collect();
        let context = self.track.context();
        for id in due {
            // Whoever follows looks at the others.
            if let Some(mut train) = self.trains.remove(&id) {
                train.pace(context, now, &self.trains, &mut self.outputs);
                self.trains.insert(id, train);
            }
        }
    }

    /// How far a train that holds a speed is ahead of where it should be, in surveyed lengths, as far as is believed; `None`
    /// for any other, and before the line begins.
    #[must_use]
    pub fn ahead_of_line(&self, train: TrainId, now: Timestamp) -> Option<Length> {
        self.trains.get(&train)?.ahead_of_line(self.track.context(), now)
    }

    /// The contact that a train that keeps to a pace is about to pass. Keeps in mind when that changes.
    pub(in crate::control::drive) fn due_of_paced(&mut self, now: Timestamp) -> Option<SensorId> {
        let paced = || self.trains.values().filter_map(DrivenTrain::due_span);
        let is_due = |[from, until]: [Timestamp; 2]| from <= now && now < until;
        self.watch_changes = paced().flat_map(|(_, span)| span).filter(|at| *at > now).min();
        paced().find(|(_, span)| is_due(*span)).map(|(sensor, _)| sensor)
    }
}
