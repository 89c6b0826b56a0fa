//! The smooth law: the cubic that decoder firmware uses.

use super::ends::Ends;
use crate::kinematics::motion::{Motion, MotionState};
use crate::kinematics::slow_end::SlowEnd;
use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// Speed as the cubic 3τ² − 2τ³ of the share τ of the duration that has passed, distance as its quartic;
/// acceleration begins and ends at zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smooth {
    ends: Ends,
    /// Time, distance and speed of the slow end, from which the quartic is counted.
    origin: (f64, f64, f64),
    /// Coefficient of the third power of the time: |v₂ − v₁|/Δ².
    cubic: f64,
    /// Coefficient of the fourth power: −(v₂ − v₁)/2Δ³.
    quartic: f64,
}

impl Smooth {
    /// From one speed to another within a duration; a negative one counts as zero.
    #[must_use]
    pub fn new(from: Speed, to: Speed, duration: TimeSpan) -> Self {
        let ends = Ends::symmetric(from, to, duration);
        let gained = ends.to - ends.from;
        let square = ends.per_duration(ends.per_duration(gained));
        let fourth = -0.5 * ends.per_duration(square);
        // The law is symmetric: backwards from its end it is the law from v₂ to v₁ with a gain of v₁ − v₂. Mirroring
        // time and distance changes the sign of the even power's coefficient once more.
        if gained < 0.0 {
            let origin = (ends.duration, ends.distance, ends.to);
            Self { ends, origin, cubic: -square, quartic: fourth }
        } else {
            Self { ends, origin: (0.0, 0.0, ends.from), cubic: square, quartic: fourth }
        }
    }
}

impl Motion for Smooth {
    #[inline]
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let Self { origin: (start, distance, speed), cubic, quartic, .. } = *self;
        self.ends.state_at(time, |t| {
            let t = t - start;
            let fourth = t * quartic;
            (
                distance + t * (speed + t * t * (cubic + fourth)),
                speed + t * t * (3.0 * cubic + 4.0 * fourth),
                t * (6.0 * cubic + 12.0 * fourth),
            )
        })
    }

    #[inline]
    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let Self { origin: (start, origin, speed), cubic, quartic, .. } = *self;
        self.ends.time_at(distance, |distance| {
            let off = distance - origin;
            let end = SlowEnd { speed, half_acceleration: 0.0, sixth_jerk: cubic, quartic: -quartic.abs() };
            start + end.time_to_cover(off.abs(), self.ends.duration).copysign(off)
        })
    }

    fn duration(&self) -> TimeSpan {
        self.ends.duration()
    }

    fn distance(&self) -> Length {
        self.ends.distance()
    }
}
