//! A profile played back at a steady period, for controllers that ask once in every cycle.

#![expect(clippy::indexing_slicing, reason = "the current phase is never counted beyond the last")]

use super::{PHASES, SCurve};
use crate::kinematics::motion::MotionState;
use crate::time::TimeSpan;

/// The states of a profile, one every period from its start on, for ever.
#[derive(Debug, Clone)]
pub struct Playback<'p> {
    profile: &'p SCurve,
    period: TimeSpan,
    next: TimeSpan,
    phase: usize,
}

impl<'p> Playback<'p> {
    pub(super) fn new(profile: &'p SCurve, period: TimeSpan) -> Self {
        Self { profile, period, next: TimeSpan::ZERO, phase: 0 }
    }
}

impl Iterator for Playback<'_> {
    type Item = MotionState;

    #[inline]
    fn next(&mut self) -> Option<MotionState> {
        let time = self.next.as_s();
        while self.phase < PHASES && time >= self.profile.times[self.phase] {
            self.phase += 1;
        }
        self.next += self.period;
        Some(self.profile.turned(self.profile.phases[self.phase].state_at(time)))
    }
}
