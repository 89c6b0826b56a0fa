//! What a jerk-limited profile does until it cruises, from any speed and acceleration.
//!
//! A train that already accelerates is treated as if it had begun earlier, and one that still brakes as if it
//! began later: a ramp starts where acceleration was or will be zero, at a time, way and speed that follow from
//! the present ones by the same jerk.

use super::ramp::Ramp;
use crate::kinematics::phase::Phase;

/// Time, way and speed at which acceleration was, or will be, zero under a constant jerk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    pub(super) time: f64,
    pub(super) way: f64,
    pub(super) speed: f64,
}

impl Level {
    /// From the present speed and acceleration; a jerk below zero leads into braking.
    #[inline]
    pub(super) fn new(speed: f64, acceleration: f64, jerk: f64) -> Self {
        let time = -acceleration / jerk;
        Self {
            time,
            // v t + a t²/2 + j t³/6 with a = −j t
            way: time * (speed + acceleration * time / 3.0),
            speed: speed + 0.5 * acceleration * time,
        }
    }
}

/// Four phases: first whatever it takes to level the acceleration out, then the three of a ramp. Unused ones
/// have no duration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Opening {
    /// End of each phase, and the way there.
    pub(super) times: [f64; 4],
    pub(super) ways: [f64; 4],
    pub(super) phases: [Phase; 4],
    /// Speed at the end of the last.
    pub(super) speed: f64,
}

impl Opening {
    /// Speeds up from a present speed and acceleration, which level out as given, by a gain on that.
    #[inline]
    pub(super) fn speeding_up(
        speed: f64,
        acceleration: f64,
        level: Level,
        gain: f64,
        limit: f64,
        jerk: f64,
    ) -> Self {
        let ramp = Ramp::new(level.speed, gain, limit, jerk);
        let ([first, hold, fade], [built_up, held]) = ramp.upwards(level.time, level.way);
        let present = Phase {
            time: 0.0,
            distance: 0.0,
            speed,
            half_acceleration: 0.5 * acceleration,
            sixth_jerk: jerk / 6.0,
        };
        let (ease_end, ease, build_up) = if acceleration < 0.0 {
            ((level.time, level.way), first, first)
        } else {
            ((0.0, 0.0), present, present)
        };
        Self {
            times: [ease_end.0, built_up.0, held.0, level.time + ramp.time],
            ways: [ease_end.1, built_up.1, held.1, level.way + ramp.way],
            phases: [ease, build_up, hold, fade],
            speed: level.speed + gain,
        }
    }

    /// Slows down from a present speed and acceleration to a lower one without acceleration.
    pub(super) fn slowing_down(speed: f64, acceleration: f64, lower: f64, limit: f64, jerk: f64) -> Self {
        let level = Level::new(speed, acceleration, -jerk);
        let ramp = Ramp::new(lower, level.speed - lower, limit, jerk);
        let (end_time, end_way) = (level.time + ramp.time, level.way + ramp.way);
        let ([build_up, hold, fade], [built_up, held]) = ramp.downwards(end_time, end_way);
        let present = Phase {
            time: 0.0,
            distance: 0.0,
            speed,
            half_acceleration: 0.5 * acceleration,
            sixth_jerk: -jerk / 6.0,
        };
        let ease_end = if acceleration > 0.0 { (level.time, level.way) } else { (0.0, 0.0) };
        Self {
            times: [ease_end.0, built_up.0, held.0, end_time],
            ways: [ease_end.1, built_up.1, held.1, end_way],
            phases: [present, build_up, hold, fade],
            speed: lower,
        }
    }

    /// Eases off from braking at `braking` to braking at `eased`, both sizes.
    pub(super) fn easing_off(speed: f64, braking: f64, eased: f64, jerk: f64) -> Self {
        let time = (braking - eased) / jerk;
        let way = time * (speed - time * (0.5 * braking - jerk * time / 6.0));
        let speed = speed - 0.5 * time * (braking + eased);
        let ease =
            Phase { time, distance: way, speed, half_acceleration: -0.5 * eased, sixth_jerk: jerk / 6.0 };
        Self { times: [time; 4], ways: [way; 4], phases: [ease; 4], speed }
    }

    /// Time and way at its end.
    #[inline]
    pub(super) fn end(&self) -> (f64, f64) {
        let ([.., time], [.., way]) = (self.times, self.ways);
        (time, way)
    }
}
