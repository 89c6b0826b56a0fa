//! The direction of a train that was detected without one, where its recovery knows it.

use crate::ids::{NodeId, TrainId};
use crate::time::Timestamp;

use super::driver::Driver;

impl Driver {
    /// A train that was detected in an unknown direction passed the sensor in that of this node.
    pub(in crate::control) fn decide_direction(&mut self, now: Timestamp, train: TrainId, node: NodeId) {
        let Some(sensor) = self.track.layout.sensor_at(node) else { return };
        if let Some(branch) = self.association.take_direction(train, sensor) {
            self.revise(now, branch);
            self.update(now);
        }
    }
}
