//! Everything a train did so far, and the model that explains it best.

use super::model::{MotionModel, StepUse};
use crate::calibration::SectionIndex;
use crate::event::Event;
use crate::ids::{SpeedStep, TrainId};
use crate::track::{Layout, TurnoutStates};

/// Collects what one train does and fits its [`MotionModel`] to all of it.
#[derive(Debug, Clone)]
pub struct MotionFit {
    model: MotionModel,
}

impl MotionFit {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(train: TrainId, highest: SpeedStep) -> Self {
        Self { model: MotionModel::unknown(train, highest) }
    }

    /// The next entry that is about this train: a command to it that has been sent, or a report that was judged to be
    /// of it. The turnouts as they lay at that time.
    pub fn take(&mut self, layout: &Layout, turnouts: &TurnoutStates, event: &Event) {
        let _ = (layout, turnouts, event);
    }

    /// The chain is broken: the train was lifted, pushed, stalled or lost. What it did before still counts.
    pub fn interrupt(&mut self) {}

    /// A step moved the train, or did not.
    pub fn note_use(&mut self, step: SpeedStep, found: StepUse) {
        self.model.note_use(step, found);
    }

    /// Fits anew to all that was seen. Takes milliseconds; not for between two reports.
    pub fn refit(&mut self, layout: &Layout, sections: &SectionIndex) {
        let _ = (layout, sections);
    }

    /// The model as of the last fit.
    #[must_use]
    pub const fn model(&self) -> &MotionModel {
        &self.model
    }
}
