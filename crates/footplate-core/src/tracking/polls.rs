//! What a forecast knows of the polls that may report it.

use crate::link::{PollRhythm, PollTimingEstimator};
use crate::time::TimeSpan;

/// What a forecast knows of the polls, as of the last report before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polls {
    /// From poll to poll while nothing is reported.
    pub(super) period: TimeSpan,
    /// The polls to come, where they can be foreseen.
    pub(super) rhythm: Option<PollRhythm>,
}

impl Polls {
    pub(super) fn of(timing: &PollTimingEstimator) -> Self {
        Self { period: timing.timing().period, rhythm: timing.rhythm() }
    }
}
