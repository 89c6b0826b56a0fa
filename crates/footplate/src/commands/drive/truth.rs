//! What really happened on a simulated layout, for the last column of results and for nobody who drives.

use std::collections::BTreeMap;

use footplate_core::track::{Landmark, Layout, TurnoutStates};
use footplate_core::{Length, TrainId};

use super::spoken::{Ended, Target};
use crate::link::{Link, SimulatedLink};

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
        let world = self.station().world();
        let truth = world.truth();
        let now = truth.train(train)?;
        let passes = truth.passes().iter().rev();
        let pass = passes.filter(|pass| pass.train == Some(train)).find(|pass| pass.sensor == sensor);
        let since = pass.map(|pass| now.odometer - Length::from_mm(pass.odometer_mm));
        // A train that stopped short of the contact has it ahead, if not by its true distance then nearly.
        let ahead = || {
            let lies = layout.turnouts().filter_map(|(turnout, _)| Some((turnout, world.lies(turnout)?)));
            let contact = Landmark { node: place.node, offset: Length::ZERO };
            let turnouts: TurnoutStates = lies.collect();
            let contact = layout.locate(contact, &turnouts).ok()?;
            layout.distance_ahead(now.position?, contact, &turnouts)
        };
        let past = match (since, ahead()) {
            (Some(since), Some(ahead)) if since <= ahead => since,
            (_, Some(ahead)) => -ahead,
            (since, None) => since?,
        };
        Some(past - place.offset)
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
        match ended.target {
            Target::Ahead(distance) => Some(referee.odometer(train)? - *self.0.get(&train)? - distance),
            target => referee.beyond(layout, train, target),
        }
    }
}
