//! A profile sampled at a constant period, for cyclic controllers.

#![expect(clippy::indexing_slicing, reason = "phases are counted up to the last, which never ends")]

use super::{PHASES, SCurve};
use crate::kinematics::motion::{MotionState, seconds};
use crate::kinematics::phase::Phase;
use crate::time::TimeSpan;

/// The states of a profile, one every period from its start, without end.
#[derive(Debug, Clone)]
pub struct Playback<'p> {
    profile: &'p SCurve,
    period: TimeSpan,
    next: TimeSpan,
    number: usize,
    phase: Phase,
    /// When the next phase begins.
    until: f64,
}

impl<'p> Playback<'p> {
    pub(super) fn new(profile: &'p SCurve, period: TimeSpan) -> Self {
        let mut playback =
            Self { profile, period, next: TimeSpan::ZERO, number: 0, phase: profile.phase(0), until: 0.0 };
        playback.turn_to(0);
        playback
    }

    fn turn_to(&mut self, number: usize) {
        self.number = number;
        self.phase = self.profile.phase(number);
        self.until = if number < PHASES { self.profile.times[number + 1] } else { f64::INFINITY };
    }
}

impl Iterator for Playback<'_> {
    type Item = MotionState;

    #[inline]
    fn next(&mut self) -> Option<MotionState> {
        let time = seconds(self.next);
        while time >= self.until {
            self.turn_to(self.number + 1);
        }
        self.next += self.period;
        Some(self.profile.turned(self.phase.state_at(time)))
    }
}
