//! The current state, as sent to browsers.

use std::collections::BTreeMap;

use footplate_core::control::Driver;
use footplate_core::track::{Block, Landmark, NodeKind, Position};
use footplate_core::tracking::PathPoint;
use footplate_core::{HALF_95, Length, SensorId, SpeedStep, Timestamp, TrainId};
use footplate_store::LayoutFile;
use serde::Serialize;

use super::alarm_list::ActiveAlarm;
use super::calibration_picture::CalibrationPicture;
use super::crossing_picture::HeldAtCrossing;
use super::spans::{Span, spans};

/// The drawn size of a train of unknown length: a short locomotive of this gauge (mm from the leading end of its
/// pickup).
const NOSE: Length = Length::from_mm(20.0);
const TAIL: Length = Length::from_mm(130.0);

/// What a train is doing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrainTask {
    /// The order as it was written.
    pub(crate) text: String,
    /// Its target.
    pub(crate) target: Option<Landmark>,
    /// The predicted place of rest relative to the target: median, and ends of the 95 % interval.
    pub(crate) promise: Option<[Length; 3]>,
}

/// What a session knows beside its driver.
#[derive(Debug, Default)]
pub(crate) struct SessionState {
    pub(crate) tasks: BTreeMap<TrainId, TrainTask>,
    /// The functions of each train that were switched on, one bit each.
    pub(crate) functions: BTreeMap<TrainId, u32>,
    pub(crate) schedules: Vec<SchedulePicture>,
}

/// How far a schedule has come. Lines are counted from 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct SchedulePicture {
    pub(crate) name: String,
    /// The present round, from 1.
    pub(crate) round: u32,
    /// How many there are; `None` until it is ended.
    pub(crate) rounds: Option<u32>,
    /// The lines that are being carried out.
    pub(crate) active: Vec<usize>,
    /// The line that follows.
    pub(crate) next: Option<usize>,
    /// The lines of this round that were refused, with the reasons.
    pub(crate) refused: BTreeMap<usize, String>,
    pub(crate) is_over: bool,
}

/// The state of the railway at one time.
#[derive(Debug, Serialize)]
pub(super) struct Picture {
    pub(super) t_s: f64,
    /// All that happened before this is on the disk; nothing where nothing is written down.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) written_until_s: Option<f64>,
    pub(super) trains: Vec<TrainPicture>,
    pub(super) turnouts: BTreeMap<u16, Option<&'static str>>,
    /// Recent detections: sensor, and seconds since.
    pub(super) passed: BTreeMap<u16, f64>,
    /// The sensors whose reports are ignored.
    pub(super) ignored: Vec<u16>,
    /// The state of each block, by the number of its detector; without those that are not known yet.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) blocks: BTreeMap<u16, BlockState>,
    /// The active alarms, the most severe first.
    pub(super) alarms: Vec<ActiveAlarm>,
    /// Trains that hold each other at a level crossing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) crossings_held: Vec<HeldAtCrossing>,
    /// The schedules that run, and those that have ended.
    pub(super) schedules: Vec<SchedulePicture>,
    /// A calibration in progress.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) calibration: Option<CalibrationPicture>,
}

/// What the detector of a block says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum BlockState {
    Free,
    Occupied,
    /// It reported repeatedly where no train can be.
    Ignored,
}

/// The state of every block that is known, by its detector; `occupied` says which have a train in them.
pub(super) fn block_states(
    driver: &Driver,
    occupied: &BTreeMap<SensorId, bool>,
) -> BTreeMap<u16, BlockState> {
    let state = |block: &Block| {
        let is_occupied = *occupied.get(&block.detector)?;
        let state = if block.entries.iter().any(|entry| driver.ignores(*entry)) {
            BlockState::Ignored
        } else if is_occupied {
            BlockState::Occupied
        } else {
            BlockState::Free
        };
        Some((block.detector.0, state))
    };
    driver.layout().blocks().iter().filter_map(state).collect()
}

/// The sensors whose reports are ignored.
pub(super) fn ignored_sensors(driver: &Driver) -> Vec<u16> {
    let sensors = driver.layout().sensors().map(|(sensor, _)| sensor);
    sensors.filter(|sensor| driver.ignores(*sensor)).map(|sensor| sensor.0).collect()
}

/// The state of one train.
#[derive(Debug, Serialize)]
pub(super) struct TrainPicture {
    train: u16,
    step: u8,
    speed_mm_per_s: f64,
    speed_half_mm_per_s: f64,
    at: Option<String>,
    half_mm: Option<f64>,
    at_rest: bool,
    /// Whether its direction is the opposite of that at the begin of the session.
    reversed: bool,
    /// The functions that are on: as the station reports them, the others as they were switched here.
    pub(super) functions: Vec<u8>,
    /// The functions whose state the station reports.
    pub(super) functions_reported: Vec<u8>,
    /// Distance travelled since it was located.
    way_mm: Option<f64>,
    body: Vec<Span>,
    haze: Vec<Span>,
    /// The track reserved for it.
    held: Vec<Span>,
    doing: Option<String>,
    target: Option<Spot>,
    promise_mm: Option<[f64; 3]>,
    rests: Vec<Span>,
    if_stopped: Option<RestPicture>,
}

/// Where a train would come to rest if it were commanded to stop now.
#[derive(Debug, Serialize)]
struct RestPicture {
    at: Option<String>,
    /// Distance from its present position, and half the 95 % interval of a single stop.
    way_mm: f64,
    half_mm: f64,
    /// Seconds from now.
    in_s: f64,
}

/// A point on the track.
#[derive(Debug, Serialize)]
struct Spot {
    edge: u16,
    offset_mm: f64,
}

/// The picture of a train; `commanded` is its step, `travelled` the distance since it was located.
pub(super) fn paint_train(
    driver: &Driver,
    train: TrainId,
    task: Option<&TrainTask>,
    now: Timestamp,
    commanded: SpeedStep,
    travelled: Option<Length>,
    held: Vec<Span>,
) -> TrainPicture {
    let (layout, turnouts) = (driver.layout(), driver.turnouts());
    let located = driver.locate(train, now);
    let position = driver.position(train, now);
    let half = located.map(|located| located.uncertainty * HALF_95);
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
        step: commanded.get(),
        speed_mm_per_s: located.map_or(0.0, |located| tenths(located.speed.as_mm_per_s())),
        speed_half_mm_per_s: located
            .map_or(0.0, |located| tenths(HALF_95 * located.speed_uncertainty.as_mm_per_s())),
        at: located.and_then(|located| name(driver, train, located.at)),
        half_mm: half.map(|half| tenths(half.as_mm())),
        at_rest: located.is_some_and(|located| located.at_rest),
        reversed: driver.is_reversed(train),
        functions: Vec::new(),
        functions_reported: Vec::new(),
        way_mm: travelled.map(|length| tenths(length.as_mm())),
        body: around(TAIL, NOSE),
        haze: half.map_or_else(Vec::new, |half| around(TAIL + half, NOSE + half)),
        held,
        doing: task.map(|task| task.text.clone()),
        target: place.map(|at| Spot { edge: at.edge.0, offset_mm: tenths(at.offset.as_mm()) }),
        promise_mm: promise.map(|promise| promise.map(|length| tenths(length.as_mm()))),
        rests: rests.unwrap_or_default(),
        if_stopped: located
            .filter(|located| !located.at_rest)
            .and_then(|located| if_stopped(driver, train, located.at, now)),
    }
}

fn if_stopped(driver: &Driver, train: TrainId, from: PathPoint, now: Timestamp) -> Option<RestPicture> {
    let rest = driver.stopped_at(train, now)?;
    // Offsets from different nodes cannot be subtracted.
    (rest.at.node == from.node).then(|| RestPicture {
        at: name(driver, train, rest.at),
        way_mm: tenths((rest.at.distance - from.distance).as_mm()),
        half_mm: tenths(HALF_95 * libm::hypot(rest.doubt.as_mm(), rest.scatter.as_mm())),
        in_s: tenths((rest.time - now).as_s()),
    })
}

/// A place as sensor and offset, rounded to a millimetre.
fn name(driver: &Driver, train: TrainId, at: PathPoint) -> Option<String> {
    let landmark = driver.landmark(train, at)?;
    let mm = landmark.offset.as_mm().round();
    let name = driver.layout().node_name(landmark.node);
    Some(if mm == 0.0 { name.to_owned() } else { format!("{name}{mm:+}mm") })
}

/// The layout, as sent to browsers.
#[derive(Debug, Serialize)]
pub(crate) struct LayoutPicture {
    name: String,
    nodes: Vec<NodePicture>,
    edges: Vec<EdgePicture>,
    blocks: Vec<BlockPicture>,
    /// The level crossings, each as a place on either track.
    crossings: Vec<[Spot; 2]>,
}

#[derive(Debug, Serialize)]
struct BlockPicture {
    name: String,
    /// The number of its detector.
    detector: u16,
}

#[derive(Debug, Serialize)]
struct NodePicture {
    id: u16,
    name: String,
    kind: &'static str,
    /// The number of its sensor or turnout.
    number: Option<u16>,
    point: Option<[f64; 2]>,
    /// Whether it is at the boundary of a block.
    is_boundary: bool,
}

#[derive(Debug, Serialize)]
struct EdgePicture {
    id: u16,
    from: u16,
    to: u16,
    leg: Option<&'static str>,
    length_mm: f64,
    /// Its speed restriction.
    zone: Option<ZonePicture>,
    /// The detector of its block.
    block: Option<u16>,
}

#[derive(Debug, Serialize)]
struct ZonePicture {
    name: String,
    max_mm_s: f64,
}

impl LayoutPicture {
    pub(crate) fn of(file: &LayoutFile) -> Self {
        let layout = &file.layout;
        let node = |(id, node): (footplate_core::NodeId, &footplate_core::track::Node)| {
            let (kind, number) = match node.kind {
                NodeKind::Sensor(sensor) => ("contact", Some(sensor.0)),
                NodeKind::Branch(turnout) => ("branch", Some(turnout.0)),
                NodeKind::Merge(turnout) => ("merge", Some(turnout.0)),
                NodeKind::Boundary => ("boundary", None),
                NodeKind::Enter | NodeKind::Exit => ("end", None),
            };
            NodePicture {
                id: id.0,
                name: node.name.clone(),
                kind,
                number,
                point: file.drawing.point(id),
                is_boundary: layout.is_boundary(id),
            }
        };
        let edge = |(id, edge): (footplate_core::EdgeId, &footplate_core::track::Edge)| EdgePicture {
            id: id.0,
            from: edge.from.0,
            to: edge.to.0,
            leg: edge.leg.map(|leg| if leg.is_curved() { "curved" } else { "straight" }),
            length_mm: tenths(edge.length.as_mm()),
            zone: layout.zone(id).map(|zone| ZonePicture {
                name: zone.name.clone(),
                max_mm_s: tenths(zone.limit.as_mm_per_s()),
            }),
            block: layout.block_of_edge(id).map(|block| block.detector.0),
        };
        let spot = |at: Position| Spot { edge: at.edge.0, offset_mm: tenths(at.offset.as_mm()) };
        Self {
            name: layout.name().to_owned(),
            crossings: layout.crossings().iter().map(|crossing| crossing.tracks.map(spot)).collect(),
            nodes: layout.nodes().map(node).collect(),
            edges: layout.edges().map(edge).collect(),
            blocks: layout
                .blocks()
                .iter()
                .map(|block| BlockPicture { name: block.name.clone(), detector: block.detector.0 })
                .collect(),
        }
    }
}

/// Rounds to a tenth: finer than any displayed estimate.
pub(super) fn tenths(number: f64) -> f64 {
    (number * 10.0).round() / 10.0
}

pub(super) fn millis(seconds: f64) -> f64 {
    (seconds * 1e3).round() / 1e3
}
