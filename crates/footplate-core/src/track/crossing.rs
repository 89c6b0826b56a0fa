//! Level crossings: two tracks that cross in one plane and are not connected.
//!
//! A train has no choice there, so the graph has no node. But only one train at a time can use a crossing: the dispatcher asks
//! [`Layout::crossed_near`] which other track an interval of rail obstructs.

use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId};
use crate::track::{Layout, Position};
use crate::units::Length;

/// A level crossing, by its place on both tracks; the edges are the first ones of their stretches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The place on each track.
    pub tracks: [Position; 2],
}

impl Layout {
    /// The level crossings, in the order of the layout file.
    pub fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// Lets two tracks cross. Returns `None` if one of the places is not on this layout.
    #[must_use]
    pub fn with_crossing(mut self, tracks: [Position; 2]) -> Option<Self> {
        let [one, other] = tracks.map(|at| {
            let length = self.edge(at.edge)?.length;
            let is_on_edge = at.offset >= Length::ZERO && at.offset <= length;
            let first = if at.edge < at.edge.twin() { Some(at) } else { self.reversed(at) };
            first.filter(|_| is_on_edge)
        });
        self.crossings.push(Crossing { tracks: [one?, other?] });
        Some(self)
    }

    /// The crossings of an edge: how far from its start, and the place on the other track.
    pub fn crossings_of(&self, edge: EdgeId) -> impl Iterator<Item = (Length, Position)> {
        let length = self.edge(edge).map_or(Length::ZERO, |edge| edge.length);
        let both = self
            .crossings
            .iter()
            .flat_map(|Crossing { tracks: [one, other] }| [(*one, *other), (*other, *one)]);
        both.filter(move |(own, _)| own.edge.stretch() == edge.stretch())
            .map(move |(own, other)| (if own.edge == edge { own.offset } else { length - own.offset }, other))
    }

    /// Where other tracks cross an interval of an edge, or the track up to a distance beyond the interval's ends.
    pub fn crossed_near(&self, edge: EdgeId, from: Length, to: Length, within: Length) -> Vec<Position> {
        let mut found = Vec::new();
        let Some(known) = self.edge(edge).filter(|_| !self.crossings.is_empty()) else { return found };
        let is_near = |at: Length| from - within < at && at < to + within;
        found.extend(self.crossings_of(edge).filter(|(at, _)| is_near(*at)).map(|(_, other)| other));
        self.crossed_beyond(known.to, to + within - known.length, &mut found);
        self.crossed_beyond(known.from.reverse(), within - from, &mut found);
        found
    }

    /// Adds where other tracks cross the first `left` of the rails beyond a node.
    fn crossed_beyond(&self, node: NodeId, left: Length, found: &mut Vec<Position>) {
        if left <= Length::ZERO {
            return;
        }
        for edge in self.outgoing(node).edges() {
            let Some(known) = self.edge(edge) else { continue };
            found.extend(self.crossings_of(edge).filter(|(at, _)| *at < left).map(|(_, other)| other));
            self.crossed_beyond(known.to, left - known.length, found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    /// The oval, whose 500 mm from D1 to A1 cross the 40 mm from E1 to EX2: 120 mm behind D1, 10 mm behind E1.
    fn crossed() -> (Layout, [EdgeId; 2]) {
        let layout = oval();
        let node = |name: &str| layout.node_named(name).unwrap();
        let edges = [("D1", "A1"), ("E1", "EX2")]
            .map(|(from, to)| layout.edge_between(node(from), node(to)).unwrap());
        let at = |edge, mm| Position { edge, offset: Length::from_mm(mm) };
        // Stated once from the other end.
        let crossing = [at(edges[0], 120.0), at(edges[1].twin(), 30.0)];
        (layout.clone().with_crossing(crossing).unwrap(), edges)
    }

    #[test]
    fn each_track_knows_where_the_other_one_crosses_it() {
        let (layout, [main, siding]) = crossed();
        let millimetres = |edge: EdgeId| -> Vec<(f64, EdgeId, f64)> {
            let crossings = layout.crossings_of(edge);
            crossings
                .map(|(at, other)| (at.as_mm().round(), other.edge, other.offset.as_mm().round()))
                .collect()
        };
        assert_eq!(millimetres(main), [(120.0, siding, 10.0)]);
        assert_eq!(millimetres(main.twin()), [(380.0, siding, 10.0)]);
        assert_eq!(millimetres(siding.twin()), [(30.0, main, 120.0)]);
        assert_eq!(millimetres(EdgeId(0)), []);
        let beyond = [main, siding].map(|edge| Position { edge, offset: Length::from_mm(60.0) });
        assert_eq!(layout.with_crossing(beyond), None, "the siding is 40 mm long there");
    }

    #[test]
    fn a_crossing_is_near_from_the_neighbouring_rails_too() {
        let (layout, [main, siding]) = crossed();
        let count = |edge, from, to, within| {
            let [from, to, within] = [from, to, within].map(Length::from_mm);
            layout.crossed_near(edge, from, to, within).len()
        };
        assert_eq!([count(main, 0.0, 50.0, 69.0), count(main, 0.0, 50.0, 71.0)], [0, 1]);
        assert_eq!([count(main, 200.0, 500.0, 79.0), count(main, 200.0, 500.0, 81.0)], [0, 1]);
        // From MR2 to D1 it is 100 mm.
        let before = layout.edge_between(layout.node_named("MR2").unwrap(), layout.node_named("D1").unwrap());
        assert_eq!([109.0, 131.0].map(|within| count(before.unwrap(), 0.0, 90.0, within)), [0, 1]);
        // Beyond the end of the track nothing follows.
        assert_eq!(count(siding, 35.0, 40.0, 5.0), 0);
    }
}
