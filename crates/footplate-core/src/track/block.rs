//! Blocks: sections of track with an occupancy detector, and the boundaries at which trains enter and leave them.
//!
//! A detector reports one state, occupied or free, whichever end a train comes from. So every boundary has a sensor for each
//! direction of travel that leads into a block, its *entry*: the place where the front of a train makes the block occupied.
//! Entries have numbers of their own, above all numbers of the layout file. [`Layout::input`] returns the number that the
//! station reports, and `control::BlockEntries` decides which entry a report means.

use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId, SensorId, StretchId};
use crate::track::{Layout, LayoutError, MAX_NAME_CHARACTERS, NodeKind, Place, PlannedBlock};

/// A section of track with an occupancy detector.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Its name.
    pub name: String,
    /// The number under which the station reports it.
    pub detector: SensorId,
    /// The sensors of the boundaries at which trains enter it.
    pub entries: Vec<SensorId>,
    /// Its rails.
    pub stretches: Vec<StretchId>,
}

impl Layout {
    /// The blocks, in the order of the plan.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The block that a detector reports.
    pub fn block_of_detector(&self, detector: SensorId) -> Option<&Block> {
        self.blocks.iter().find(|block| block.detector == detector)
    }

    /// The block that a train enters at a sensor; `None` for any other sensor.
    pub fn block_of_entry(&self, entry: SensorId) -> Option<&Block> {
        self.blocks.get(*self.entered.get(&entry)?)
    }

    /// The block of an edge; `None` where no detector is.
    pub fn block_of_edge(&self, edge: EdgeId) -> Option<&Block> {
        self.blocks.iter().find(|block| block.stretches.contains(&edge.stretch()))
    }

    /// The block that a train leaves at a node, running in its direction.
    pub fn block_left_at(&self, node: NodeId) -> Option<&Block> {
        self.block_of_entry(self.sensor_at(node.reverse())?)
    }

    /// Checks the blocks of a plan, and finds their entries and rails.
    pub(super) fn with_blocks(
        mut self,
        plan: &[PlannedBlock],
        places: &[Place],
    ) -> Result<Self, LayoutError> {
        for (number, PlannedBlock { name, detector }) in plan.iter().enumerate() {
            let is_name = (1..=MAX_NAME_CHARACTERS).contains(&name.chars().count())
                && !name.chars().any(char::is_control)
                && name.trim() == name;
            if !is_name {
                return Err(LayoutError::IllegalBlockName { block: number, name: name.clone() });
            }
            if self.blocks.iter().any(|known| known.name == *name) {
                return Err(LayoutError::DuplicateBlock { block: number, name: name.clone() });
            }
            let of_sensor = self.sensor_node(*detector).map(|node| self.node_name(node));
            let taken = of_sensor.or(self.block_of_detector(*detector).map(|block| block.name.as_str()));
            if let Some(first) = taken {
                let (detector, first) = (*detector, String::from(first));
                return Err(LayoutError::DetectorTaken { block: number, detector, first });
            }
            let (entries, stretches) = (Vec::new(), Vec::new());
            self.blocks.push(Block { name: name.clone(), detector: *detector, entries, stretches });
        }
        for (place, entry) in places.iter().enumerate() {
            let Place::Boundary { enters, .. } = entry else { continue };
            let first = NodeId::first_of(place);
            for (node, name) in [first, first.reverse()].into_iter().zip(enters) {
                let (Some(name), Some(sensor)) = (name, self.sensor_at(node)) else { continue };
                let found = self.blocks.iter().position(|block| block.name == *name);
                let Some(block) = found else {
                    return Err(LayoutError::UnknownBlock { place, name: name.clone() });
                };
                self.entered.insert(sensor, block);
                if let Some(block) = self.blocks.get_mut(block) {
                    block.entries.push(sensor);
                }
            }
        }
        for block in 0..self.blocks.len() {
            self.find_rails(block)?;
        }
        Ok(self)
    }

    /// Finds the rails between the boundaries of a block, over both legs of its turnouts.
    fn find_rails(&mut self, number: usize) -> Result<(), LayoutError> {
        let Some(Block { name, entries, .. }) = self.blocks.get(number) else { return Ok(()) };
        let mut open: Vec<NodeId> = entries.iter().filter_map(|entry| self.sensor_node(*entry)).collect();
        if open.is_empty() {
            return Err(LayoutError::BlockWithoutBoundary { block: number, name: name.clone() });
        }
        let mut stretches: Vec<StretchId> = vec![];
        while let Some(node) = open.pop() {
            for id in self.outgoing(node).edges() {
                let Some(edge) = self.edge(id).filter(|_| !stretches.contains(&id.stretch())) else {
                    continue;
                };
                if let Some(first) = self.block_of_edge(id) {
                    let (stretch, first) = (usize::from(id.stretch().0), first.name.clone());
                    return Err(LayoutError::BlocksOverlap { stretch, first, second: name.clone() });
                }
                stretches.push(id.stretch());
                let back = edge.to.reverse();
                if self.is_boundary(edge.to) {
                    let entered = self.sensor_at(back).and_then(|entry| self.block_of_entry(entry));
                    if entered.is_none_or(|entered| entered.name != *name) {
                        let other = self.node_name(back).into();
                        let entered = entered.map(|entered| entered.name.clone());
                        let block = name.clone();
                        return Err(LayoutError::BoundaryMissing {
                            place: back.pair(),
                            node: other,
                            block,
                            entered,
                        });
                    }
                } else {
                    open.extend([edge.to, back]);
                }
            }
        }
        if let Some(block) = self.blocks.get_mut(number) {
            block.stretches = stretches;
        }
        Ok(())
    }

    /// Whether a node is at the boundary of a block.
    pub fn is_boundary(&self, node: NodeId) -> bool {
        let enters = |node| self.sensor_at(node).is_some_and(|sensor| self.entered.contains_key(&sensor));
        enters(node)
            || enters(node.reverse())
            || self.node(node).is_some_and(|node| node.kind == NodeKind::Boundary)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TurnoutId;
    use crate::track::example::{oval_of_blocks, oval_of_blocks_plan};
    use crate::track::{Leg, PlanEntry, TurnoutStates};
    use std::string::ToString;

    #[test]
    fn a_block_has_entries_from_both_sides_and_the_rails_between() {
        let layout = oval_of_blocks();
        let block = |name: &str| layout.blocks().iter().find(|block| block.name == name).unwrap();
        let names = |block: &Block| -> Vec<&str> {
            block.entries.iter().map(|entry| layout.sensor_name(*entry)).collect()
        };
        assert_eq!(names(block("station")), ["S1", "S4", "S6"], "its turnout is inside");
        assert_eq!(block("station").stretches.len(), 3);
        assert_eq!(names(block("main")), ["S3", "S8"]);
        let entry = layout.sensor_named("S3").unwrap();
        assert_eq!(layout.input(entry), SensorId(2));
        assert_eq!(layout.block_of_entry(entry).unwrap().name, "main");
        assert_eq!(layout.block_left_at(layout.node_named("S3").unwrap()).unwrap().name, "station");
        assert_eq!(layout.sensor_name(SensorId(2)), "main", "a detector has the name of its block");
        assert_eq!(layout.sensor_named("S5").map(|entry| layout.input(entry)), Some(SensorId(3)));
    }

    #[test]
    fn hops_lead_from_boundary_to_boundary_and_past_those_into_track_without_a_detector() {
        let layout = oval_of_blocks();
        let turnouts: TurnoutStates = [(TurnoutId(1), Leg::Curved)].into_iter().collect();
        let from = |name| {
            let node = layout.node_named(name).unwrap();
            let hops = layout.open_hops_from(node, &turnouts);
            hops.map(|hop| (layout.node_name(hop.to), hop.length.as_mm().round())).collect::<Vec<_>>()
        };
        assert_eq!(from("S1"), [("S5", 500.0)]);
        assert_eq!(from("S5"), [("S1", 1_400.0)], "nothing reports that the siding is left");
        assert_eq!(from("S2"), [("S8", 300.0), ("S10", 1_100.0)]);
    }

    #[test]
    fn a_plan_with_a_wrong_block_is_refused_with_its_entry() {
        let refusal = |change: &dyn Fn(&mut crate::track::LayoutPlan)| {
            let mut plan = oval_of_blocks_plan();
            change(&mut plan);
            let error = Layout::build(&plan).unwrap_err();
            (error.entry(), error.to_string())
        };
        assert_eq!(
            refusal(&|plan| plan.blocks[1].name = "station".into()),
            (
                PlanEntry::Block(1),
                "there is a block `station` already; every block needs its own name".into()
            )
        );
        assert_eq!(
            refusal(&|plan| plan.blocks[1].detector = SensorId(1)),
            (
                PlanEntry::Block(1),
                "detector 1 belongs to `station` already; give the number that this block reports".into()
            )
        );
        assert_eq!(
            refusal(&|plan| plan.blocks.push(PlannedBlock { name: "yard".into(), detector: SensorId(9) })),
            (
                PlanEntry::Block(3),
                "no boundary leads into block `yard`: name it in `enters` of its boundaries".into()
            )
        );
        let set = |plan: &mut crate::track::LayoutPlan, place: usize, at: usize, name: Option<&str>| {
            if let Place::Boundary { enters, .. } = &mut plan.places[place] {
                enters[at] = name.map(Into::into);
            }
        };
        assert_eq!(
            refusal(&|plan| set(plan, 1, 0, Some("yard"))),
            (
                PlanEntry::Place(1),
                "no block is called `yard`: add `{ name = \"yard\", number = .. }` to `blocks`".into()
            )
        );
        assert_eq!(
            refusal(&|plan| set(plan, 1, 1, None)),
            (
                PlanEntry::Place(1),
                "the rails at `S4` belong to block `station`, but trains enter no block there: write `station` in \
                 `enters`, or put a boundary between"
                    .into()
            )
        );
    }
}
