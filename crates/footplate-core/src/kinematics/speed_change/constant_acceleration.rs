//! The schoolbook law: constant acceleration.

use super::ends::Ends;
use crate::kinematics::motion::{Motion, MotionState};
use crate::kinematics::slow_end::even_time;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// Speed as a straight line over time: two unknowns, and infinite jerk at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantAcceleration {
    ends: Ends,
    /// Time, distance and speed of the slow end, the origin of all calculations: a stop ends at a speed of exactly
    /// zero.
    origin: (f64, f64, f64),
    acceleration: f64,
}

impl ConstantAcceleration {
    /// From one speed to another within a duration; a negative one counts as zero.
    #[inline]
    #[must_use]
    pub fn new(from: Speed, to: Speed, duration: TimeSpan) -> Self {
        let ends = Ends::symmetric(from, to, duration);
        let acceleration = ends.per_duration(ends.to - ends.from);
        let origin =
            if acceleration < 0.0 { (ends.duration, ends.distance, ends.to) } else { (0.0, 0.0, ends.from) };
        Self { ends, origin, acceleration }
    }

    /// From one speed to another with an acceleration, whose sign is ignored; zero takes the longest possible
    /// [`TimeSpan`].
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
        let Self { origin: (start, distance, speed), acceleration, .. } = *self;
        self.ends.state_at(time, |t| {
            let t = t - start;
            let gained = acceleration * t;
            (distance + t * (speed + 0.5 * gained), speed + gained, acceleration)
        })
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let Self { origin: (start, origin, speed), acceleration, .. } = *self;
        self.ends.time_at(distance, |distance| start + even_time(distance - origin, speed, acceleration))
    }

    fn duration(&self) -> TimeSpan {
        self.ends.duration()
    }

    fn distance(&self) -> Length {
        self.ends.distance()
    }
}
