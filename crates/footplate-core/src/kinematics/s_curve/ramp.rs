//! From a lower speed to a higher one with limited jerk: acceleration builds up, holds, and fades.
//!
//! ```text
//! J  limit of jerk      A  limit of acceleration      x  speed gained      p  peak acceleration
//! x ≥ A²/J    p = A         time A/J, then x/A − A/J, then A/J
//! x < A²/J    p = √(J x)    time √(x/J), 0, √(x/J)
//! ```
//!
//! A ramp is symmetric, so its mean speed is the mean of both ends. Slowing down is the same ramp backwards.

use super::knot::Knot;
use super::rate::Rate;

pub(super) const THIRD: f64 = 1.0 / 3.0;

/// A ramp, counted from its lower end; SI units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    low: f64,
    high: f64,
    /// End of the build-up of acceleration, and start of its fade.
    built_up: Knot,
    held: Knot,
    pub(super) time: f64,
    pub(super) distance: f64,
}

impl Ramp {
    /// From a speed by a gain. The gain is an argument because the difference to a peak hardly above `low` has few
    /// digits; a gain below zero is rounding.
    #[inline(always)]
    pub(super) fn new(low: f64, gain: f64, rate: &Rate) -> Self {
        let gain = if gain > 0.0 { gain } else { 0.0 };
        let high = low + gain;
        let (peak, build_up, hold) = rate.peak_for(gain);
        let half_acceleration = 0.5 * peak;
        let won = half_acceleration * build_up;
        let (slow, fast) = (low + won, high - won);
        let bent = THIRD * won;
        let build_up_distance = build_up * (low + bent);
        let held_time = build_up + hold;
        let held_distance = build_up_distance + hold * (0.5 * (slow + fast));
        Self {
            low,
            high,
            built_up: Knot { time: build_up, distance: build_up_distance, speed: slow, half_acceleration },
            held: Knot { time: held_time, distance: held_distance, speed: fast, half_acceleration },
            time: build_up + held_time,
            distance: held_distance + build_up * (high - bent),
        }
    }

    /// Its inner knots and its upper end, for a ramp that begins at time and distance 0.
    #[inline(always)]
    pub(super) fn upwards_from_here(&self) -> [Knot; 3] {
        let top = Knot { time: self.time, distance: self.distance, speed: self.high, half_acceleration: 0.0 };
        [self.built_up, self.held, top]
    }

    /// The same for a ramp whose lower end is at another time and distance.
    #[inline(always)]
    pub(super) fn upwards(&self, time: f64, distance: f64) -> [Knot; 3] {
        self.upwards_from_here().map(|knot| Knot {
            time: time + knot.time,
            distance: distance + knot.distance,
            ..knot
        })
    }

    /// Its inner knots and its lower end in order of time, for a ramp run backwards (slowing down) that ends at a
    /// time and a distance.
    #[inline(always)]
    pub(super) fn downwards(&self, time: f64, distance: f64) -> [Knot; 3] {
        let before = |knot: Knot| Knot {
            time: time - knot.time,
            distance: distance - knot.distance,
            speed: knot.speed,
            half_acceleration: -knot.half_acceleration,
        };
        [
            before(self.held),
            before(self.built_up),
            Knot { time, distance, speed: self.low, half_acceleration: 0.0 },
        ]
    }
}
