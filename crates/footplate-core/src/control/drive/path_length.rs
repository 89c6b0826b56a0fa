//! Distances along hops, with the turnouts as they are, in path lengths of a train.

use crate::ids::{EdgeId, NodeId, SensorId, TurnoutId};
use crate::model::MotionModel;
use crate::track::{Hop, NodeKind};
use crate::tracking::{TrackContext, WayPoint};
use crate::units::Length;

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
    let contact = match context.layout.sensor_at(node) {
        Some(_) => node,
        None => context.hops_ahead(node).next()?.to,
    };
    let mut over_it = contact == node;
    let (_, [_, end]) = hop_ranges(context, model, contact).find(|(hop, _)| {
        let starts_at = |edge: &EdgeId| context.layout.edge(*edge).is_some_and(|edge| edge.from == node);
        over_it |= hop.edges.iter().any(starts_at);
        hop.to == contact
    })?;
    (over_it && end > Length::ZERO).then_some(end)
}

/// The same point, measured from a node that the train has passed since: the next on its path, or the same after one
/// lap.
pub(super) fn recount_from(
    context: TrackContext<'_>,
    model: &MotionModel,
    point: WayPoint,
    node: NodeId,
) -> Option<WayPoint> {
    let (_, [_, between]) = hop_ranges(context, model, point.node).find(|(hop, _)| hop.to == node)?;
    Some(WayPoint { node, way: point.way - between })
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
