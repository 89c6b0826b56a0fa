//! Where a train that is not heard may be: how far it can have run since its last detection, by its commands, and what is behind it.

use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
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
    /// The sensor that reported it last.
    pub(super) sensor: NodeId,
    /// Whether the rear of a train that has just reached the sensor is on points that it pushed over.
    pub(super) trails_otherwise: bool,
    /// Whether an operator has placed the train since, where it may still be on these points.
    pub(super) was_placed: bool,
}
