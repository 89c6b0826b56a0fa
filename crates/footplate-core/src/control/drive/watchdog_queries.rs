//! Queries and corrections that the watchdog makes on a driver.

use crate::ids::{NodeId, SensorId, TrainId};
use crate::model::MotionFit;
use crate::time::Timestamp;
use crate::tracking::{PassedContact, TrackContext};
use crate::units::Length;

use super::driver::Driver;

impl Driver {
    /// Gives up the position of a train that was found to be wrong.
    pub fn lose(&mut self, now: Timestamp, train: TrainId) {
        self.association.forget(train);
        let context = self.track.context();
        if let Some(train) = self.trains.get_mut(&train) {
            train.locator.lose();
            train.passages.forget();
            train.clear_missed();
            train.expect_next(context, now);
        }
        self.update_line_requests(now);
    }

    /// The layout, turnouts and lengths as estimators use them.
    pub(crate) const fn context(&self) -> TrackContext<'_> {
        self.track.context()
    }

    /// The next sensor ahead of a train, with the turnouts as they are, whether or not the train moves.
    #[must_use]
    pub fn contact_ahead(&self, train: TrainId, now: Timestamp) -> Option<SensorId> {
        let located = self.locate(train, now)?;
        let context = self.track.context();
        let model = self.model(train)?;
        let mut way = Length::ZERO;
        let hops = context.hops_ahead(located.at.node).take(context.layout.nodes().len());
        for hop in hops {
            way += model.length(context.sections, &hop)[0];
            if way > located.at.way {
                return hop.sensor;
            }
        }
        None
    }

    /// The path length of a train from one node to the next sensor's node; `None` if `to` is not that node.
    #[must_use]
    pub fn felt_hop(&self, train: TrainId, from: NodeId, to: NodeId) -> Option<Length> {
        let context = self.track.context();
        let hop = context.hop_from(from).filter(|hop| hop.to == to)?;
        Some(self.model(train)?.length(context.sections, &hop)[0])
    }

    /// The node of the sensor that a train passed.
    #[must_use]
    pub fn node_passed(&self, passed: &PassedContact) -> Option<NodeId> {
        self.track.layout.sensor_node(passed.sensor)
    }

    /// Repeats the fit of a train's motion; see [`MotionFit::refit`].
    pub(crate) fn refit(&self, fit: &mut MotionFit) {
        fit.refit(&self.track.sections);
    }
}
