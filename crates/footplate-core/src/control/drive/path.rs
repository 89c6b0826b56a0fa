//! The track as the driver knows it: distances, positions and speed restrictions along a train's path, with the turnouts
//! as they are, in the path lengths of the train.

use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId, SensorId, TurnoutId};
use crate::model::MotionModel;
use crate::model::survey::SectionIndex;
use crate::track::{Hop, Layout, NodeKind, Position, TurnoutStates, Zone};
use crate::tracking::{Located, PathPoint, TrackContext, distance_to, place_of};
use crate::units::Length;

/// The owner of what a [`TrackContext`] refers to.
#[derive(Debug, Clone)]
pub(super) struct KnownTrack {
    pub(super) layout: Layout,
    pub(super) sections: SectionIndex,
    pub(super) turnouts: TurnoutStates,
}

impl KnownTrack {
    pub(super) fn new(layout: Layout, turnouts: TurnoutStates) -> Self {
        let sections = SectionIndex::of(&layout);
        Self { layout, sections, turnouts }
    }

    pub(super) const fn context(&self) -> TrackContext<'_> {
        TrackContext { layout: &self.layout, sections: &self.sections, turnouts: &self.turnouts }
    }
}

/// The hops ahead of a node, each with the distances to its start and end. Ends where the path ends, and after as
/// many hops as there are nodes, more than one lap of any circuit.
fn hop_ranges<'g>(
    context: TrackContext<'g>,
    model: &MotionModel,
    from: NodeId,
) -> impl Iterator<Item = (Hop<'g>, [Length; 2])> {
    let mut end = Length::ZERO;
    context.hops_ahead(from).take(context.layout.nodes().len()).map(move |hop| {
        let begin = end;
        end += model.length(context.sections, &hop)[0];
        (hop, [begin, end])
    })
}

/// The distance from a node to another ahead of it.
pub(super) fn distance_between(
    context: TrackContext<'_>,
    model: &MotionModel,
    from: NodeId,
    to: NodeId,
) -> Option<Length> {
    if from == to {
        return Some(Length::ZERO);
    }
    hop_ranges(context, model, from).find(|(hop, _)| hop.to == to).map(|(_, [_, end])| end)
}

/// The length of the circuit through a node. Hops end at sensors: from another node it is the circuit of the next
/// sensor, if that passes the node.
pub(super) fn circuit_length(context: TrackContext<'_>, model: &MotionModel, node: NodeId) -> Option<Length> {
    let sensor_node = match context.layout.sensor_at(node) {
        Some(_) => node,
        None => context.hops_ahead(node).next()?.to,
    };
    let mut over_it = sensor_node == node;
    let (_, [_, end]) = hop_ranges(context, model, sensor_node).find(|(hop, _)| {
        let starts_at = |edge: &EdgeId| context.layout.edge(*edge).is_some_and(|edge| edge.from == node);
        over_it |= hop.edges.iter().any(starts_at);
        hop.to == sensor_node
    })?;
    (over_it && end > Length::ZERO).then_some(end)
}

/// The same point, measured from a node that the train has passed since: the next on its path, or the same after one
/// lap.
pub(super) fn recount_from(
    context: TrackContext<'_>,
    model: &MotionModel,
    point: PathPoint,
    node: NodeId,
) -> Option<PathPoint> {
    let (_, [_, between]) = hop_ranges(context, model, point.node).find(|(hop, _)| hop.to == node)?;
    Some(PathPoint { node, distance: point.distance - between })
}

/// The sensors ahead of a node up to a distance, with their distances.
pub(super) fn sensors_within<'g>(
    context: TrackContext<'g>,
    model: &MotionModel,
    from: NodeId,
    until: Length,
) -> impl Iterator<Item = (SensorId, Length)> {
    hop_ranges(context, model, from)
        .take_while(move |(_, [_, end])| *end <= until)
        .filter_map(|(hop, [_, end])| Some((hop.sensor?, end)))
}

/// The end of the track ahead of a node and its distance; `None` on a circuit, and beyond a turnout of unknown
/// position.
pub(super) fn track_end(
    context: TrackContext<'_>,
    model: &MotionModel,
    from: NodeId,
) -> Option<(NodeId, Length)> {
    let (hop, [_, end]) = hop_ranges(context, model, from).find(|(hop, _)| hop.sensor.is_none())?;
    Some((hop.to, end))
}

/// The first facing turnout ahead of a node whose position is unknown.
pub(super) fn unknown_turnout(context: TrackContext<'_>, from: NodeId) -> Option<TurnoutId> {
    let last = context.hops_ahead(from).take(context.layout.nodes().len()).last().map_or(from, |hop| hop.to);
    let hop = context.layout.open_hops_from(last, context.turnouts).next()?;
    let fork = hop.needs.iter().find(|need| need.facing && context.turnouts.get(need.turnout).is_none())?;
    Some(fork.turnout)
}

/// The nodes of a turnout: at its toe, and at its legs.
pub(super) fn nodes_of_turnout(context: TrackContext<'_>, turnout: TurnoutId) -> Option<[NodeId; 2]> {
    let branch = context.layout.branch(turnout)?;
    debug_assert!(context.layout.node(branch).is_some_and(|node| matches!(node.kind, NodeKind::Branch(_))));
    Some([branch, branch.reverse()])
}

/// Hops examined in either direction: more than a lap of any layout in use.
const MAX_HOPS: usize = 200;
/// Edges closer together than this (m) are adjacent: sums of lengths are rounded.
const ADJACENT: f64 = 1e-6;

/// A part of the path with a speed restriction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RestrictedStretch<'g> {
    pub(super) zone: &'g Zone,
    /// Start and end (m past the node from which the train's position is measured, negative behind it).
    pub(super) from: f64,
    pub(super) to: f64,
}

impl<'g> RestrictedStretch<'g> {
    /// The restrictions behind and ahead of a node, up to these distances (m), in order along the path. Where the
    /// position of a turnout ahead is unknown, those of both legs.
    pub(super) fn about(
        context: TrackContext<'g>,
        model: &MotionModel,
        node: NodeId,
        behind: f64,
        ahead: f64,
    ) -> Vec<Self> {
        let mut found = Vec::new();
        let mut at = 0.0;
        for hop in context.hops_ahead(node.reverse()).take(MAX_HOPS) {
            if at > behind {
                break;
            }
            at += add(&mut found, context, model, &hop, at);
        }
        for stretch in &mut found {
            (stretch.from, stretch.to) = (-stretch.to, -stretch.from);
        }
        found.reverse();
        let (mut at, mut end) = (0.0, node);
        for hop in context.hops_ahead(node).take(MAX_HOPS) {
            if at > ahead {
                return found;
            }
            at += add(&mut found, context, model, &hop, at);
            end = hop.to;
        }
        for hop in context.layout.open_hops_from(end, context.turnouts) {
            add(&mut found, context, model, &hop, at);
        }
        found
    }
}

/// Adds the restricted edges of a hop that starts at a distance (m). Returns the train's path length of the hop.
fn add<'g>(
    found: &mut Vec<RestrictedStretch<'g>>,
    context: TrackContext<'g>,
    model: &MotionModel,
    hop: &Hop<'g>,
    begins: f64,
) -> f64 {
    let path_length = model.length(context.sections, hop)[0].as_m();
    let surveyed = hop.length.as_m();
    let scale = if surveyed > 0.0 { path_length / surveyed } else { 1.0 };
    let mut along = begins;
    for id in hop.edges {
        let Some(edge) = context.layout.edge(*id) else { continue };
        let (from, to) = (along, along + edge.length.as_m() * scale);
        along = to;
        let Some(zone) = context.layout.zone(*id) else { continue };
        match found.last_mut() {
            Some(last) if last.zone == zone && (from - last.to).abs() <= ADJACENT => last.to = to,
            _ => found.push(RestrictedStretch { zone, from, to }),
        }
    }
    path_length
}

/// Length of a pickup shoe along the track where it was not measured. Shoes for three-rail track are sold in lengths
/// of 30 to 50 mm; detections of the course's trains differ by 20 to 90 mm between directions.
const SHOE_LENGTH: Length = Length::from_mm(35.0);
/// One standard deviation of that.
const SHOE_DEVIATION: Length = Length::from_mm(12.0);

/// From the first to the last part of a train that sensors detect, and one standard deviation: its pickup where a point sensor gave
/// its position, all of it where a block did.
fn sensed_length(context: TrackContext<'_>, model: &MotionModel, at: PathPoint) -> [Length; 2] {
    let sensor = context.layout.sensor_at(at.node);
    if sensor.and_then(|sensor| context.layout.block_of_entry(sensor)).is_none() {
        return [SHOE_LENGTH, SHOE_DEVIATION];
    }
    let length = model.train_length().length();
    [length.value, length.uncertainty]
}

/// The position of a train at rest after reversing, and one standard deviation. It is measured from the node behind
/// the train: turnouts further away no longer affect it. `None` where the path back is unknown or does not lead to
/// the train.
pub(super) fn reversed_location(
    context: TrackContext<'_>,
    model: &MotionModel,
    located: Located,
) -> Option<(PathPoint, Length)> {
    let leading = reversed_position(context, model, located.at)?;
    let behind = context.layout.edge(leading.edge)?.from;
    let distance = distance_to(context, model, behind, leading)?;
    let [_, deviation] = sensed_length(context, model, located.at);
    let uncertainty = Length::from_m(libm::hypot(located.uncertainty.as_m(), deviation.as_m()));
    Some((PathPoint { node: behind, distance }, uncertainty))
}

/// Where the part of a train that sensors detect first is once the train at rest has reversed.
pub(super) fn reversed_position(
    context: TrackContext<'_>,
    model: &MotionModel,
    at: PathPoint,
) -> Option<Position> {
    context.layout.reversed(trailing_position(context, model, at)?)
}

/// Where the part that sensors detect last is, facing as the train does. Found along the path on which the train came: a
/// trailing turnout on it may be set for the other leg by now, or may have been run through.
pub(super) fn trailing_position(
    context: TrackContext<'_>,
    model: &MotionModel,
    at: PathPoint,
) -> Option<Position> {
    let [length, _] = sensed_length(context, model, at);
    if at.distance >= length {
        return place_of(context, model, PathPoint { distance: at.distance - length, ..at });
    }
    let back = context.layout.reversed(place_of(context, model, at)?)?;
    context.layout.reversed(context.layout.advance(back, length, context.turnouts).ok()?)
}

/// Where the leading end of the pickup is once a train at rest at a position, whatever path it came on, has reversed.
pub(super) fn reversed_on_current_path(context: TrackContext<'_>, place: Position) -> Option<Position> {
    context.layout.advance(context.layout.reversed(place)?, SHOE_LENGTH, context.turnouts).ok()
}
