//! What a driver does for the trains that keep to a pace.

use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::driver::Driver;
use crate::ids::SensorId;
use crate::time::Timestamp;

impl Driver {
    /// Looks at the trains whose time has come.
    pub(in crate::control::drive) fn pace(&mut self, now: Timestamp) {
        let ground = self.track.ground();
        for train in self.trains.values_mut().filter(|train| train.next_look().is_some_and(|at| at <= now)) {
            train.pace(ground, now, &mut self.outputs);
        }
    }

    /// The contact that a train that keeps to a pace is about to pass. Keeps in mind when that changes.
    pub(in crate::control::drive) fn due_of_paced(&mut self, now: Timestamp) -> Option<SensorId> {
        let paced = || self.trains.values().filter_map(DrivenTrain::due_span);
        let is_due = |[from, until]: [Timestamp; 2]| from <= now && now < until;
        self.watch_changes = paced().flat_map(|(_, span)| span).filter(|at| *at > now).min();
        paced().find(|(_, span)| is_due(*span)).map(|(sensor, _)| sensor)
    }
}
