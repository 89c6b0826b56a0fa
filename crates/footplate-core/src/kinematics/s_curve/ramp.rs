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

use super::knot::Knot;
use super::rate::Rate;

pub(super) const THIRD: f64 = 1.0 / 3.0;

/// A ramp, counted from its lower end; SI units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    low: f64,
    high: f64,
    /// Where acceleration has built up, and where it begins to fade.
    built_up: Knot,
    held: Knot,
    pub(super) time: f64,
    pub(super) way: f64,
}

impl Ramp {
    /// From a speed up by a gain, given apart because the difference to a peak hardly above it has few digits;
    /// a gain below zero is rounding.
    #[inline(always)]
    pub(super) fn new(low: f64, gain: f64, rate: &Rate) -> Self {
        let gain = if gain > 0.0 { gain } else { 0.0 };
        let high = low + gain;
        let (peak, build_up, hold) = rate.peak_for(gain);
        let half_acceleration = 0.5 * peak;
        let won = half_acceleration * build_up;
        let (slow, fast) = (low + won, high - won);
        let bent = THIRD * won;
        let build_up_way = build_up * (low + bent);
        let held_time = build_up + hold;
        let held_way = build_up_way + hold * (0.5 * (slow + fast));
        Self {
            low,
            high,
            built_up: Knot { time: build_up, way: build_up_way, speed: slow, half_acceleration },
            held: Knot { time: held_time, way: held_way, speed: fast, half_acceleration },
            time: build_up + held_time,
            way: held_way + build_up * (high - bent),
        }
    }

    /// Its inner borders and its upper end, when it begins here and now.
    #[inline(always)]
    pub(super) fn upwards_from_here(&self) -> [Knot; 3] {
        let top = Knot { time: self.time, way: self.way, speed: self.high, half_acceleration: 0.0 };
        [self.built_up, self.held, top]
    }

    /// The same, passing its lower end at another time and distance.
    #[inline(always)]
    pub(super) fn upwards(&self, time: f64, way: f64) -> [Knot; 3] {
        self.upwards_from_here().map(|knot| Knot { time: time + knot.time, way: way + knot.way, ..knot })
    }

    /// Its inner borders and its lower end in order of time, when it is run backwards from the upper end, reaching
    /// the lower end at a time and a distance.
    #[inline(always)]
    pub(super) fn downwards(&self, time: f64, way: f64) -> [Knot; 3] {
        let before = |knot: Knot| Knot {
            time: time - knot.time,
            way: way - knot.way,
            speed: knot.speed,
            half_acceleration: -knot.half_acceleration,
        };
        [
            before(self.held),
            before(self.built_up),
            Knot { time, way, speed: self.low, half_acceleration: 0.0 },
        ]
    }
}
