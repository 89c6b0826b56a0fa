//! The S-curve: acceleration grows at a constant rate to the middle of the change, then falls at the same rate.

use super::ends::Ends;
use crate::kinematics::motion::{Motion, MotionState};
use crate::kinematics::phase::Phase;
use crate::time::TimeSpan;
use crate::units::{Jerk, Length, Speed};

/// Speed as two parabolas, so acceleration has no step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantJerk {
    ends: Ends,
    half: f64,
    halves: [Phase; 2],
    /// Distance at half the time.
    distance_at_half: f64,
}

impl ConstantJerk {
    /// From one speed to another within a duration; a negative one counts as zero.
    #[must_use]
    pub fn new(from: Speed, to: Speed, duration: TimeSpan) -> Self {
        let ends = Ends::symmetric(from, to, duration);
        let half = 0.5 * ends.duration;
        let middle = 0.5 * (ends.from + ends.to);
        // v₂ − v₁ = j (Δ/2)² and the largest acceleration, at half the time, is j Δ/2.
        let half_peak = ends.per_duration(ends.to - ends.from);
        let sixth_jerk = 2.0 / 3.0 * ends.per_duration(half_peak);
        let distance_at_half = half * (ends.from + 1.0 / 6.0 * (ends.to - ends.from));
        let braking = half_peak < 0.0;
        let phase = |(time, distance, speed), half_acceleration, sixth_jerk| Phase {
            time,
            distance,
            speed,
            half_acceleration,
            sixth_jerk,
        };
        let at_half = (half, distance_at_half, middle);
        let halves = if braking {
            let at_end = (ends.duration, ends.distance, ends.to);
            [phase(at_half, half_peak, sixth_jerk), phase(at_end, 0.0, -sixth_jerk)]
        } else {
            let at_start = (0.0, 0.0, ends.from);
            [phase(at_start, 0.0, sixth_jerk), phase(at_half, half_peak, -sixth_jerk)]
        };
        Self { ends, half, halves, distance_at_half }
    }

    /// From one speed to another with a jerk, whose sign is ignored; zero takes the longest possible [`TimeSpan`].
    #[must_use]
    pub fn with_jerk(from: Speed, to: Speed, jerk: Jerk) -> Self {
        let difference = (to - from).abs();
        // v₂ − v₁ = j (Δ/2)²
        let seconds = 2.0 * libm::sqrt(difference.as_m_per_s() / jerk.abs().as_m_per_s3());
        let duration = if difference > Speed::ZERO { TimeSpan::from_s(seconds) } else { TimeSpan::ZERO };
        Self::new(from, to, duration)
    }
}

impl Motion for ConstantJerk {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let [first, second] = &self.halves;
        self.ends.state_at(time, |t| if t < self.half { first } else { second }.state_at(t))
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let [first, second] = &self.halves;
        self.ends.time_at(distance, |distance| {
            if distance < self.distance_at_half { first } else { second }.time_at(distance, self.half)
        })
    }

    fn duration(&self) -> TimeSpan {
        self.ends.duration()
    }

    fn distance(&self) -> Length {
        self.ends.distance()
    }
}
