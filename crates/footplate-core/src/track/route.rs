//! The shortest path from one node to another in one direction of travel.

use alloc::collections::BinaryHeap;
use alloc::vec;
use alloc::vec::Vec;
use core::cmp::Ordering;

use crate::ids::{EdgeId, NodeId};
use crate::track::{Layout, TurnoutNeed, TurnoutStates};
use crate::units::Length;

impl Layout {
    /// The edges of the shortest path between two nodes and their total length (Dijkstra, 1959), over turnouts that are in
    /// position or unknown. Among equally long paths the choice is deterministic. No path needs both turnouts of a pair curved.
    pub(crate) fn shortest(
        &self,
        from: NodeId,
        to: NodeId,
        turnouts: &TurnoutStates,
    ) -> Option<(Vec<EdgeId>, Length)> {
        let mut arrivals = Arrivals { by_node: vec![None; self.nodes().len()] };
        let mut open = BinaryHeap::from([Open { length: Length::ZERO, node: from, over: None }]);
        while let Some(Open { length, node, over }) = open.pop() {
            if !arrivals.settle(node, over) {
                continue;
            }
            if node == to {
                return Some((arrivals.path_to(self, node), length));
            }
            for id in self.outgoing(node).edges() {
                let Some(edge) = self.edge(id) else { continue };
                let is_open = self.needs_of(id).all(|need| turnouts.allow(need));
                if is_open && (edge.leg.is_none() || self.is_legal_after(&arrivals, node, id)) {
                    open.push(Open { length: length + edge.length, node: edge.to, over: Some(id) });
                }
            }
        }
        None
    }

    /// Whether the path to `node` and the edge after it do not need both turnouts of a pair curved.
    fn is_legal_after(&self, arrivals: &Arrivals, node: NodeId, edge: EdgeId) -> bool {
        if self.never_both_curved().is_empty() {
            return true;
        }
        let mut path = arrivals.path_to(self, node);
        path.push(edge);
        let needs: Vec<TurnoutNeed> = path.into_iter().flat_map(|edge| self.needs_of(edge)).collect();
        !self.needs_both_curved(&needs)
    }
}

/// The last edge of the shortest path to each node.
struct Arrivals {
    /// `Some(None)` is the start of the path.
    by_node: Vec<Option<Option<EdgeId>>>,
}

impl Arrivals {
    /// Records the first arrival at a node; later ones are not shorter.
    fn settle(&mut self, node: NodeId, over: Option<EdgeId>) -> bool {
        match self.by_node.get_mut(usize::from(node.0)) {
            Some(arrival @ None) => {
                *arrival = Some(over);
                true
            }
            _ => false,
        }
    }

    fn path_to(&self, layout: &Layout, node: NodeId) -> Vec<EdgeId> {
        let mut edges = Vec::new();
        let mut node = node;
        while let Some(Some(Some(id))) = self.by_node.get(usize::from(node.0)) {
            let Some(edge) = layout.edge(*id) else { break };
            edges.push(*id);
            node = edge.from;
        }
        edges.reverse();
        edges
    }
}

/// A node that can be reached, and how.
#[derive(PartialEq)]
struct Open {
    length: Length,
    node: NodeId,
    over: Option<EdgeId>,
}

impl Eq for Open {}

impl Ord for Open {
    /// The heap gives its greatest first: the nearest, and of equally near ones the lowest number.
    fn cmp(&self, other: &Self) -> Ordering {
        let nearer = other.length.as_m().total_cmp(&self.length.as_m());
        nearer.then(other.node.cmp(&self.node)).then(other.over.cmp(&self.over))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TurnoutId;
    use crate::track::Leg;
    use crate::track::example::oval;
    use std::borrow::ToOwned;
    use std::string::String;

    /// The nodes behind the first, and the length in mm.
    fn path(from: &str, to: &str, turnouts: &TurnoutStates) -> Option<(String, f64)> {
        let layout = oval();
        let node = |name| layout.node_named(name).unwrap();
        let (edges, length) = layout.shortest(node(from), node(to), turnouts)?;
        let names: Vec<&str> =
            edges.iter().map(|id| layout.node_name(layout.edge(*id).unwrap().to)).collect();
        Some((names.join(" "), length.as_mm().round()))
    }

    #[test]
    fn a_free_path_takes_the_shorter_leg() {
        // Over C: 100 + 220 + 150 + 100; over B it would be 600.
        assert_eq!(path("A1", "D1", &TurnoutStates::unknown()), Some(("BR1 C1 MR2 D1".to_owned(), 570.0)));
        let straight = [(TurnoutId(1), Leg::Straight)].into_iter().collect();
        assert_eq!(path("A1", "D1", &straight).unwrap().1, 600.0);
    }

    #[test]
    fn a_path_to_where_it_begins_is_empty_and_none_turns_back() {
        let unknown = TurnoutStates::unknown();
        assert_eq!(path("D2", "D2", &unknown), Some((String::new(), 0.0)));
        assert_eq!(path("EN1", "E2", &unknown), None);
    }
}
