//! A train that is probably not where it was estimated: lifted and put elsewhere, or turned.
//!
//! A second detection proves it and corrects the estimate; until then the train would run on, perhaps into another one. A
//! silent sensor and a detection elsewhere, in either order, are enough to stop it. By chance they coincide once in
//! 300 000 passages: sensors miss 3 in 1000, and in the 1.5 s around that one of 80 reports spuriously once in 800 times.

use crate::ids::{NodeId, SensorId, TrainId};
use crate::time::Timestamp;

use super::driver::Driver;
use super::hypotheses::missed_or_elsewhere;

impl Driver {
    /// The train that an ambiguous detection has just shown elsewhere, with a probability of 0.9 or more.
    pub(in crate::control) fn probably_strayed(&self) -> Option<TrainId> {
        self.association.probably_strayed()
    }

    /// The detections, each as its sensor and time, that a train has probably caused elsewhere, as a sensor is silent at which it
    /// is overdue.
    pub(in crate::control) fn probably_elsewhere(
        &self,
        now: Timestamp,
        train: TrainId,
    ) -> impl Iterator<Item = (SensorId, Timestamp)> {
        let missed =
            self.trains.get(&train).map_or(0.0, |known| known.missed_share(self.track.context(), now));
        let found = self.association.probably_elsewhere(train, missed_or_elsewhere(missed));
        found.map(|detection| (detection.sensor, detection.window.until))
    }

    /// A train that was detected in an unknown direction passed the sensor in that of this node.
    pub(in crate::control) fn decide_direction(&mut self, now: Timestamp, train: TrainId, node: NodeId) {
        let Some(sensor) = self.track.layout.sensor_at(node) else { return };
        if let Some(branch) = self.association.take_direction(train, sensor) {
            self.revise(now, branch);
            self.update(now);
        }
    }
}
