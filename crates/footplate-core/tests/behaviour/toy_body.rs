//! The edges under a toy train: over turnouts it is on the leg that it took, wherever they are set afterwards.

#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use footplate_core::track::{Layout, Position, TurnoutStates};
use footplate_core::{EdgeId, Length};

/// Edges in the direction of travel, from behind the train's rear to its front.
#[derive(Debug, Clone, Default)]
pub(crate) struct ToyBody {
    edges: Vec<EdgeId>,
}

impl ToyBody {
    /// Follows a train by the position of its pickup's leading end, which moves by less than an edge between two
    /// calls.
    pub(crate) fn follow(
        &mut self,
        layout: &Layout,
        turnouts: &TurnoutStates,
        at: Position,
        ahead: Length,
        behind: Length,
    ) {
        let back = layout.reversed(at).expect("on the layout");
        if !self.edges.contains(&at.edge) && self.edges.contains(&back.edge) {
            self.edges = self.edges.iter().rev().map(|edge| edge.twin()).collect();
        }
        if !self.edges.contains(&at.edge) {
            // The train was placed here.
            self.edges = vec![at.edge];
        }
        while self.reaches(layout, at) < ahead {
            let last = *self.edges.last().expect("never empty");
            let Some(next) = beyond(layout, turnouts, last) else { break };
            self.edges.push(next);
        }
        while self.reaches_back(layout, at) < behind {
            let first = self.edges.first().expect("never empty").twin();
            let Some(next) = beyond(layout, turnouts, first) else { break };
            self.edges.insert(0, next.twin());
        }
        while self.spare(layout, at, behind) {
            self.edges.remove(0);
        }
        while self.edges.len() > 1 && self.spare_ahead(layout, at, ahead) {
            self.edges.pop();
        }
    }

    /// The points of the body, a few centimetres apart.
    pub(crate) fn points(
        &self,
        layout: &Layout,
        at: Position,
        ahead: Length,
        behind: Length,
    ) -> Vec<Position> {
        let begins = self.begins(layout, at.edge) + at.offset;
        (0..=16)
            .map(|nth| f64::from(nth) / 16.0)
            .filter_map(|part| {
                let mut left = begins - behind + (ahead + behind) * part;
                for id in &self.edges {
                    let length = layout.edge(*id)?.length;
                    if left <= length {
                        return (left >= Length::ZERO).then_some(Position { edge: *id, offset: left });
                    }
                    left -= length;
                }
                None
            })
            .collect()
    }

    /// Where an edge begins, measured from the first.
    fn begins(&self, layout: &Layout, edge: EdgeId) -> Length {
        let before = self.edges.iter().take_while(|known| **known != edge);
        before.filter_map(|id| layout.edge(*id)).map(|edge| edge.length).sum()
    }

    fn whole(&self, layout: &Layout) -> Length {
        self.edges.iter().filter_map(|id| layout.edge(*id)).map(|edge| edge.length).sum()
    }

    fn reaches(&self, layout: &Layout, at: Position) -> Length {
        self.whole(layout) - self.begins(layout, at.edge) - at.offset
    }

    fn reaches_back(&self, layout: &Layout, at: Position) -> Length {
        self.begins(layout, at.edge) + at.offset
    }

    fn spare(&self, layout: &Layout, at: Position, behind: Length) -> bool {
        let first =
            self.edges.first().and_then(|id| layout.edge(*id)).map_or(Length::ZERO, |edge| edge.length);
        self.edges.first() != Some(&at.edge) && self.reaches_back(layout, at) - first > behind
    }

    fn spare_ahead(&self, layout: &Layout, at: Position, ahead: Length) -> bool {
        let last = self.edges.last().and_then(|id| layout.edge(*id)).map_or(Length::ZERO, |edge| edge.length);
        self.edges.last() != Some(&at.edge) && self.reaches(layout, at) - last > ahead
    }
}

/// The edge after an edge, with the turnouts as they are.
fn beyond(layout: &Layout, turnouts: &TurnoutStates, edge: EdgeId) -> Option<EdgeId> {
    let end = Position { edge, offset: layout.edge(edge)?.length };
    let next = layout.advance(end, Length::from_mm(0.01), turnouts).ok()?;
    (next.edge != edge).then_some(next.edge)
}
