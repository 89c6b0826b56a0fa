//! Where a train was when the block behind it became free.

use super::location::PathPoint;
use super::locator::Locator;
use super::track_context::TrackContext;
use crate::ids::SensorId;
use crate::link::DetectionWindow;
use crate::model::{BlockRelease, MotionModel};
use crate::track::Block;
use crate::units::Length;

/// The most boundaries that one train is over: more than the longest train has in short blocks.
const MOST_BOUNDARIES: usize = 6;

impl Locator {
    /// What the release of a block says of a train that is leaving it; `None` if the train did not come through this block,
    /// or is at rest.
    pub fn release_of(
        &self,
        context: TrackContext<'_>,
        model: &MotionModel,
        detector: SensorId,
        window: DetectionWindow,
    ) -> Option<BlockRelease> {
        let block = context.layout.block_of_detector(detector)?;
        let located = self.locate(context, model, window.middle()).filter(|located| !located.at_rest)?;
        let beyond = beyond_block(context, model, located.at, block)?;
        let is_ahead = beyond > Length::ZERO;
        is_ahead.then_some(BlockRelease {
            beyond: [beyond, located.uncertainty],
            speed: located.speed,
            window,
        })
    }
}

/// How far a point of a train's path is beyond the end of a block that the path came through; negative inside it.
fn beyond_block(
    context: TrackContext<'_>,
    model: &MotionModel,
    at: PathPoint,
    block: &Block,
) -> Option<Length> {
    let layout = context.layout;
    let entered = layout.sensor_at(at.node).and_then(|sensor| layout.block_of_entry(sensor));
    if entered == Some(block) {
        // Nothing reports that a train runs on where no detector is.
        let hop = context.hop_from(at.node)?;
        let inside = hop.edges.iter().take_while(|edge| block.stretches.contains(&edge.stretch()));
        let inside: Length = inside.filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length).sum();
        let [length, _] = model.length(context.sections, &hop);
        return Some(at.distance - length * (inside / hop.length));
    }
    let (mut node, mut beyond) = (at.node, at.distance);
    for _ in 0..MOST_BOUNDARIES {
        if layout.block_left_at(node) == Some(block) {
            return Some(beyond);
        }
        // Back over the hop that led here, as the rails lie.
        let back = context.hop_from(node.reverse())?;
        beyond += model.length(context.sections, &back)[0];
        node = back.to.reverse();
    }
    None
}
