//! How fast a wheel turns and how its speed changes, followed fast enough to see it slip.
//!
//! A wheelset on low adhesion changes its speed by 10 to 20 m/s², which no filter of the train's bandwidth follows.
//! This one is free-running: nothing that is fused ever flows back into it.
//!
//! Letters: `v` speed, `a` acceleration, `r` what the wheel has counted beyond what was followed, `g` gains, `q`
//! spectral density of jerk. A steady-state Kalman filter on the accumulated count, whose error is white and bounded by
//! one pulse; a count per period has errors that take each other back.

use super::steady_gains::{SteadyGains, steady_gains};

/// Spectral density of the jerk of a wheelset (m²/s⁵): steps of 15 m/s² every few tenths of a second, smoothed.
const JERK_DENSITY: f64 = 3.0;

/// Speed and acceleration of one wheel.
#[derive(Debug, Clone, Copy)]
pub struct WheelTracker {
    gains: SteadyGains,
    pitch: f64,
    residual: f64,
    speed: f64,
    acceleration: f64,
    /// Since the last pulse (s).
    silence: f64,
}

impl WheelTracker {
    /// A wheel with a pulse every `pitch` metres, read every `period` seconds, standing.
    #[must_use]
    pub fn new(pitch: f64, period: f64) -> Self {
        let gains = steady_gains(period, JERK_DENSITY, pitch * pitch / 12.0);
        Self { gains, pitch, residual: 0.0, speed: 0.0, acceleration: 0.0, silence: 0.0 }
    }

    /// How far it is expected to turn in the next `span` seconds (m).
    #[inline]
    #[must_use]
    pub fn expected(&self, span: f64) -> f64 {
        self.speed * span + 0.5 * self.acceleration * span * span - self.residual
    }

    /// It has turned by `counted` metres in `span` seconds.
    #[inline]
    pub fn turned(&mut self, counted: f64, span: f64) {
        let SteadyGains { place, speed, acceleration, .. } = self.gains;
        let beyond = counted - self.expected(span);
        self.residual = beyond * (1.0 - place);
        self.speed += self.acceleration * span + speed * beyond;
        self.acceleration += acceleration * beyond;
        self.silence = if counted == 0.0 { self.silence + span } else { 0.0 };
        // Without a pulse for so long the wheel turned by less than one pitch: it is slower than that.
        if self.silence > 0.0 {
            let fastest = self.pitch / self.silence;
            if self.speed.abs() > fastest {
                self.speed = self.speed.clamp(-fastest, fastest);
                self.acceleration *= 0.5;
                self.residual = 0.0;
            }
        }
    }

    /// Sets it to a wheel that is known to turn so fast.
    pub fn restart(&mut self, speed: f64) {
        self.speed = speed;
        self.acceleration = 0.0;
        self.residual = 0.0;
        self.silence = 0.0;
    }

    /// Speed (m/s).
    #[inline]
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Acceleration (m/s²).
    #[inline]
    #[must_use]
    pub fn acceleration(&self) -> f64 {
        self.acceleration
    }

    /// Standard deviation of the acceleration while the wheel does what its process noise allows (m/s²).
    #[inline]
    #[must_use]
    pub fn acceleration_deviation(&self) -> f64 {
        self.gains.acceleration_deviation
    }

    /// Standard deviation of the speed, likewise (m/s).
    #[inline]
    #[must_use]
    pub fn speed_deviation(&self) -> f64 {
        self.gains.speed_deviation
    }

    /// Turns in the opposite direction from now on.
    pub fn reverse(&mut self) {
        self.speed = -self.speed;
        self.acceleration = -self.acceleration;
        self.residual = -self.residual;
    }

    /// Since its last pulse (s).
    #[inline]
    #[must_use]
    pub fn silence(&self) -> f64 {
        self.silence
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wheel of 100 teeth that starts at 20 m/s and accelerates by `a`.
    fn follow(a: f64, seconds: f64) -> WheelTracker {
        let (pitch, t) = (0.027, 0.05);
        let mut tracker = WheelTracker::new(pitch, t);
        tracker.restart(20.0);
        let mut counted = 0.0;
        for k in 1..=libm::round(seconds / t) as i32 {
            let now = f64::from(k) * t;
            let pulses = libm::floor((20.0 * now + 0.5 * a * now * now) / pitch);
            tracker.turned((pulses - counted) * pitch, t);
            counted = pulses;
        }
        tracker
    }

    #[test]
    fn a_wheel_that_falls_by_ten_metres_per_second_squared_is_followed_within_tenths_of_a_second() {
        let tracker = follow(-10.0, 0.5);
        assert!((tracker.speed() - 15.0).abs() < 0.3, "{}", tracker.speed());
        assert!((tracker.acceleration() + 10.0).abs() < 2.0, "{}", tracker.acceleration());
    }

    #[test]
    fn steady_speed_is_known_to_a_fraction_of_a_pulse() {
        let tracker = follow(0.0, 5.0);
        assert!((tracker.speed() - 20.0).abs() < 0.15, "{}", tracker.speed());
        assert!(tracker.acceleration().abs() < 4.0 * tracker.acceleration_deviation());
    }

    #[test]
    fn a_silent_wheel_is_slower_than_a_pulse_in_its_silence() {
        let mut tracker = follow(0.0, 2.0);
        for _ in 0..20 {
            tracker.turned(0.0, 0.05);
        }
        assert!(tracker.speed().abs() <= 0.027 + 1e-12, "{}", tracker.speed());
    }
}
