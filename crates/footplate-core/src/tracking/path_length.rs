//! Path lengths: from sensor to sensor, to a place on the layout, and back.

use super::location::PathPoint;
use super::track_context::TrackContext;
use crate::ids::{NodeId, SensorId};
use crate::linalg::Gaussian;
use crate::model::{MotionModel, PATH_LENGTH_SPREAD};
use crate::track::{Hop, Landmark, Layout, MAX_MISSED, Position, Reach};
use crate::units::Length;

/// Chance of a missed detection, as ln: dirty track, a light pickup (chosen; the trains of the course miss fewer). Where trains
/// are distinguished, it is what was learnt of each.
const LOG_MISSED: f64 = -3.9;
/// Most hops of a path to a place: more than a lap of any layout in use.
const MOST_HOPS: usize = 200;
/// One standard deviation of where a sensor closes against the survey (m): half a pickup's springiness and the length of a
/// contact track (chosen; tapes laid from sensors agree with it).
const SENSOR_PLACE_M: f64 = 0.005;

/// A path to a sensor, past missed detections, in path lengths.
#[derive(Debug, Clone, Copy)]
pub(super) struct PathReach {
    /// Its length (m).
    pub(super) length: Gaussian,
    /// Sensors on the path that did not report.
    pub(super) missed: usize,
}

impl PathReach {
    /// To the sensor from which distances count.
    pub(super) const NONE: Self = Self { length: Gaussian { mean: 0.0, variance: 0.0 }, missed: 0 };

    /// Whether it leads to the sensor from which distances count.
    pub(super) fn is_none(&self) -> bool {
        self.length.mean == 0.0
    }

    /// ln of the chance that these detections were missed.
    pub(super) fn log_chance(&self) -> f64 {
        LOG_MISSED * self.missed as f64
    }
}

/// The path length of a hop (m).
pub(super) fn hop_length(context: TrackContext<'_>, model: &MotionModel, hop: &Hop<'_>) -> Gaussian {
    let [length, uncertainty] = model.length(context.sections, hop).map(Length::as_m);
    Gaussian { mean: length, variance: uncertainty * uncertainty }
}

fn reach_length(context: TrackContext<'_>, model: &MotionModel, layout: &Layout, reach: &Reach) -> PathReach {
    let hops = reach.hops().iter().filter_map(|hop| layout.hop(*hop));
    let length = hops.map(|hop| hop_length(context, model, &hop)).fold(
        Gaussian { mean: 0.0, variance: 0.0 },
        |sum, hop| Gaussian { mean: sum.mean + hop.mean, variance: sum.variance + hop.variance },
    );
    PathReach { length, missed: reach.missed() }
}

/// Every path from a node to a sensor that is open by the known turnouts.
pub(super) fn path_reaches<'g>(
    context: TrackContext<'g>,
    model: &'g MotionModel,
    from: NodeId,
    sensor: SensorId,
) -> impl Iterator<Item = PathReach> + 'g {
    context
        .layout
        .reaches(from, context.turnouts, MAX_MISSED)
        .filter(move |reach| reach.sensor == Some(sensor))
        .map(move |reach| reach_length(context, model, context.layout, &reach))
}

/// The path length from a waypoint's node to a place on the layout, as the turnouts lie; `None` if no path leads there within
/// one lap.
pub fn distance_to(
    context: TrackContext<'_>,
    model: &MotionModel,
    from: NodeId,
    to: Position,
) -> Option<Length> {
    let mut distance = Length::ZERO;
    for (count, hop) in context.hops_ahead(from).take(MOST_HOPS).enumerate() {
        if count > 0 && hop.from == from {
            return None;
        }
        let [path_length, _] = model.length(context.sections, &hop);
        let mut along = Length::ZERO;
        for id in hop.edges {
            if *id == to.edge {
                return Some(distance + path_length * part(along + to.offset, hop.length));
            }
            along += context.layout.edge(*id)?.length;
        }
        distance += path_length;
    }
    None
}

/// The length of a hop between its two sensors by tape (m). The survey knows it to the errors of its edges and of where sensors
/// close, the train to the difference between path length and surveyed length. Both are weighted by their variance; the train
/// mostly knows it better.
pub(super) fn taped_length(context: TrackContext<'_>, model: &MotionModel, hop: &Hop<'_>) -> Gaussian {
    let path_length = hop_length(context, model, hop);
    let surveyed = hop.length.as_m();
    let survey =
        context.sections.section(hop.id).map_or(0.0, |section| context.sections.survey_variance(section))
            + 2.0 * SENSOR_PLACE_M * SENSOR_PLACE_M;
    let feels = PATH_LENGTH_SPREAD * surveyed;
    let train = path_length.variance + feels * feels;
    if train <= 0.0 {
        return Gaussian { mean: surveyed, variance: survey };
    }
    let (one, other) = (1.0 / survey, 1.0 / train);
    Gaussian {
        mean: (surveyed * one + path_length.mean * other) / (one + other),
        variance: 1.0 / (one + other),
    }
}

/// The path length from a waypoint's node to a landmark ahead: so many millimetres past the sensor of its name, whatever the
/// survey has for the rest of the hop. `None` if no path leads there within one lap.
pub fn distance_to_landmark(
    context: TrackContext<'_>,
    model: &MotionModel,
    from: NodeId,
    to: Landmark,
) -> Option<Length> {
    let Some((base, before)) = path_to_node(context, model, from, to.node) else {
        let position = context.layout.locate(to, context.turnouts).ok()?;
        return distance_to(context, model, from, position);
    };
    if to.offset < Length::ZERO {
        return Some(base + to.offset * before);
    }
    let (mut distance, mut left) = (base, to.offset);
    for hop in context.hops_ahead(to.node).take(MOST_HOPS) {
        let path_length = hop_length(context, model, &hop).mean;
        let taped = taped_length(context, model, &hop).mean;
        if left.as_m() <= taped {
            return Some(distance + left * if taped > 0.0 { path_length / taped } else { 1.0 });
        }
        (distance, left) = (distance + Length::from_m(path_length), left - Length::from_m(taped));
    }
    (left == Length::ZERO).then_some(distance)
}

/// The path to a node at which hops begin or end, and the ratio of path length to taped length on the hop before it.
fn path_to_node(
    context: TrackContext<'_>,
    model: &MotionModel,
    from: NodeId,
    to: NodeId,
) -> Option<(Length, f64)> {
    if from == to {
        return Some((Length::ZERO, 1.0));
    }
    let mut distance = 0.0;
    for (count, hop) in context.hops_ahead(from).take(MOST_HOPS).enumerate() {
        if count > 0 && hop.from == from {
            return None;
        }
        let path_length = hop_length(context, model, &hop).mean;
        distance += path_length;
        if hop.to == to {
            let taped = taped_length(context, model, &hop).mean;
            return Some((Length::from_m(distance), if taped > 0.0 { path_length / taped } else { 1.0 }));
        }
    }
    None
}

/// A point of the path as people name it and measure it with a tape: from the last sensor before it. Whole laps do not change
/// the place.
pub fn landmark_of(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> Landmark {
    let [landmark, _] = taped(context, model, at);
    landmark
}

/// Standard deviation of a point of the path as people name it (m), for a train that knows its position exactly: past a sensor
/// the ratio of path length to taped length is uncertain.
pub(super) fn taping_deviation(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> f64 {
    let [_, deviation] = taped(context, model, at);
    deviation.offset.as_m()
}

/// The landmark of a point on the path, and one standard deviation of its offset in the same form.
fn taped(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> [Landmark; 2] {
    let mut from = at.node;
    let mut left = at.distance.as_m();
    for hop in context.hops_ahead(at.node).take(MOST_HOPS) {
        let path_length = hop_length(context, model, &hop).mean;
        if left > path_length && hop.sensor.is_some() {
            left -= path_length;
            from = hop.to;
            continue;
        }
        let length = taped_length(context, model, &hop);
        let scale = if path_length > 0.0 && left > 0.0 { length.mean / path_length } else { 1.0 };
        let relative = if length.mean > 0.0 { libm::sqrt(length.variance) / length.mean } else { 0.0 };
        let offset = Length::from_m(left * scale);
        return [Landmark { node: from, offset }, Landmark { node: from, offset: offset.abs() * relative }];
    }
    [Landmark { node: from, offset: Length::from_m(left) }, Landmark { node: from, offset: Length::ZERO }]
}

fn part(of: Length, whole: Length) -> f64 {
    if whole > Length::ZERO { of / whole } else { 0.0 }
}

/// The place on the layout of a point on the path, as the turnouts lie; for a point behind its node, the node.
pub fn place_of(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> Option<Position> {
    let mut left = at.distance.max(Length::ZERO);
    for hop in context.hops_ahead(at.node).take(MOST_HOPS) {
        let [path_length, _] = model.length(context.sections, &hop);
        if left > path_length && hop.sensor.is_some() {
            left -= path_length;
            continue;
        }
        let mut along = (hop.length * part(left, path_length)).min(hop.length);
        let mut last = None;
        for id in hop.edges {
            let length = context.layout.edge(*id)?.length;
            if along <= length {
                return Some(Position { edge: *id, offset: along });
            }
            along -= length;
            last = Some(Position { edge: *id, offset: length });
        }
        return last;
    }
    None
}
