//! A train that is probably not where it was estimated: lifted and put elsewhere, or turned.
//!
//! A second detection proves it and corrects the estimate; until then the train would run on, perhaps into another one. A
//! silent sensor and a detection elsewhere, in either order, are enough to stop it. By chance they coincide once in
//! 300 000 passages: sensors miss 3 in 1000, and in the 1.5 s around that one of 80 reports spuriously once in 800 times.

use crate::ids::{SensorId, TrainId};
use crate::time::Timestamp;

use super::driver::Driver;
use super::hypotheses::log_density_if_strayed;

impl Driver {
    /// The train that an ambiguous detection has just shown elsewhere, with a probability of 0.9 or more.
    pub(in crate::control) fn probably_strayed(&self) -> Option<TrainId> {
        self.association.probably_strayed()
    }

    /// A detection that was assigned to no train, and that some train may have caused: its sensor and time.
    pub(in crate::control) fn unassigned_detection(&self) -> Option<(SensorId, Timestamp)> {
        self.association.unassigned()
    }

    /// Whether a train that a sensor should have reported has probably caused an earlier detection elsewhere, which no train
    /// explained.
    pub(in crate::control) fn has_probably_strayed(
        &self,
        now: Timestamp,
        train: TrainId,
        to: SensorId,
    ) -> bool {
        let Some(train) = self.trains.get(&train) else { return false };
        let log_density = log_density_if_strayed(train, self.track.context(), now);
        self.association.is_probable_then(to, now, log_density)
    }
}
