//! What there is to see at one moment, as the browser gets it.

use std::collections::BTreeMap;

use footplate_core::control::Driver;
use footplate_core::track::{Landmark, NodeKind};
use footplate_core::{Length, SensorId, Timestamp, TrainId};
use footplate_store::LayoutFile;
use serde::Serialize;

use super::spans::{Span, spans};

/// 95 % of a normal distribution lie within so many standard deviations.
const PROMISED: f64 = 1.959_964;
/// A contact is shown as just passed for so long (s).
const FLASHES_S: f64 = 1.5;
/// What trains look like whose length nobody said: a short locomotive of the gauge (mm from the pickup's leading end).
const NOSE: Length = Length::from_mm(20.0);
const TAIL: Length = Length::from_mm(130.0);

/// What a train is busy with, as far as a picture shows it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrainTask {
    /// The order in its own words.
    pub(crate) text: String,
    /// The place that it leads to.
    pub(crate) target: Option<Landmark>,
    /// Where it will come to rest against that: the middle, and the ends of the 95 % interval.
    pub(crate) promise: Option<[Length; 3]>,
}

/// One moment.
#[derive(Debug, Serialize)]
pub(crate) struct Picture {
    t_s: f64,
    trains: Vec<TrainPicture>,
    turnouts: BTreeMap<u16, Option<&'static str>>,
    /// Contacts passed a moment ago, by the seconds since.
    passed: BTreeMap<u16, f64>,
}

#[derive(Debug, Serialize)]
struct TrainPicture {
    train: u16,
    step: u8,
    speed_mm_per_s: f64,
    speed_half_mm_per_s: f64,
    at: Option<String>,
    half_mm: Option<f64>,
    at_rest: bool,
    body: Vec<Span>,
    haze: Vec<Span>,
    doing: Option<String>,
    target: Option<Spot>,
    promise_mm: Option<[f64; 3]>,
    rests: Vec<Span>,
}

/// A point on the rails.
#[derive(Debug, Serialize)]
struct Spot {
    edge: u16,
    offset_mm: f64,
}

/// Paints pictures of what a driver knows.
#[derive(Debug)]
pub(crate) struct Painter {
    passed: BTreeMap<SensorId, Timestamp>,
}

impl Painter {
    pub(crate) const fn new() -> Self {
        Self { passed: BTreeMap::new() }
    }

    /// A contact was passed.
    pub(crate) fn passed(&mut self, sensor: SensorId, at: Timestamp) {
        self.passed.insert(sensor, at);
    }

    /// The picture of a moment that is not before the last entry.
    pub(crate) fn paint(
        &self,
        driver: &Driver,
        tasks: &BTreeMap<TrainId, TrainTask>,
        now: Timestamp,
        began: Timestamp,
    ) -> Picture {
        let seconds_since = |at: Timestamp| (now - at).as_s();
        let layout = driver.layout();
        Picture {
            t_s: millis((now - began).as_s()),
            trains: driver.trains().map(|train| paint_train(driver, train, tasks.get(&train), now)).collect(),
            turnouts: layout
                .turnouts()
                .map(|(turnout, _)| {
                    let leg = driver.turnouts().get(turnout);
                    (turnout.0, leg.map(|leg| if leg.is_curved() { "curved" } else { "straight" }))
                })
                .collect(),
            passed: self
                .passed
                .iter()
                .filter(|(_, at)| seconds_since(**at) < FLASHES_S)
                .map(|(sensor, at)| (sensor.0, millis(seconds_since(*at))))
                .collect(),
        }
    }
}

fn paint_train(driver: &Driver, train: TrainId, task: Option<&TrainTask>, now: Timestamp) -> TrainPicture {
    let (layout, turnouts) = (driver.layout(), driver.turnouts());
    let located = driver.locate(train, now);
    let position = driver.position(train, now);
    let half = located.map(|located| located.uncertainty * PROMISED);
    let around = |behind: Length, ahead: Length| {
        position.map_or_else(Vec::new, |at| spans(layout, turnouts, at, behind, ahead))
    };
    let place = task.and_then(|task| layout.locate(task.target?, turnouts).ok());
    let promise = task.and_then(|task| task.promise);
    let rests = place.zip(promise).and_then(|(place, [_, low, high])| {
        let first = layout.advance(place, low, turnouts).ok()?;
        Some(spans(layout, turnouts, first, Length::ZERO, high - low))
    });
    TrainPicture {
        train: train.0,
        step: driver.told(train).get(),
        speed_mm_per_s: located.map_or(0.0, |located| tenths(located.speed.as_mm_per_s())),
        speed_half_mm_per_s: located
            .map_or(0.0, |located| tenths(PROMISED * located.speed_uncertainty.as_mm_per_s())),
        at: located.and_then(|located| {
            let landmark = driver.landmark(train, located.at)?;
            let mm = landmark.offset.as_mm().round();
            let name = layout.node_name(landmark.node);
            Some(if mm == 0.0 { name.to_owned() } else { format!("{name}{mm:+}mm") })
        }),
        half_mm: half.map(|half| tenths(half.as_mm())),
        at_rest: located.is_some_and(|located| located.at_rest),
        body: around(TAIL, NOSE),
        haze: half.map_or_else(Vec::new, |half| around(TAIL + half, NOSE + half)),
        doing: task.map(|task| task.text.clone()),
        target: place.map(|at| Spot { edge: at.edge.0, offset_mm: tenths(at.offset.as_mm()) }),
        promise_mm: promise.map(|promise| promise.map(|length| tenths(length.as_mm()))),
        rests: rests.unwrap_or_default(),
    }
}

/// The layout as the browser draws it, once.
#[derive(Debug, Serialize)]
pub(super) struct LayoutPicture {
    name: String,
    nodes: Vec<NodePicture>,
    edges: Vec<EdgePicture>,
}

#[derive(Debug, Serialize)]
struct NodePicture {
    id: u16,
    name: String,
    kind: &'static str,
    /// The number of its contact or turnout.
    number: Option<u16>,
    point: Option<[f64; 2]>,
}

#[derive(Debug, Serialize)]
struct EdgePicture {
    id: u16,
    from: u16,
    to: u16,
    leg: Option<&'static str>,
    length_mm: f64,
}

impl LayoutPicture {
    pub(super) fn of(file: &LayoutFile) -> Self {
        let layout = &file.layout;
        let node = |(id, node): (footplate_core::NodeId, &footplate_core::track::Node)| {
            let (kind, number) = match node.kind {
                NodeKind::Sensor(sensor) => ("contact", Some(sensor.0)),
                NodeKind::Branch(turnout) => ("branch", Some(turnout.0)),
                NodeKind::Merge(turnout) => ("merge", Some(turnout.0)),
                NodeKind::Enter | NodeKind::Exit => ("end", None),
            };
            NodePicture { id: id.0, name: node.name.clone(), kind, number, point: file.drawing.point(id) }
        };
        let edge = |(id, edge): (footplate_core::EdgeId, &footplate_core::track::Edge)| EdgePicture {
            id: id.0,
            from: edge.from.0,
            to: edge.to.0,
            leg: edge.leg.map(|leg| if leg.is_curved() { "curved" } else { "straight" }),
            length_mm: tenths(edge.length.as_mm()),
        };
        Self {
            name: layout.name().to_owned(),
            nodes: layout.nodes().map(node).collect(),
            edges: layout.edges().map(edge).collect(),
        }
    }
}

/// Nothing that is drawn is known better.
fn tenths(number: f64) -> f64 {
    (number * 10.0).round() / 10.0
}

fn millis(seconds: f64) -> f64 {
    (seconds * 1e3).round() / 1e3
}
