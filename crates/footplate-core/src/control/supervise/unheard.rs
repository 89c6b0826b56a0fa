//! Where a train that is not heard may be: how far it can have run since its last detection, by its commands, and what is behind it.

use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, NodeKind, Position};
use crate::units::Length;

/// The distance that a train has run since its last detection, by its commands, whatever was heard of it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Unheard {
    pub(super) run: Length,
    /// The step of its last command, and when that was sent.
    pub(super) step: SpeedStep,
    pub(super) since: Timestamp,
    /// The fastest step before that, of those that it had shortly before.
    pub(super) before: SpeedStep,
}

impl Unheard {
    /// The same at a later time.
    pub(super) fn after(self, now: Timestamp, model: &MotionModel) -> Self {
        if self.step == SpeedStep::STAND {
            return self;
        }
        let speed = model.steady_speed(self.step, Approach::Below);
        let span = (now - self.since).max(TimeSpan::ZERO);
        Self { run: self.run + speed * span, since: now.max(self.since), ..self }
    }
}

/// What is behind a train.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Behind {
    /// The sensor that reported it last; `None` if it was placed since.
    pub(super) sensor: Option<NodeId>,
    /// Whether the rear of a train that has just reached the sensor is on points that it pushed over.
    pub(super) trails_otherwise: bool,
    /// Whether an operator has placed the train since, where it may still be on these points.
    pub(super) was_placed: bool,
}

/// Whether points that a train trails before a place are within a distance behind it.
pub(super) fn has_points_behind(layout: &Layout, place: Position, within: Length) -> bool {
    let Some(back) = layout.reversed(place) else { return false };
    let (mut edge, mut left) = (back.edge, within + back.offset);
    while let Some(known) = layout.edge(edge).filter(|known| left >= known.length) {
        left -= known.length;
        if layout.node(known.to).is_some_and(|node| matches!(node.kind, NodeKind::Branch(_))) {
            return true;
        }
        let Some(next) = layout.outgoing(known.to).edges().next() else { return false };
        edge = next;
    }
    false
}
