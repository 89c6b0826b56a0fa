//! What somebody who watches over a driver asks of it.

use crate::ids::{NodeId, SensorId, TrainId};
use crate::model::MotionFit;
use crate::time::Timestamp;
use crate::tracking::{PassedContact, TrackContext};
use crate::units::Length;

use super::driver::Driver;

impl Driver {
    /// What is believed of where a train is was wrong: from now on nobody knows.
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

    /// What the trains move on.
    pub(crate) const fn context(&self) -> TrackContext<'_> {
        self.track.context()
    }

    /// The contact that a train comes to next if it goes on, as the turnouts lie, whether it moves or not.
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

    /// The way from one node to the contact that is next behind it, as a train feels it; `None` if the other one is not.
    #[must_use]
    pub fn felt_hop(&self, train: TrainId, from: NodeId, to: NodeId) -> Option<Length> {
        let context = self.track.context();
        let hop = context.hop_from(from).filter(|hop| hop.to == to)?;
        Some(self.model(train)?.length(context.sections, &hop)[0])
    }

    /// The node of the contact that a train passed.
    #[must_use]
    pub fn node_passed(&self, passed: &PassedContact) -> Option<NodeId> {
        self.track.layout.sensor_node(passed.sensor)
    }

    /// Fits a train's motion anew; see [`MotionFit::refit`].
    pub(crate) fn refit(&self, fit: &mut MotionFit) {
        fit.refit(&self.track.sections);
    }
}
