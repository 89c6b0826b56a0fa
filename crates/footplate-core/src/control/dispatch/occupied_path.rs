//! The edges that a train came over: behind its pickup it is where it went, however points lie there by now.

use alloc::vec::Vec;

use crate::ids::EdgeId;
use crate::track::{Layout, Position};

/// More edges are under no train, nor between two looks at it.
const MOST_EDGES: usize = 16;

/// Edges in the order of travel; the leading end of the pickup is on the last one.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct OccupiedPath {
    edges: Vec<EdgeId>,
}

impl OccupiedPath {
    /// Takes note of where the leading end of the pickup is now: further on, on its way back, or somewhere else.
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

    /// The edges before the one that it is on, the latest first; none if it is not there.
    pub(super) fn before(&self, edge: EdgeId) -> impl Iterator<Item = EdgeId> {
        let is_there = self.edges.last() == Some(&edge);
        self.edges.iter().rev().skip(1).filter(move |_| is_there).copied()
    }
}

/// The shortest way from one edge on to another over any legs, without the first.
fn path(layout: &Layout, from: EdgeId, to: EdgeId) -> Option<Vec<EdgeId>> {
    let mut open = alloc::vec![alloc::vec![from]];
    for _ in 0..MOST_EDGES {
        let mut longer = Vec::new();
        for path in open {
            let node = layout.edge(*path.last()?)?.to;
            for next in layout.ways(node).edges() {
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
