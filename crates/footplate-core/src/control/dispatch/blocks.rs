//! Blocks, as block systems have them: the track between sensors is reserved as a whole, with all its turnouts.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId, StretchId};
use crate::track::Layout;
use crate::units::Length;

use super::reservation::Reservation;

/// A reservation of less of a block than this does not take the block.
const TOUCHES: Length = Length::from_mm(1.0);

/// The blocks of a layout.
#[derive(Debug, Clone)]
pub(super) struct Blocks {
    of: BTreeMap<StretchId, usize>,
    whole: Vec<Reservation>,
}

impl Blocks {
    pub(super) fn of(layout: &Layout) -> Self {
        let mut blocks = Self { of: BTreeMap::new(), whole: Vec::new() };
        for (id, _) in layout.edges() {
            if !blocks.of.contains_key(&id.stretch()) {
                blocks.add(layout, id);
            }
        }
        blocks
    }

    /// Adds the block of an edge: all rails that can be reached without passing a sensor.
    fn add(&mut self, layout: &Layout, first: EdgeId) {
        let mut whole = Reservation::empty();
        let mut open = alloc::vec![first];
        while let Some(id) = open.pop() {
            let Some(edge) = layout.edge(id) else { continue };
            if self.of.insert(id.stretch(), self.whole.len()).is_some() {
                continue;
            }
            whole.take(layout, id, Length::ZERO, edge.length);
            let is_sensor = |node: NodeId| {
                [node, node.reverse()].into_iter().any(|node| layout.sensor_at(node).is_some())
            };
            for node in [edge.from, edge.to].into_iter().filter(|node| !is_sensor(*node)) {
                let edges = [node, node.reverse()].into_iter().flat_map(|node| layout.outgoing(node).edges());
                open.extend(edges.filter(|next| !self.of.contains_key(&next.stretch())));
            }
        }
        self.whole.push(whole);
    }

    /// The reservation extended to whole blocks.
    pub(super) fn around(&self, layout: &Layout, taken: &Reservation) -> Reservation {
        let mut around = taken.clone();
        for (stretch, span) in taken.spans() {
            let block = self.of.get(&stretch).and_then(|block| self.whole.get(*block));
            if let Some(block) = block.filter(|_| span.to - span.from >= TOUCHES) {
                around.add(layout, block);
            }
        }
        around
    }
}
