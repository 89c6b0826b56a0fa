//! What lies around a train: turnouts too near to be thrown, and track ends ahead.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec;

use crate::ids::{NodeId, TurnoutId};
use crate::track::{Circuit, HopId, Layout, Leg, NodeKind, TurnoutStates};
use crate::units::Length;

/// Nodes that a look around may pass: far more than lie within a few metres of any train.
const MAX_PASSED: usize = 256;

/// The turnouts within a way ahead of a node, on any branch.
pub(super) fn turnouts_within(layout: &Layout, from: NodeId, way: Length) -> BTreeSet<TurnoutId> {
    let mut found = BTreeSet::new();
    let mut open = vec![(from, way)];
    let mut passed = 0;
    while let Some((node, left)) = open.pop() {
        passed += 1;
        if passed > MAX_PASSED {
            break;
        }
        if let Some(NodeKind::Branch(turnout) | NodeKind::Merge(turnout)) =
            layout.node(node).map(|node| node.kind)
        {
            found.insert(turnout);
        }
        for edge in layout.outgoing(node).edges().filter_map(|id| layout.edge(id)) {
            let length = edge.known.shortest();
            if length <= left {
                open.push((edge.to, left - length));
            }
        }
    }
    found
}

/// The turnouts that a train may stand on or reach before they are thrown, with how they lie as far as is known.
pub(super) fn held_turnouts(
    layout: &Layout,
    turnouts: &TurnoutStates,
    node: NodeId,
    ahead: Length,
    behind: Length,
) -> BTreeMap<TurnoutId, Option<Leg>> {
    let mut near = turnouts_within(layout, node, ahead);
    near.extend(turnouts_within(layout, node.reverse(), behind));
    near.into_iter().map(|turnout| (turnout, turnouts.get(turnout))).collect()
}

/// How far ahead of a node the track may end, over turnouts as they lie and over both legs where that is unknown;
/// `None` if it does not within `way`.
pub(super) fn end_within(
    layout: &Layout,
    turnouts: &TurnoutStates,
    node: NodeId,
    way: Length,
) -> Option<Length> {
    let mut nearest: Option<Length> = None;
    let mut open = vec![(node, Length::ZERO)];
    let mut passed = 0;
    while let Some((node, gone)) = open.pop() {
        passed += 1;
        if passed > MAX_PASSED {
            break;
        }
        for hop in layout.open_hops_from(node, turnouts) {
            let length = gone + layout.least_length(&hop);
            if length > way {
                continue;
            }
            if hop.sensor.is_some() {
                open.push((hop.to, length));
            } else {
                nearest = Some(nearest.map_or(length, |other| other.min(length)));
            }
        }
    }
    nearest
}

/// The way that a train on a circuit is to take from a node: its lead first, then the lap round and round; nothing if the
/// node is not on it.
pub(super) fn way_from(layout: &Layout, circuit: &Circuit, node: NodeId) -> impl Iterator<Item = HopId> {
    let all = circuit.lead.len() + circuit.lap.len();
    let starts = |id: &HopId| layout.hop(*id).is_some_and(|hop| hop.from == node);
    let at = circuit.hops().take(all).position(|id| starts(&id));
    let steps = at.map_or(0, |_| all);
    circuit.hops().skip(at.unwrap_or(0)).take(steps)
}

/// How the turnouts ahead of a node have to lie for a train to stay on its circuit, nearest first, each for its next
/// passage.
pub(super) fn wanted_legs(
    layout: &Layout,
    circuit: &Circuit,
    node: NodeId,
) -> alloc::vec::Vec<(TurnoutId, Leg)> {
    let mut wanted: alloc::vec::Vec<(TurnoutId, Leg)> = alloc::vec::Vec::new();
    for hop in way_from(layout, circuit, node).filter_map(|id| layout.hop(id)) {
        for need in hop.needs {
            if wanted.iter().all(|(turnout, _)| *turnout != need.turnout) {
                wanted.push((need.turnout, need.leg));
            }
        }
    }
    wanted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    fn node(layout: &Layout, name: &str) -> NodeId {
        layout.node_named(name).unwrap()
    }

    #[test]
    fn turnouts_are_near_ahead_and_under_the_train() {
        let layout = oval();
        let mm = Length::from_mm;
        let held = |name, ahead, behind| {
            let held =
                held_turnouts(&layout, &TurnoutStates::unknown(), node(&layout, name), mm(ahead), mm(behind));
            held.into_keys().map(|turnout| turnout.0).collect::<vec::Vec<_>>()
        };
        assert_eq!(held("A1", 99.0, 0.0), [0_u16; 0]);
        assert_eq!(held("A1", 100.0, 0.0), [1]);
        assert_eq!(held("B1", 200.0, 199.0), [2]);
        assert_eq!(held("B1", 199.0, 220.0), [1]);
    }

    #[test]
    fn a_track_end_is_seen_behind_a_contact_and_none_on_a_circuit() {
        let layout = oval();
        let end = |name, mm| {
            end_within(&layout, &TurnoutStates::unknown(), node(&layout, name), Length::from_mm(mm))
        };
        assert_eq!(end("EN1", 100.0).map(|end| libm::round(end.as_mm())), Some(70.0));
        assert_eq!(end("EN1", 69.0), None);
        assert_eq!(end("A1", 3_000.0), None);
    }

    #[test]
    fn the_way_of_a_circuit_goes_round_from_any_of_its_nodes() {
        let layout = oval();
        let circuit = layout.circuit_from(node(&layout, "A1"), &BTreeMap::new(), &[]).unwrap();
        let names = |from| {
            let hops = way_from(&layout, &circuit, node(&layout, from)).filter_map(|id| layout.hop(id));
            hops.map(|hop| layout.node_name(hop.to)).collect::<vec::Vec<_>>()
        };
        assert_eq!(names("B1"), ["D1", "A1", "B1"]);
        assert!(names("C1").is_empty());
        let wanted = wanted_legs(&layout, &circuit, node(&layout, "B1"));
        assert_eq!(wanted, [(TurnoutId(2), Leg::Straight), (TurnoutId(1), Leg::Straight)]);
    }
}
