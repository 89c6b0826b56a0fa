//! Prevents turnouts from being thrown under a train.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use crate::ids::{NodeId, SensorId, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{MAX_MISSED, NodeKind, Position, TurnoutNeed};
use crate::tracking::{TrackContext, place_of};
use crate::units::Length;

use super::driven_train::DrivenTrain;
use super::driver::Driver;
use super::path::nodes_of_turnout;

/// Bound on the error of a train's estimated position, in standard deviations: exceeded once in 15 000 times.
const CERTAIN: f64 = 4.0;
/// From the order to the turnout's new position: a poll, the command on the line, and the solenoid.
const THROWING: TimeSpan = TimeSpan::from_ms(500);
/// A position this close to the start of its edge is at the node: sums of lengths are rounded.
const AT_NODE: Length = Length::from_mm(1e-6);

/// A train that is on a turnout, or will be before it has been thrown.
pub(super) fn train_on(
    trains: &BTreeMap<TrainId, DrivenTrain>,
    context: TrackContext<'_>,
    now: Timestamp,
    turnout: TurnoutId,
) -> Option<TrainId> {
    let nodes = nodes_of_turnout(context, turnout)?;
    let on_it = |train: &&DrivenTrain| {
        nodes_under(context, train, now).iter().any(|(under, _)| nodes.contains(under))
    };
    trains.values().find(on_it).map(DrivenTrain::id)
}

/// The turnouts that a train is on, or will be before they have been thrown.
pub(super) fn turnouts_under(
    context: TrackContext<'_>,
    train: &DrivenTrain,
    now: Timestamp,
) -> BTreeSet<TurnoutId> {
    let turnout_at = |node| match context.layout.node(node)?.kind {
        NodeKind::Branch(turnout) | NodeKind::Merge(turnout) => Some(turnout),
        _ => None,
    };
    nodes_under(context, train, now).into_iter().filter_map(|(node, _)| turnout_at(node)).collect()
}

impl Driver {
    /// A train reached a sensor: the turnouts that it faced since its last detection lie as they are known.
    pub(super) fn prove_turnouts(&mut self, now: Timestamp, train: TrainId, sensor: SensorId) {
        let context = self.track.context();
        let from = self.trains.get(&train).and_then(|train| train.located(context, now));
        let (Some(from), Some(to)) = (from, context.node_of(sensor)) else { return };
        let mut faced: Vec<TurnoutId> = Vec::new();
        let mut is_reached = false;
        for hop in context.hops_ahead(from.at.node).take(MAX_MISSED + 1) {
            let is_faced = |need: &&TurnoutNeed| need.facing && context.turnouts.get(need.turnout).is_some();
            faced.extend(hop.needs.iter().filter(is_faced).map(|need| need.turnout));
            is_reached = hop.to == to;
            if is_reached {
                break;
            }
        }
        if is_reached {
            faced.into_iter().for_each(|turnout| self.track.turnouts.prove(turnout));
        }
    }
}

/// The nodes that a train is on or will reach soon, in both directions: it may come from the toe or from a leg.
fn nodes_under(context: TrackContext<'_>, train: &DrivenTrain, now: Timestamp) -> Vec<(NodeId, Length)> {
    let mut under = Vec::new();
    let located = train.located(context, now);
    let place = located.and_then(|located| place_of(context, &train.model, located.at));
    let (Some(located), Some(place)) = (located, place) else { return under };
    let [ahead, behind] = train.reach.map(|reach| reach + located.uncertainty * CERTAIN);
    nodes_within(context, place, (ahead + located.speed * THROWING).max(behind), &mut under);
    if let Some(back) = context.layout.reversed(place) {
        nodes_within(context, back, behind, &mut under);
    }
    under
}

/// Adds the nodes ahead of a position up to a distance, through turnouts that are set for the path or unknown, each
/// with its distance.
fn nodes_within(context: TrackContext<'_>, from: Position, limit: Length, found: &mut Vec<(NodeId, Length)>) {
    let Some(edge) = context.layout.edge(from.edge) else { return };
    let begin = found.len();
    let mut open = alloc::vec![(edge.to, edge.length - from.offset)];
    if from.offset <= AT_NODE {
        open.push((edge.from, Length::ZERO));
    }
    while let Some((node, distance)) = open.pop() {
        let nearer = |(known, before): &(NodeId, Length)| *known == node && *before <= distance;
        if distance > limit || found.iter().skip(begin).any(nearer) {
            continue;
        }
        found.push((node, distance));
        for id in context.layout.outgoing(node).edges() {
            if let Some(next) = context.layout.edge(id)
                && context.layout.needs_of(id).all(|need| context.turnouts.allow(need))
            {
                open.push((next.to, distance + next.length));
            }
        }
    }
}
