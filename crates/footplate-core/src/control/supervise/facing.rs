//! The direction in which a train faces before and after it was moved by hand.

use alloc::collections::{BTreeSet, VecDeque};

use crate::ids::EdgeId;
use crate::track::Layout;

/// Whether a train that faced along one edge was turned, if it faces along another now: whether the shortest path between the two,
/// in either direction and without turning, leads to that edge in the opposite direction.
pub(super) fn was_turned(layout: &Layout, before: EdgeId, now: EdgeId) -> bool {
    let mut known = BTreeSet::new();
    let mut open = VecDeque::from([now]);
    while let Some(edge) = open.pop_front() {
        if edge == before || edge.twin() == before {
            return edge != before;
        }
        if known.insert(edge) {
            let next = |edge: EdgeId| layout.edge(edge).map(|edge| layout.outgoing(edge.to).edges());
            open.extend(next(edge).into_iter().flatten());
            open.extend(next(edge.twin()).into_iter().flatten().map(EdgeId::twin));
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    #[test]
    fn a_train_on_the_same_circuit_was_turned_if_it_faces_round_it_in_the_opposite_direction() {
        let layout = oval();
        let node = |name| layout.node_named(name).unwrap();
        let edge = |from, to| layout.edge_between(node(from), node(to)).unwrap();
        let (before, now) = (edge("A1", "BR1"), edge("MR2", "D1"));
        assert!(!was_turned(&layout, before, now));
        assert!(!was_turned(&layout, before, before));
        assert!(was_turned(&layout, before, now.twin()));
        assert!(was_turned(&layout, before.twin(), now));
        // On track that no path leads to, there is no telling.
        assert!(!was_turned(&layout, before, edge("EN1", "E1")));
    }
}
