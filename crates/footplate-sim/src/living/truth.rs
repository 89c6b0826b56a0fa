//! The truth of a living layout, which only scorers may see.

use footplate_core::track::Position;
use footplate_core::{EdgeId, Length, SensorId, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};

use crate::living::body::{Body, after};
use crate::living::live_train::{End, LiveTrain};
use crate::living::past_truth::{PassTruth, RestTruth};
use crate::living::world::LivingLayout;
use crate::track::TrueTrack;
use crate::train::Train;

/// The longest distance that is measured (chosen: twice round a large layout).
const FAR_MM: f64 = 20_000.0;
/// A sensor that scatters closes no further than this beyond its usual place: 2.5 standard deviations of 15 mm and of 3 mm of the
/// shoe.
const CLOSES_WITHIN_MM: f64 = 40.0;
/// Positions are stated past a sensor no further away (chosen: longer than any hop of the course layouts).
const NEAR_MM: f64 = 5000.0;

/// The truth about a living layout.
#[derive(Debug, Clone, Copy)]
pub struct Truth<'w, 'l> {
    pub(crate) world: &'w LivingLayout<'l>,
}

/// Where a train really is, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainTruth {
    /// The leading end of its shoe, in true lengths; nothing while it is lifted.
    pub position: Option<Position>,
    /// How fast it runs.
    pub speed: Speed,
    /// The step that its decoder heard last.
    pub commanded: SpeedStep,
    /// Since when it has been standing, while it stands.
    pub at_rest_since: Option<Timestamp>,
    /// The distance it has run under its own power.
    pub odometer: Length,
    /// Which of its ends is in front.
    pub leads: End,
    /// How warm it is, from 0, cold, to 1; of a standing train, how warm it was when it stopped.
    pub warmth: f64,
    /// The speed of this run over that of an average one.
    pub run_factor: f64,
    /// Whether it has to be put on the rails by hand again.
    pub is_wrecked: bool,
}

impl<'w, 'l> Truth<'w, 'l> {
    /// A train now.
    pub fn train(&self, train: TrainId) -> Option<TrainTruth> {
        let found = self.found(train)?;
        let place = found.body.as_ref().and_then(Body::place);
        Some(TrainTruth {
            position: place.map(|(edge, offset)| Position { edge, offset: Length::from_mm(offset) }),
            speed: Speed::from_mm_per_s(found.speed),
            commanded: found.heard,
            at_rest_since: found.stands_since,
            odometer: Length::from_mm(found.odometer),
            leads: found.leads,
            warmth: found.load.warmth(),
            run_factor: found.load.run(),
            is_wrecked: found.is_wrecked,
        })
    }

    /// What is under a train from its rear end to its front end: edges as it runs, each with the part of it that is under
    /// the train, counted from the start of the edge in true lengths. Nothing while it is lifted.
    pub fn under(&self, train: TrainId) -> impl Iterator<Item = (EdgeId, [Length; 2])> + use<'w> {
        let body = self.found(train).and_then(|found| found.body.as_ref());
        body.into_iter().flat_map(Body::under).map(|(edge, part)| (edge, part.map(Length::from_mm)))
    }

    /// A train as it was drawn.
    pub fn engine(&self, train: TrainId) -> Option<&'w Train> {
        Some(&*self.found(train)?.train)
    }

    /// From the first to the last part of a train that detectors of blocks sense.
    pub fn sensed_length(&self, train: TrainId) -> Option<Length> {
        Some(Length::from_mm(self.found(train)?.sensed().iter().sum()))
    }

    /// The usual release delay of a detector.
    pub fn release_delay(&self, detector: SensorId) -> Option<TimeSpan> {
        self.world.s88.release_delay(detector)
    }

    /// The rails as they are.
    pub fn track(&self) -> &'w TrueTrack {
        &self.world.rails.track
    }

    /// How far the leading end of a train's shoe is past the place where it closes a sensor, or the first part that detectors
    /// sense past the entry of a block, in true lengths; negative if it is before it. This is the distance since the train
    /// passed it or, if that is shorter, the distance to it as the turnouts lie. `None` if neither is below 20 m.
    pub fn past(&self, train: TrainId, sensor: SensorId) -> Option<Length> {
        let found = self.found(train)?;
        let by = |pass: &&PassTruth| pass.train == Some(train) && pass.sensor == sensor;
        let passed = self.world.s88.passes.iter().rev().find(by);
        let place = found.body.as_ref()?.place()?;
        // What it passed before it was lifted is no distance from here.
        let passed = passed.filter(|pass| pass.odometer_mm >= found.put_down_at);
        let since = passed.map(|pass| found.odometer - pass.odometer_mm).filter(|mm| *mm < FAR_MM);
        let is_entry = self.world.layout().block_of_entry(sensor).is_some();
        let ahead = if is_entry { found.sensed()[0] } else { 0.0 };
        // Past its usual place, and it has not closed yet this time.
        let just_past = self.closes_at(sensor).and_then(|usual| {
            let shoe_past = self.distance_between(usual, place).map(|mm| ahead + mm);
            let shoe_short = self.distance_between(place, usual).map(|mm| ahead - mm);
            shoe_past.into_iter().chain(shoe_short).filter(|mm| *mm >= 0.0).min_by(f64::total_cmp)
        });
        let is_due = |mm: &f64| *mm < CLOSES_WITHIN_MM && since.is_none_or(|since| since > CLOSES_WITHIN_MM);
        let since = just_past.filter(is_due).or(since);
        let before = self.distance_to((place.0, place.1 + ahead), sensor);
        let nearer = |since: f64, before: f64| if since <= before { since } else { -before };
        let mm = match (since, before) {
            (Some(since), Some(before)) => nearer(since, before),
            (Some(since), None) => since,
            (None, before) => -before?,
        };
        Some(Length::from_mm(mm))
    }

    /// The path length from one sensor to another for a train: the distance that it would run on level straight rails in
    /// the same time. `edges` lead from the one to the other.
    pub fn path_length(
        &self,
        train: TrainId,
        edges: &[EdgeId],
        from: SensorId,
        to: SensorId,
    ) -> Option<Length> {
        let sensitivity = self.engine(train)?.curve_sensitivity;
        let track = self.track();
        let slower = |edge: &EdgeId| 1.0 + sensitivity * (track.speed_factor(*edge).as_parts() - 1.0);
        let length: Length = edges.iter().map(|edge| track.length(*edge) / slower(edge)).sum();
        // Sensors are a few millimetres from their nodes: it makes no difference on which rails.
        let offset = |sensor, edge: Option<&EdgeId>| track.sensor_offset(sensor) / edge.map_or(1.0, slower);
        Some(length - offset(from, edges.first()) + offset(to, edges.last()))
    }

    /// Where a sensor closes on average.
    fn closes_at(&self, sensor: SensorId) -> Option<(EdgeId, f64)> {
        let layout = self.world.layout();
        layout.edges().find_map(|(id, _)| {
            let sensors = &self.world.rails.rail(id)?.sensors;
            sensors.iter().find(|(_, found)| *found == sensor).map(|(at, _)| (id, *at))
        })
    }

    /// The true distance from one place to another ahead as the turnouts lie, in mm.
    fn distance_between(&self, from: (EdgeId, f64), to: (EdgeId, f64)) -> Option<f64> {
        let rails = &self.world.rails;
        let lies = |turnout| self.world.points.lies(turnout);
        let (mut edge, mut begins, mut length) = (from.0, from.1, 0.0);
        while length < NEAR_MM {
            let rail = rails.rail(edge)?;
            if edge == to.0 && begins <= to.1 {
                return Some(length + (to.1 - begins));
            }
            length += (rail.length_mm - begins).max(f64::MIN_POSITIVE);
            (edge, begins) = (after(rails, &lies, edge)?, 0.0);
        }
        None
    }

    /// The true distance from a place to a sensor ahead as the turnouts lie, in mm.
    fn distance_to(&self, (edge, offset): (EdgeId, f64), sensor: SensorId) -> Option<f64> {
        let rails = &self.world.rails;
        let lies = |turnout| self.world.points.lies(turnout);
        let (mut edge, mut begins) = (edge, -offset);
        while begins < FAR_MM {
            let rail = rails.rail(edge)?;
            let due = |(at, found): &&(f64, SensorId)| *found == sensor && begins + at > 0.0;
            if let Some((at, _)) = rail.sensors.iter().find(due) {
                return Some(begins + at);
            }
            begins += rail.length_mm.max(f64::MIN_POSITIVE);
            edge = after(rails, &lies, edge)?;
        }
        None
    }

    /// Every standstill so far, in the order in which they began.
    pub fn rests(&self) -> &'w [RestTruth] {
        &self.world.rests
    }

    /// Every passage of a sensor by a train so far; and every spurious detection, as soon as the station has read it.
    pub fn passes(&self) -> &'w [PassTruth] {
        &self.world.s88.passes
    }

    fn found(&self, train: TrainId) -> Option<&'w LiveTrain> {
        self.world.trains.iter().find(|found| found.id == train)
    }
}
