//! A stretch of constant jerk, counted from its slow end.
//!
//! Counting a stop from the standstill at its end instead of from the speed at its beginning keeps the digits where
//! the train is slow: speed and remaining distance go to zero together, without a difference of large numbers.

use super::slow_end::SlowEnd;

/// Distance, speed and acceleration in m, m/s and m/s².
pub(super) type Triple = (f64, f64, f64);

/// To multiply with, which is quicker than to divide by six.
pub(super) const SIXTH: f64 = 1.0 / 6.0;

/// Motion of constant jerk, as a polynomial in the time from its slow end, which is its beginning where the
/// train speeds up or cruises and its end where it slows down.
///
/// In the order in which a profile's samples use them; SI units throughout.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Phase {
    /// Time of the slow end.
    pub(super) time: f64,
    /// Distance of the slow end.
    pub(super) distance: f64,
    /// Speed at the slow end.
    pub(super) speed: f64,
    /// Half the acceleration at the slow end.
    pub(super) half_acceleration: f64,
    /// A sixth of the jerk.
    pub(super) sixth_jerk: f64,
}

impl Phase {
    /// The state at a time within the phase.
    #[inline(always)]
    pub(super) fn state_at(&self, time: f64) -> Triple {
        let t = time - self.time;
        let bent = t * self.sixth_jerk;
        let gained = t * (2.0 * self.half_acceleration + 3.0 * bent);
        (
            self.distance + t * (self.speed + t * (self.half_acceleration + bent)),
            self.speed + gained,
            2.0 * self.half_acceleration + 6.0 * bent,
        )
    }

    /// The time at a distance within the phase, whose duration is `longest`.
    #[inline(always)]
    pub(super) fn time_at(&self, distance: f64, longest: f64) -> f64 {
        let way = distance - self.distance;
        let end = SlowEnd {
            speed: self.speed,
            half_acceleration: self.half_acceleration.abs(),
            sixth_jerk: self.sixth_jerk,
            quartic: 0.0,
        };
        self.time + end.time_to_cover(way.abs(), longest).copysign(way)
    }
}
