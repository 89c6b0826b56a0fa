//! The crudest law: the old speed for half the time, then the new one.

use super::ends::Ends;
use crate::kinematics::motion::{Motion, MotionState};
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// A step at the middle of the interval: sufficient where the course of the change does not matter, because its total
/// distance is that of the mean speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MidStep {
    ends: Ends,
    half: f64,
}

impl MidStep {
    /// From one speed to another within a duration; a negative one counts as zero.
    #[must_use]
    pub fn new(from: Speed, to: Speed, duration: TimeSpan) -> Self {
        let ends = Ends::symmetric(from, to, duration);
        Self { ends, half: 0.5 * ends.duration }
    }
}

impl Motion for MidStep {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let Self { ends: Ends { from, to, .. }, half } = *self;
        self.ends.state_at(time, |t| {
            let (before, after) = (t.min(half), (t - half).max(0.0));
            (from * before + to * after, if t < half { from } else { to }, 0.0)
        })
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let Self { ends: Ends { from, to, .. }, half } = *self;
        self.ends.time_at(distance, |distance| {
            let beyond = distance - from * half;
            if beyond <= 0.0 && from > 0.0 {
                distance / from
            } else if beyond > 0.0 {
                half + beyond / to
            } else {
                0.0
            }
        })
    }

    fn duration(&self) -> TimeSpan {
        self.ends.duration()
    }

    fn distance(&self) -> Length {
        self.ends.distance()
    }
}
