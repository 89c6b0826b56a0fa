//! The laws that are symmetric in time: their mean speed is the mean of their two ends.

use super::ends::Ends;
use crate::kinematics::motion::{Motion, MotionState};
use crate::kinematics::phase::{Phase, SlowEnd, even_time};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// A step at the middle of the interval: sufficient where the course of the change does not matter, because its total
/// distance is that of the mean speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MidStep {
    ends: Ends,
    half: f64,
}

impl MidStep {
    /// From one speed to another within a duration; a negative one counts as zero.
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
    pub fn new(from: Speed, to: Speed, duration: TimeSpan) -> Self {
        let ends = Ends::symmetric(from, to, duration);
        let acceleration = ends.per_duration(ends.to - ends.from);
        let origin =
            if acceleration < 0.0 { (ends.duration, ends.distance, ends.to) } else { (0.0, 0.0, ends.from) };
        Self { ends, origin, acceleration }
    }

    /// From one speed to another with an acceleration, whose sign is ignored; zero takes the longest possible
    /// [`TimeSpan`].
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
