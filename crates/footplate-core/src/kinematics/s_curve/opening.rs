//! The first part of a jerk-limited profile, until it cruises, from any speed and acceleration.
//!
//! A train that already accelerates is treated as if it had begun earlier, and one that still brakes as if it began
//! later: a ramp starts where acceleration was or will be zero, at a time, distance and speed that follow from the
//! present ones by the same jerk.

use super::knot::Knot;
use super::ramp::{Ramp, THIRD};
use super::rate::Rate;

/// Time, distance and speed at which acceleration was, or will be, zero under a constant jerk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    pub(super) time: f64,
    pub(super) way: f64,
    pub(super) speed: f64,
}

impl Level {
    /// From the present speed and acceleration, and one over the jerk; below zero it leads into braking.
    #[inline(always)]
    pub(super) fn new(speed: f64, acceleration: f64, per_jerk: f64) -> Self {
        let time = -acceleration * per_jerk;
        Self {
            time,
            // v t + a t²/2 + j t³/6 with a = −j t
            way: time * (speed + THIRD * acceleration * time),
            speed: speed + 0.5 * acceleration * time,
        }
    }

    #[inline(always)]
    fn knot(self) -> Knot {
        Knot { time: self.time, way: self.way, speed: self.speed, half_acceleration: 0.0 }
    }
}

/// The borders of four phases, from now on: first whatever it takes to level the acceleration out, then the
/// three phases of a ramp. Phases that are not needed have no duration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Opening {
    pub(super) knots: [Knot; 5],
    /// Whether the ramp is one of slowing down.
    pub(super) slows: bool,
}

impl Opening {
    /// Speeds up from standstill to a peak.
    #[inline(always)]
    pub(super) fn from_stand(peak: f64, rate: &Rate) -> Self {
        let [built_up, held, top] = Ramp::new(0.0, peak, rate).upwards_from_here();
        Self { knots: [Knot::default(), Knot::default(), built_up, held, top], slows: false }
    }

    /// Speeds up from a present speed and acceleration, which level out as given, by a gain on that.
    #[inline(always)]
    pub(super) fn speeding_up(speed: f64, acceleration: f64, level: Level, gain: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: 0.5 * acceleration, ..Knot::default() };
        let eased = if acceleration < 0.0 { level.knot() } else { now };
        let [built_up, held, top] = Ramp::new(level.speed, gain, rate).upwards(level.time, level.way);
        Self { knots: [now, eased, built_up, held, top], slows: false }
    }

    /// Slows down from a present speed and acceleration to a lower one without acceleration.
    pub(super) fn slowing_down(speed: f64, acceleration: f64, lower: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: 0.5 * acceleration, ..Knot::default() };
        let level = Level::new(speed, acceleration, -rate.per_jerk);
        let eased = if acceleration > 0.0 { level.knot() } else { now };
        let ramp = Ramp::new(lower, level.speed - lower, rate);
        let [built_up, held, bottom] = ramp.downwards(level.time + ramp.time, level.way + ramp.way);
        Self { knots: [now, eased, built_up, held, bottom], slows: true }
    }

    /// Eases off from braking at `braking` to braking at `eased`, both sizes.
    pub(super) fn easing_off(speed: f64, braking: f64, eased: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: -0.5 * braking, ..Knot::default() };
        let time = (braking - eased) * rate.per_jerk;
        let easier = Knot {
            time,
            // v t − b t²/2 + J t³/6 with J t = b − e
            way: time * (speed - THIRD * time * (braking + 0.5 * eased)),
            speed: speed - 0.5 * time * (braking + eased),
            half_acceleration: -0.5 * eased,
        };
        Self { knots: [now, easier, easier, easier, easier], slows: false }
    }

    /// Where it ends.
    #[inline(always)]
    pub(super) fn end(&self) -> Knot {
        let [.., end] = self.knots;
        end
    }
}
