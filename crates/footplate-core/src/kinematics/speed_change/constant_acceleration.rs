//! The schoolbook law: speed changes evenly.

use super::ends::Ends;
use crate::kinematics::motion::{Motion, MotionState};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// Speed as a straight line over time: two unknowns, and a jerk without limit at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantAcceleration {
    ends: Ends,
    acceleration: f64,
}

impl ConstantAcceleration {
    /// From a speed to another within a duration; one that is negative counts as zero.
    #[inline]
    #[must_use]
    pub fn new(from: Speed, to: Speed, duration: TimeSpan) -> Self {
        let ends = Ends::symmetric(from, to, duration);
        Self { ends, acceleration: ends.per_duration(ends.to - ends.from) }
    }

    /// From a speed to another with an acceleration, of which only the size counts; zero takes for ever, which
    /// is as long as a [`TimeSpan`] can be.
    #[must_use]
    pub fn with_acceleration(from: Speed, to: Speed, acceleration: Acceleration) -> Self {
        let difference = (to - from).abs();
        let duration =
            if difference > Speed::ZERO { difference / acceleration.abs() } else { TimeSpan::ZERO };
        Self::new(from, to, duration)
    }
}

impl Motion for ConstantAcceleration {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let Self { ends: Ends { from, to, duration, distance, .. }, acceleration } = *self;
        self.ends.state_at(time, |t| {
            // A stop is counted from its end, so that it ends in a speed of exactly zero.
            let (t, speed, origin) =
                if acceleration < 0.0 { (t - duration, to, distance) } else { (t, from, 0.0) };
            let gained = acceleration * t;
            (origin + t * (speed + 0.5 * gained), speed + gained, acceleration)
        })
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let Self { ends: Ends { from, to, duration, distance: whole, .. }, acceleration } = *self;
        self.ends.time_at(distance, |way| {
            // From the slow end v t + a t²/2 = d has no cancellation as t = 2d / (v + √(v² + 2ad)).
            let braking = acceleration < 0.0;
            let (speed, off) = if braking { (to, whole - way) } else { (from, way) };
            let sum = speed + libm::sqrt(speed * speed + 2.0 * acceleration.abs() * off);
            let time = if off > 0.0 { (2.0 * off / sum).min(duration) } else { 0.0 };
            if braking { duration - time } else { time }
        })
    }

    fn duration(&self) -> TimeSpan {
        self.ends.duration()
    }

    fn distance(&self) -> Length {
        self.ends.distance()
    }
}
