//! How often a train changes its step, which decides whether its run is fitted.

use crate::ids::SpeedStep;

/// Runs with more step changes than this are not fitted. A train that holds a speed between two steps changes every
/// second; the cost of a fit is changes times detections, and such a run adds little information.
const MOST_STEP_CHANGES: usize = 16;

/// Counts the commanded steps of a train since its last standstill.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepChanges(usize);

impl StepChanges {
    /// Counts a command. Returns whether it is left out of the fit, because they are too many or this one ends too many.
    pub fn take(&mut self, step: SpeedStep) -> bool {
        let were_too_many = self.are_too_many();
        self.0 = if step == SpeedStep::STAND { 0 } else { self.0 + 1 };
        were_too_many || self.are_too_many()
    }

    /// Whether what the train does is left out.
    #[must_use]
    pub const fn are_too_many(self) -> bool {
        self.0 > MOST_STEP_CHANGES
    }
}
