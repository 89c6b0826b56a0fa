//! The true positions of a simulated layout, for the column `true_error_mm` of results; no driving code reads them.

use std::collections::BTreeMap;

use footplate_core::track::Layout;
use footplate_core::{Length, TrainId};

use super::session_message::{Ended, Target};
use crate::link::{Link, ObservedLink, SimulatedLink};

/// The true state of the railway; `None` on a real one.
pub(super) trait GroundTruth {
    /// The total distance of a train.
    fn odometer(&self, train: TrainId) -> Option<Length>;

    /// How far beyond a place the train's pickup is, counted from where the sensor detects it.
    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length>;
}

impl GroundTruth for SimulatedLink<'_> {
    fn odometer(&self, train: TrainId) -> Option<Length> {
        Some(self.station().world().truth().train(train)?.odometer)
    }

    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length> {
        let Target::Place(place) = target else { return None };
        let sensor = layout.sensor_at(place.node)?;
        Some(self.station().world().truth().past(train, sensor)? - place.offset)
    }
}

impl<L: Link + GroundTruth> GroundTruth for ObservedLink<L> {
    fn odometer(&self, train: TrainId) -> Option<Length> {
        self.inner().odometer(train)
    }

    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length> {
        self.inner().beyond(layout, train, target)
    }
}

impl GroundTruth for Box<dyn Link + '_> {
    fn odometer(&self, _: TrainId) -> Option<Length> {
        None
    }

    fn beyond(&self, _: &Layout, _: TrainId, _: Target) -> Option<Length> {
        None
    }
}

/// The true odometer readings at which orders began.
#[derive(Debug, Default)]
pub(super) struct StartOdometers(BTreeMap<TrainId, Length>);

impl StartOdometers {
    pub(super) fn note(&mut self, truth: &dyn GroundTruth, train: TrainId) {
        if let Some(odometer) = truth.odometer(train) {
            self.0.insert(train, odometer);
        }
    }

    /// How far beyond its target an order really ended.
    pub(super) fn error(&self, truth: &dyn GroundTruth, layout: &Layout, ended: &Ended) -> Option<Length> {
        ended.error?;
        let train = ended.train?;
        match ended.target_on_arrival.map_or(ended.target, Target::Place) {
            Target::Ahead(distance) => Some(truth.odometer(train)? - *self.0.get(&train)? - distance),
            target => truth.beyond(layout, train, target),
        }
    }
}
