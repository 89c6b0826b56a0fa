//! The true positions of a simulated layout, for the column `true_error_mm` of results and for operators who search a
//! train; no driving code reads them.

use std::collections::BTreeMap;

use footplate_core::track::{Landmark, Layout, Position};
use footplate_core::{EdgeId, Length, TrainId};
use footplate_sim::{Incident, IncidentKind};
use serde::Serialize;

use super::session_message::{Ended, SessionMessage, Target};
use crate::link::{Link, ObservedLink, SimulatedLink};

/// The most edges between a train and the sensor that its place is named after: more than any layout has in a row.
const MAX_EDGES_BEHIND: usize = 32;

/// Where a simulated train really is.
#[derive(Debug, Serialize)]
pub(super) struct TrainWhereabouts {
    train: u16,
    /// The place of its pickup in its direction of travel, as `place` takes it; `None` while it is off the track.
    at: Option<String>,
    speed_mm_per_s: f64,
    /// The parts of edges under it.
    body: Vec<EdgePart>,
}

#[derive(Debug, Serialize)]
struct EdgePart {
    edge: u16,
    from_mm: f64,
    to_mm: f64,
}

impl TrainWhereabouts {
    /// Its place as the prompt takes it; none while it is off the track.
    pub(super) fn place(&self) -> Option<&str> {
        self.at.as_deref()
    }
}

/// The true state of the railway; `None` on a real one.
pub(super) trait GroundTruth {
    /// Where a train is.
    fn whereabouts(&self, layout: &Layout, train: TrainId) -> Option<TrainWhereabouts>;

    /// The total distance of a train.
    fn odometer(&self, train: TrainId) -> Option<Length>;

    /// How far beyond a place the train's pickup is, counted from where the sensor detects it.
    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length>;

    /// What happened to trains that must not: those that touched, derailed or ran off the track, a line each.
    fn wrecks(&self) -> Vec<String>;
}

/// A position as a place: a sensor behind it, and the distance past it. `under` are edges that the train came along.
fn place_of(layout: &Layout, position: Position, under: &[EdgeId]) -> Option<Landmark> {
    let (mut edge, mut offset) = (position.edge, position.offset);
    for _ in 0..MAX_EDGES_BEHIND {
        let node = layout.edge(edge)?.from;
        if layout.sensor_at(node).is_some() {
            return Some(Landmark { node, offset });
        }
        let behind = || layout.edges().filter(|(_, behind)| behind.to == node);
        let (id, found) = behind().find(|(id, _)| under.contains(id)).or_else(|| behind().next())?;
        edge = id;
        offset += found.length;
    }
    None
}

fn tenths(length: Length) -> f64 {
    (length.as_mm() * 10.0).round() / 10.0
}

impl GroundTruth for SimulatedLink<'_> {
    fn whereabouts(&self, layout: &Layout, train: TrainId) -> Option<TrainWhereabouts> {
        let truth = self.station().world().truth();
        let found = truth.train(train)?;
        let under: Vec<(EdgeId, [Length; 2])> = truth.under(train).collect();
        let edges: Vec<EdgeId> = under.iter().map(|(edge, _)| *edge).collect();
        let at = found.position.and_then(|position| place_of(layout, position, &edges));
        let at = at.map(|Landmark { node, offset }| {
            let offset = Length::from_mm(offset.as_mm().round());
            layout.display(Landmark { node, offset }).to_string()
        });
        let part = |(edge, [from, to]): (EdgeId, [Length; 2])| EdgePart {
            edge: edge.0,
            from_mm: tenths(from),
            to_mm: tenths(to),
        };
        Some(TrainWhereabouts {
            train: train.0,
            at,
            speed_mm_per_s: (found.speed.as_mm_per_s() * 10.0).round() / 10.0,
            body: under.into_iter().map(part).collect(),
        })
    }

    fn odometer(&self, train: TrainId) -> Option<Length> {
        Some(self.station().world().truth().train(train)?.odometer)
    }

    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length> {
        let Target::Place(place) = target else { return None };
        let sensor = layout.sensor_at(place.node)?;
        Some(self.station().world().truth().past(train, sensor)? - place.offset)
    }

    fn wrecks(&self) -> Vec<String> {
        let wrecked = |incident: &&Incident| match (incident.kind, incident.train) {
            // Each of the two trains has an entry.
            (IncidentKind::Collision { with }, Some(train)) => train < with,
            (_, train) => train.is_some(),
        };
        self.station().world().incidents().iter().filter(wrecked).map(ToString::to_string).collect()
    }
}

impl<L: Link + GroundTruth> GroundTruth for ObservedLink<L> {
    fn whereabouts(&self, layout: &Layout, train: TrainId) -> Option<TrainWhereabouts> {
        self.inner().whereabouts(layout, train)
    }

    fn odometer(&self, train: TrainId) -> Option<Length> {
        self.inner().odometer(train)
    }

    fn beyond(&self, layout: &Layout, train: TrainId, target: Target) -> Option<Length> {
        self.inner().beyond(layout, train, target)
    }

    fn wrecks(&self) -> Vec<String> {
        self.inner().wrecks()
    }
}

impl GroundTruth for Box<dyn Link + '_> {
    fn whereabouts(&self, _: &Layout, _: TrainId) -> Option<TrainWhereabouts> {
        None
    }

    fn odometer(&self, _: TrainId) -> Option<Length> {
        None
    }

    fn beyond(&self, _: &Layout, _: TrainId, _: Target) -> Option<Length> {
        None
    }

    fn wrecks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// The true odometer readings at which orders began.
#[derive(Debug, Default)]
pub(super) struct StartOdometers(BTreeMap<TrainId, Length>);

impl StartOdometers {
    /// Takes a message that is scored before time moves on: an order that has ended is returned, with how far beyond its target that
    /// really was.
    pub(super) fn score<'m>(
        &mut self,
        truth: &dyn GroundTruth,
        layout: &Layout,
        message: &'m SessionMessage,
    ) -> Option<(&'m Ended, Option<Length>)> {
        match message {
            SessionMessage::Begun(train) => {
                self.0.extend(truth.odometer(*train).map(|odometer| (*train, odometer)));
                None
            }
            SessionMessage::Ended(ended) => Some((ended, self.error(truth, layout, ended))),
            _ => None,
        }
    }

    /// How far beyond its target an order really ended.
    fn error(&self, truth: &dyn GroundTruth, layout: &Layout, ended: &Ended) -> Option<Length> {
        ended.error?;
        let train = ended.train?;
        match ended.target_on_arrival.map_or(ended.target, Target::Place) {
            Target::Ahead(distance) => Some(truth.odometer(train)? - *self.0.get(&train)? - distance),
            target => truth.beyond(layout, train, target),
        }
    }
}
