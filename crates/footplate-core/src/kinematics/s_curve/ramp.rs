//! From a lower speed to a higher one with limited jerk: acceleration builds up, holds, and fades.
//!
//! ```text
//! J  limit of jerk      A  limit of acceleration      x  speed gained      p  peak acceleration
//! x ≥ A²/J    p = A         time A/J, then x/A − A/J, then A/J
//! x < A²/J    p = √(J x)    time √(x/J), nothing, √(x/J)
//! ```
//!
//! A ramp is its own mirror image, so that its mean speed is the mean of both ends; slowing down is the same
//! ramp backwards.

use crate::kinematics::phase::Phase;

/// A ramp, in time and way since its lower end; SI units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    peak: f64,
    sixth_jerk: f64,
    /// Time, way and speed at the lower end, after the build-up, and after the hold.
    knots: [(f64, f64, f64); 3],
    pub(super) time: f64,
    pub(super) way: f64,
}

/// Whether a gain of speed is large enough for the limit of acceleration to be reached.
#[inline]
pub(super) fn holds_limit(gain: f64, limit: f64, jerk: f64) -> bool {
    gain >= limit * limit / jerk
}

/// The way of a ramp, and how it grows with the speed gained; a gain below zero is rounding.
#[inline]
pub(super) fn way_and_slope(low: f64, gain: f64, limit: f64, jerk: f64) -> (f64, f64) {
    let gain = gain.max(0.0);
    let (time, slope) = if holds_limit(gain, limit, jerk) {
        (gain / limit + limit / jerk, 1.0 / limit)
    } else {
        let time = 2.0 * libm::sqrt(gain / jerk);
        (time, 2.0 / (jerk * time))
    };
    let mean = low + 0.5 * gain;
    (mean * time, 0.5 * time + mean * slope)
}

impl Ramp {
    /// From a speed up by a gain, given apart because the difference to a peak hardly above it has few digits;
    /// a gain below zero is rounding.
    #[inline]
    pub(super) fn new(low: f64, gain: f64, limit: f64, jerk: f64) -> Self {
        let gain = gain.max(0.0);
        let high = low + gain;
        let (peak, build_up, hold) = if holds_limit(gain, limit, jerk) {
            let build_up = limit / jerk;
            (limit, build_up, (gain / limit - build_up).max(0.0))
        } else {
            let build_up = libm::sqrt(gain / jerk);
            (jerk * build_up, build_up, 0.0)
        };
        let built_up = 0.5 * peak * build_up;
        let (slow, fast) = (low + built_up, high - built_up);
        let first_way = build_up * (low + built_up / 3.0);
        let held_way = first_way + 0.5 * hold * (slow + fast);
        Self {
            peak,
            sixth_jerk: jerk / 6.0,
            knots: [(0.0, 0.0, low), (build_up, first_way, slow), (build_up + hold, held_way, fast)],
            time: 2.0 * build_up + hold,
            way: held_way + build_up * (high - built_up / 3.0),
        }
    }

    /// Its three phases when the lower end is passed at a time and a way; and where the first two of them end.
    #[inline]
    pub(super) fn upwards(&self, time: f64, way: f64) -> ([Phase; 3], [(f64, f64); 2]) {
        let [start, built_up, held] = self.knots;
        let phase = |(after, off, speed): (f64, f64, f64), half_acceleration, sixth_jerk| Phase {
            time: time + after,
            distance: way + off,
            speed,
            half_acceleration,
            sixth_jerk,
        };
        let half = 0.5 * self.peak;
        let phases = [
            phase(start, 0.0, self.sixth_jerk),
            phase(built_up, half, 0.0),
            phase(held, half, -self.sixth_jerk),
        ];
        (phases, [(time + built_up.0, way + built_up.1), (time + held.0, way + held.1)])
    }

    /// Its three phases in order of time when it is run backwards, from the higher end down, and the lower end
    /// is reached at a time and a way; and where the first two of them end.
    #[inline]
    pub(super) fn downwards(&self, time: f64, way: f64) -> ([Phase; 3], [(f64, f64); 2]) {
        let [end, built_up, held] = self.knots;
        let phase = |(before, off, speed): (f64, f64, f64), half_acceleration, sixth_jerk| Phase {
            time: time - before,
            distance: way - off,
            speed,
            half_acceleration,
            sixth_jerk,
        };
        let half = -0.5 * self.peak;
        let phases = [
            phase(held, half, -self.sixth_jerk),
            phase(built_up, half, 0.0),
            phase(end, 0.0, self.sixth_jerk),
        ];
        (phases, [(time - held.0, way - held.1), (time - built_up.0, way - built_up.1)])
    }
}
