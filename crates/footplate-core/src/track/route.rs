//! Routes: the shortest path from one node to another in one direction of travel.

use alloc::borrow::ToOwned;
use alloc::collections::BinaryHeap;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::cmp::Ordering;
use core::fmt;

use crate::ids::{EdgeId, NodeId};
use crate::track::{Layout, TurnoutNeed, TurnoutStates};
use crate::units::Length;

/// A path from node to node without reversing.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// Where it begins.
    pub from: NodeId,
    /// Where it ends.
    pub to: NodeId,
    /// Its edges in the order of travel; none if it ends where it begins.
    pub edges: Vec<EdgeId>,
    /// The sum of its edges.
    pub length: Length,
    /// The turnouts on it in the order of travel, facing and trailing.
    pub needs: Vec<TurnoutNeed>,
}

/// Why there is no route.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum RouteError {
    /// A node of another layout.
    UnknownNode {
        /// The node.
        node: NodeId,
    },
    /// No path leads there without reversing.
    NoPath {
        /// The name of the node it should begin at.
        from: String,
        /// The name of the node it should end at.
        to: String,
        /// The name of the same place in the other direction of travel, if a path leads there.
        reverse: Option<String>,
    },
}

impl fmt::Display for RouteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownNode { node } => write!(f, "node {node} is not part of this layout"),
            Self::NoPath { from, to, reverse: Some(reverse) } => write!(
                f,
                "no path from `{from}` to `{to}` with the turnouts in their present positions, but \
                 there is one to `{reverse}`, the same place in the other direction"
            ),
            Self::NoPath { from, to, reverse: None } => write!(
                f,
                "no path from `{from}` to `{to}` with the turnouts in their present positions and \
                 without reversing"
            ),
        }
    }
}

impl core::error::Error for RouteError {}

impl Layout {
    /// The shortest path between two nodes over turnouts that are in position or unknown; [`TurnoutStates::unknown`]
    /// leaves all of them free. Among equally long paths the choice is deterministic. No path needs both turnouts of
    /// a pair curved.
    ///
    /// # Errors
    /// [`RouteError`] if a node is unknown or no path leads there.
    pub fn route(&self, from: NodeId, to: NodeId, turnouts: &TurnoutStates) -> Result<Route, RouteError> {
        if let Some(node) = [from, to].into_iter().find(|node| self.node(*node).is_none()) {
            return Err(RouteError::UnknownNode { node });
        }
        let Some((edges, length)) = self.shortest(from, to, turnouts) else {
            let name = |node| self.node_name(node).to_owned();
            let reverse = to.reverse();
            let reverse = self.shortest(from, reverse, turnouts).map(|_| name(reverse));
            return Err(RouteError::NoPath { from: name(from), to: name(to), reverse });
        };
        let needs = edges.iter().flat_map(|edge| self.needs_of(*edge)).collect();
        Ok(Route { from, to, edges, length, needs })
    }

    /// The edges of the shortest path and their total length (Dijkstra, 1959).
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
    use std::string::ToString;

    fn route(layout: &Layout, from: &str, to: &str, turnouts: &TurnoutStates) -> Result<Route, RouteError> {
        layout.route(layout.node_named(from).unwrap(), layout.node_named(to).unwrap(), turnouts)
    }

    #[test]
    fn a_free_route_takes_the_shorter_leg_and_says_which() {
        let layout = oval();
        let route = route(&layout, "A1", "D1", &TurnoutStates::unknown()).unwrap();
        // Over C: 100 + 220 + 150 + 100; over B it would be 600.
        assert!((route.length.as_mm() - 570.0).abs() < 1e-9);
        let need = |turnout, facing| TurnoutNeed { turnout: TurnoutId(turnout), leg: Leg::Curved, facing };
        assert_eq!(route.needs, [need(1, true), need(2, false)]);
        let names: Vec<_> =
            route.edges.iter().map(|id| layout.node_name(layout.edge(*id).unwrap().to)).collect();
        assert_eq!(names, ["BR1", "C1", "MR2", "D1"]);
    }

    #[test]
    fn a_turnout_in_another_position_makes_the_route_longer() {
        let layout = oval();
        let straight = [(TurnoutId(1), Leg::Straight)].into_iter().collect();
        assert!((route(&layout, "A1", "D1", &straight).unwrap().length.as_mm() - 600.0).abs() < 1e-9);
    }

    #[test]
    fn a_route_to_where_it_begins_is_empty() {
        let layout = oval();
        let route = route(&layout, "D2", "D2", &TurnoutStates::unknown()).unwrap();
        assert_eq!((route.edges.len(), route.needs.len(), route.length), (0, 0, Length::ZERO));
    }

    #[test]
    fn without_a_path_the_other_direction_is_named_if_it_helps() {
        let layout = oval();
        let unknown = TurnoutStates::unknown();
        assert_eq!(
            route(&layout, "EN1", "E2", &unknown).unwrap_err().to_string(),
            "no path from `EN1` to `E2` with the turnouts in their present positions, but there is one to `E1`, the same \
             place in the other direction"
        );
        assert_eq!(
            route(&layout, "EN1", "A1", &unknown).unwrap_err().to_string(),
            "no path from `EN1` to `A1` with the turnouts in their present positions and without reversing"
        );
        let error = layout.route(NodeId(0), NodeId(999), &unknown).unwrap_err();
        assert_eq!(error.to_string(), "node 999 is not part of this layout");
    }
}
