//! What really happened on a simulated layout, for the last column of results and for nobody who drives.

use std::collections::BTreeMap;

use footplate_core::track::Layout;
use footplate_core::{Length, TrainId};

use super::spoken::{Ended, Target};
use crate::link::{Link, ObservedLink, SimulatedLink};

/// Knows where trains really are, if anybody does.
pub(super) trait Referee {
    /// How far a train has gone in all.
    fn odometer(&self, train: TrainId) -> Option<Length>;

    /// How far beyond a place the train's pickup is, counted from where it closes the contact.
    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length>;
}

impl Referee for SimulatedLink<'_> {
    fn odometer(&self, train: TrainId) -> Option<Length> {
        Some(self.station().world().truth().train(train)?.odometer)
    }

    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length> {
        let Target::Place(place) = target else { return None };
        let sensor = layout.sensor_at(place.node)?;
        Some(self.station().world().truth().past(train, sensor)? - place.offset)
    }
}

impl<L: Link + Referee> Referee for ObservedLink<L> {
    fn odometer(&self, train: TrainId) -> Option<Length> {
        self.inner().odometer(train)
    }

    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length> {
        self.inner().beyond(layout, train, target)
    }
}

impl Referee for Box<dyn Link + '_> {
    fn odometer(&self, _: TrainId) -> Option<Length> {
        None
    }

    fn beyond(&self, _: &Layout, _: TrainId, _: Target) -> Option<Length> {
        None
    }
}

/// Where trains really were when their orders began.
#[derive(Debug, Default)]
pub(super) struct Beginnings(BTreeMap<TrainId, Length>);

impl Beginnings {
    pub(super) fn note(&mut self, referee: &dyn Referee, train: TrainId) {
        if let Some(odometer) = referee.odometer(train) {
            self.0.insert(train, odometer);
        }
    }

    /// How far beyond its target an order really ended.
    pub(super) fn error(&self, referee: &dyn Referee, layout: &Layout, ended: &Ended) -> Option<Length> {
        ended.error?;
        let train = ended.train?;
        match ended.faced.map_or(ended.target, Target::Place) {
            Target::Ahead(distance) => Some(referee.odometer(train)? - *self.0.get(&train)? - distance),
            target => referee.beyond(layout, train, target),
        }
    }
}
