//! A phase of constant jerk, counted from its slow end.
//!
//! A stop is counted back from standstill, not forward from its initial speed. This keeps precision where the train is
//! slow: speed and remaining distance go to zero together, without a difference of large numbers.

use super::slow_end::SlowEnd;

/// Distance, speed and acceleration in m, m/s and m/s².
pub(super) type Triple = (f64, f64, f64);

/// Multiplication is faster than division by six.
pub(super) const SIXTH: f64 = 1.0 / 6.0;

/// Motion of constant jerk, as a polynomial in the time from its slow end: its beginning if the train speeds up or
/// cruises, its end if it slows down.
///
/// Fields are in the order in which sampling a profile uses them; SI units.
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
        let distance = distance - self.distance;
        let end = SlowEnd {
            speed: self.speed,
            half_acceleration: self.half_acceleration.abs(),
            sixth_jerk: self.sixth_jerk,
            quartic: 0.0,
        };
        self.time + end.time_to_cover(distance.abs(), longest).copysign(distance)
    }
}
