//! The first part of a jerk-limited profile, until it cruises, from any speed and acceleration.
//!
//! A train that already accelerates is treated as if it had started earlier, and one that still brakes as if it started
//! later: the ramp starts where acceleration was or will be zero. The present state and the jerk give that time,
//! distance and speed.

use super::knot::Knot;
use super::ramp::{Ramp, THIRD};
use super::rate::Rate;

/// Time, distance and speed at which acceleration was, or will be, zero under a constant jerk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    pub(super) time: f64,
    pub(super) distance: f64,
    pub(super) speed: f64,
}

impl Level {
    /// From the present speed and acceleration and the reciprocal of the jerk; a negative one leads into braking.
    #[inline(always)]
    pub(super) fn new(speed: f64, acceleration: f64, per_jerk: f64) -> Self {
        let time = -acceleration * per_jerk;
        Self {
            time,
            // v t + a t²/2 + j t³/6 with a = −j t
            distance: time * (speed + THIRD * acceleration * time),
            speed: speed + 0.5 * acceleration * time,
        }
    }

    #[inline(always)]
    fn knot(self) -> Knot {
        Knot { time: self.time, distance: self.distance, speed: self.speed, half_acceleration: 0.0 }
    }
}

/// The knots of four phases from now on: the first brings the acceleration to zero, three more are a ramp. Phases that
/// are not needed have no duration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Opening {
    pub(super) knots: [Knot; 5],
    /// Whether the ramp slows the train down.
    pub(super) slows: bool,
}

impl Opening {
    /// Speeds up from standstill to a peak speed.
    #[inline(always)]
    pub(super) fn from_rest(peak: f64, rate: &Rate) -> Self {
        let [built_up, held, top] = Ramp::new(0.0, peak, rate).upwards_from_here();
        Self { knots: [Knot::default(), Knot::default(), built_up, held, top], slows: false }
    }

    /// Speeds up from the present speed and acceleration: first to `level`, then by a gain of speed.
    #[inline(always)]
    pub(super) fn speeding_up(speed: f64, acceleration: f64, level: Level, gain: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: 0.5 * acceleration, ..Knot::default() };
        let eased = if acceleration < 0.0 { level.knot() } else { now };
        let [built_up, held, top] = Ramp::new(level.speed, gain, rate).upwards(level.time, level.distance);
        Self { knots: [now, eased, built_up, held, top], slows: false }
    }

    /// Slows down from the present speed and acceleration to a lower speed without acceleration.
    pub(super) fn slowing_down(speed: f64, acceleration: f64, lower: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: 0.5 * acceleration, ..Knot::default() };
        let level = Level::new(speed, acceleration, -rate.per_jerk);
        let eased = if acceleration > 0.0 { level.knot() } else { now };
        let ramp = Ramp::new(lower, level.speed - lower, rate);
        let [built_up, held, bottom] = ramp.downwards(level.time + ramp.time, level.distance + ramp.distance);
        Self { knots: [now, eased, built_up, held, bottom], slows: true }
    }

    /// Eases off from a deceleration of `braking` to one of `eased`.
    pub(super) fn easing_off(speed: f64, braking: f64, eased: f64, rate: &Rate) -> Self {
        let now = Knot { speed, half_acceleration: -0.5 * braking, ..Knot::default() };
        let time = (braking - eased) * rate.per_jerk;
        let easier = Knot {
            time,
            // v t − b t²/2 + J t³/6 with J t = b − e
            distance: time * (speed - THIRD * time * (braking + 0.5 * eased)),
            speed: speed - 0.5 * time * (braking + eased),
            half_acceleration: -0.5 * eased,
        };
        Self { knots: [now, easier, easier, easier, easier], slows: false }
    }

    /// Its last knot.
    #[inline(always)]
    pub(super) fn end(&self) -> Knot {
        let [.., end] = self.knots;
        end
    }
}
