//! Paths over the rails: consecutive edges with distances from the start, and the edges that a train came over.

use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId};
use crate::track::{Layout, Leg, NodeKind, OutgoingEdges, Position, TurnoutNeed, TurnoutStates};
use crate::units::Length;

use super::reservation::Reservation;

/// The most edges of a path: several laps of any layout in use.
const MAX_EDGES: usize = 1_000;

/// Edges in the order of travel.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Path {
    /// Each edge with the distance of its start.
    edges: Vec<(EdgeId, Length)>,
    length: Length,
}

impl Path {
    /// Appends an edge.
    pub(super) fn push(&mut self, layout: &Layout, id: EdgeId) {
        let Some(edge) = layout.edge(id) else { return };
        self.edges.push((id, self.length));
        self.length += edge.length;
    }

    /// Drops everything after the last occurrence of an edge.
    pub(super) fn cut_after(&mut self, edge: EdgeId) {
        while self.edges.len() > 1 && self.edges.last().is_some_and(|(last, _)| *last != edge) {
            if let Some((_, begins)) = self.edges.pop() {
                self.length = begins;
            }
        }
    }

    pub(super) const fn length(&self) -> Length {
        self.length
    }

    pub(super) fn edges(&self) -> impl DoubleEndedIterator<Item = EdgeId> {
        self.edges.iter().map(|(id, _)| *id)
    }

    /// The track behind and ahead of a place: the edges that the train came over, and otherwise those for the present
    /// turnout positions; shorter if the track ends. Returns the path and the distance of the place on it.
    pub(super) fn around(
        layout: &Layout,
        turnouts: &TurnoutStates,
        place: Position,
        occupied: &OccupiedPath,
        behind: Length,
        ahead: Length,
    ) -> (Self, Length) {
        let mut before = Vec::new();
        let mut left = behind - place.offset;
        let mut edge = place.edge;
        let mut occupied = occupied.before(place.edge);
        while left > Length::ZERO && before.len() < MAX_EDGES {
            let in_position = |edge: EdgeId| Some(next_edge(layout, turnouts, edge.twin())?.twin());
            let Some(next) = occupied.next().or_else(|| in_position(edge)) else { break };
            edge = next;
            before.push(edge);
            left -= layout.edge(edge).map_or(Length::ZERO, |edge| edge.length);
        }
        let mut path = Self::default();
        before.into_iter().rev().for_each(|edge| path.push(layout, edge));
        let at = path.length + place.offset;
        path.push(layout, place.edge);
        path.reach(layout, turnouts, at + ahead);
        (path, at)
    }

    /// Extends the path over the turnouts as set, to a length or the end of the track. Turnouts of unknown position
    /// count as straight.
    pub(super) fn reach(&mut self, layout: &Layout, turnouts: &TurnoutStates, length: Length) {
        while self.length <= length && self.edges.len() < MAX_EDGES {
            let Some(next) = self.edges.last().and_then(|(last, _)| next_edge(layout, turnouts, *last))
            else {
                break;
            };
            self.push(layout, next);
        }
    }

    /// The distance of a place, the first one from a point on; a centimetre before still counts.
    pub(super) fn find(&self, place: Position, from: Length) -> Option<Length> {
        let slack = Length::from_mm(10.0);
        let at = |(id, begins): &(EdgeId, Length)| (*id == place.edge).then_some(*begins + place.offset);
        self.edges.iter().filter_map(at).find(|at| *at >= from - slack)
    }

    /// The distance of a node, the first one from a point on.
    pub(super) fn find_node(&self, layout: &Layout, node: NodeId, from: Length) -> Option<Length> {
        let at = |(id, begins): &(EdgeId, Length)| {
            let edge = layout.edge(*id)?;
            if edge.from == node {
                return Some(*begins);
            }
            (edge.to == node).then_some(*begins + edge.length)
        };
        self.edges.iter().filter_map(at).find(|at| *at >= from)
    }

    /// The place at a distance.
    pub(super) fn place(&self, at: Length) -> Option<Position> {
        let found = self.edges.iter().rev().find(|(_, begins)| *begins <= at).or(self.edges.first())?;
        Some(Position { edge: found.0, offset: (at - found.1).max(Length::ZERO) })
    }

    /// The edges that an interval touches, each with the interval on it.
    fn within(
        &self,
        layout: &Layout,
        from: Length,
        to: Length,
    ) -> impl Iterator<Item = (EdgeId, [Length; 2])> {
        self.edges.iter().filter_map(move |(id, begins)| {
            let length = layout.edge(*id)?.length;
            let (from, to) = ((from - *begins).max(Length::ZERO), (to - *begins).min(length));
            (from <= to && to >= Length::ZERO).then_some((*id, [from, to]))
        })
    }

    /// The reservation for an interval of the path.
    pub(super) fn reservation(&self, layout: &Layout, from: Length, to: Length) -> Reservation {
        let mut taken = Reservation::empty();
        for (id, [from, to]) in self.within(layout, from, to) {
            taken.take(layout, id, from, to);
        }
        taken
    }

    /// The turnouts trailed on an interval of the path, with the legs that they are trailed from.
    pub(super) fn trailed(
        &self,
        layout: &Layout,
        from: Length,
        to: Length,
    ) -> impl Iterator<Item = TurnoutNeed> {
        self.within(layout, from, to).flat_map(move |(id, [_, to])| {
            let passes_toe = layout.edge(id).is_some_and(|edge| to >= edge.length);
            layout.needs_of(id).filter(move |need| passes_toe && !need.facing)
        })
    }

    /// The turnouts whose toes an interval of the path passes, with the legs that they need, each once, in order.
    pub(super) fn needs(&self, layout: &Layout, from: Length, to: Length) -> Vec<TurnoutNeed> {
        let mut needs: Vec<TurnoutNeed> = Vec::new();
        for (id, [from, to]) in self.within(layout, from, to) {
            let length = layout.edge(id).map_or(Length::ZERO, |edge| edge.length);
            for need in layout.needs_of(id) {
                let passes_toe = if need.facing { from <= Length::ZERO } else { to >= length };
                if passes_toe && !needs.iter().any(|known| known.turnout == need.turnout) {
                    needs.push(need);
                }
            }
        }
        needs
    }
}

/// The edge that follows an edge with the present turnout positions.
fn next_edge(layout: &Layout, turnouts: &TurnoutStates, edge: EdgeId) -> Option<EdgeId> {
    edge_from(layout, turnouts, layout.edge(edge)?.to)
}

/// The edge ahead of a node with the present turnout positions; straight for unknown ones.
pub(super) fn edge_from(layout: &Layout, turnouts: &TurnoutStates, node: NodeId) -> Option<EdgeId> {
    let node = layout.node(node)?;
    match (node.outgoing, node.kind) {
        (OutgoingEdges::Ahead(next), _) => Some(next),
        (OutgoingEdges::Legs { curved, .. }, NodeKind::Branch(turnout))
            if turnouts.get(turnout) == Some(Leg::Curved) =>
        {
            Some(curved)
        }
        (OutgoingEdges::Legs { straight, .. }, _) => Some(straight),
        (OutgoingEdges::Ended, _) => None,
    }
}

/// No train occupies more edges, or runs over more between two calls.
const MAX_OCCUPIED: usize = 16;

/// The edges that a train came over, whatever the turnout positions since, in the order of travel; the leading end of
/// the pickup is on the last one.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct OccupiedPath {
    edges: Vec<EdgeId>,
}

impl OccupiedPath {
    /// Records the present place of the leading end of the pickup: ahead, reversed, or elsewhere.
    pub(super) fn record(&mut self, layout: &Layout, place: Position) {
        let Some(last) = self.edges.last().copied() else {
            self.edges.push(place.edge);
            return;
        };
        if last == place.edge {
            return;
        }
        // A train that has run round a loop comes back over the edges on which it came, and has not reversed.
        let runs_on = layout
            .edge(last)
            .is_some_and(|known| layout.outgoing(known.to).edges().any(|next| next == place.edge));
        let reversed = self.edges.iter().rposition(|edge| edge.twin() == place.edge);
        if let Some(reversed) = reversed.filter(|_| !runs_on) {
            let behind = self.edges.iter().skip(reversed).rev().map(|edge| edge.twin());
            self.edges = behind.collect();
            return;
        }
        match fewest_edges(layout, last, place.edge) {
            Some(path) => self.edges.extend(path),
            None => self.edges = alloc::vec![place.edge],
        }
        let spare = self.edges.len().saturating_sub(MAX_OCCUPIED);
        self.edges.drain(..spare);
    }

    /// The edges before the one that the train is on, the latest first; none if it is not on that edge.
    pub(super) fn before(&self, edge: EdgeId) -> impl Iterator<Item = EdgeId> {
        let is_there = self.edges.last() == Some(&edge);
        self.edges.iter().rev().skip(1).filter(move |_| is_there).copied()
    }
}

/// The path with the fewest edges from one edge to another over any legs, without the first edge.
fn fewest_edges(layout: &Layout, from: EdgeId, to: EdgeId) -> Option<Vec<EdgeId>> {
    let mut open = alloc::vec![alloc::vec![from]];
    for _ in 0..MAX_OCCUPIED {
        let mut longer = Vec::new();
        for path in open {
            let node = layout.edge(*path.last()?)?.to;
            for next in layout.outgoing(node).edges() {
                let path: Vec<EdgeId> = path.iter().copied().chain([next]).collect();
                if next == to {
                    return Some(path.into_iter().skip(1).collect());
                }
                longer.push(path);
            }
        }
        open = longer;
    }
    None
}
