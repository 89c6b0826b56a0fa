//! The edges that a train came over: behind its pickup it is on them, however the points lie there by now.

use alloc::vec::Vec;

use crate::ids::EdgeId;
use crate::track::{Layout, Position};

/// No train is on more edges, or runs over more between two looks at it.
const MOST_EDGES: usize = 16;

/// Edges in the order of travel; the leading end of the pickup is on the last one.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct OccupiedPath {
    edges: Vec<EdgeId>,
}

impl OccupiedPath {
    /// Records where the leading end of the pickup is now: further on, on the way back, or elsewhere.
    pub(super) fn follow(&mut self, layout: &Layout, place: Position) {
        let Some(last) = self.edges.last().copied() else {
            self.edges.push(place.edge);
            return;
        };
        if last == place.edge {
            return;
        }
        if let Some(turned) = self.edges.iter().rposition(|edge| edge.twin() == place.edge) {
            let behind = self.edges.iter().skip(turned).rev().map(|edge| edge.twin());
            self.edges = behind.collect();
            return;
        }
        match path(layout, last, place.edge) {
            Some(path) => self.edges.extend(path),
            None => self.edges = alloc::vec![place.edge],
        }
        let spare = self.edges.len().saturating_sub(MOST_EDGES);
        self.edges.drain(..spare);
    }

    /// The edges before the one that the train is on, the latest first; none if it is not on that edge.
    pub(super) fn before(&self, edge: EdgeId) -> impl Iterator<Item = EdgeId> {
        let is_there = self.edges.last() == Some(&edge);
        self.edges.iter().rev().skip(1).filter(move |_| is_there).copied()
    }
}

/// The path with the fewest edges from one edge to another over any legs, without the first edge.
fn path(layout: &Layout, from: EdgeId, to: EdgeId) -> Option<Vec<EdgeId>> {
    let mut open = alloc::vec![alloc::vec![from]];
    for _ in 0..MOST_EDGES {
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
