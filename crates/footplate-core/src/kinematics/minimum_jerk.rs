//! From one speed to another over a given distance in a given time, with minimum jerk.
//!
//! Letters: `d` distance, `T` time, `v₁` and `v₂` the speeds at the ends, where the acceleration is zero; `τ = t/T`.
//! Among all motions with these ends the integral of the squared jerk is least for (Flash and Hogan, 1985)
//!
//! ```text
//! x = v₁ T τ + A τ³ + B τ⁴ + C τ⁵        D = d − v₁ T,  W = (v₂ − v₁) T
//! A = 10 D − 4 W,  B = −15 D + 7 W,  C = 6 D − 3 W
//! ```
//!
//! From rest to rest that is `d (10τ³ − 15τ⁴ + 6τ⁵)`. The acceleration `(6 A τ + 12 B τ² + 20 C τ³)/T²` is zero at both
//! ends and at `τ = 3A/10C`, where the speed is farthest from those at the ends.

use super::bracket::crossing;
use super::motion::{Motion, MotionState, span_of};
use crate::time::TimeSpan;
use crate::units::{Acceleration, Length, Speed};

/// The motion with minimum jerk between two states without acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MinimumJerk {
    time: f64,
    distance: f64,
    from: f64,
    to: f64,
    /// `A`, `B` and `C`.
    powers: [f64; 3],
}

impl MinimumJerk {
    /// A motion over a distance from one speed to another in a time; with a time of zero or less, an instantaneous
    /// change.
    pub fn new(distance: Length, from: Speed, to: Speed, time: TimeSpan) -> Self {
        let (time, distance) = (time.as_s().max(0.0), distance.as_m());
        let (from, to) = (from.as_m_per_s(), to.as_m_per_s());
        let (d, w) = (distance - from * time, (to - from) * time);
        Self {
            time,
            distance,
            from,
            to,
            powers: [10.0 * d - 4.0 * w, -15.0 * d + 7.0 * w, 6.0 * d - 3.0 * w],
        }
    }

    /// The lowest and the highest speed of the motion.
    pub fn speeds(&self) -> [Speed; 2] {
        let [a, _, c] = self.powers;
        let turn = 0.3 * a / c;
        let middle = if turn > 0.0 && turn < 1.0 { self.speed(turn) } else { self.from };
        [middle.min(self.from).min(self.to), middle.max(self.from).max(self.to)].map(Speed::from_m_per_s)
    }

    fn place(&self, part: f64) -> f64 {
        let [a, b, c] = self.powers;
        part * (self.from * self.time + part * part * (a + part * (b + part * c)))
    }

    fn speed(&self, part: f64) -> f64 {
        let [a, b, c] = self.powers;
        self.from + part * part * (3.0 * a + part * (4.0 * b + part * 5.0 * c)) / self.time
    }
}

impl Motion for MinimumJerk {
    fn state_at(&self, time: TimeSpan) -> MotionState {
        let t = time.as_s();
        let (place, speed, acceleration) = if t <= 0.0 {
            (self.from * t, self.from, 0.0)
        } else if t >= self.time {
            (self.distance + self.to * (t - self.time), self.to, 0.0)
        } else {
            let ([a, b, c], part) = (self.powers, t / self.time);
            let bend = part * (6.0 * a + part * (12.0 * b + part * 20.0 * c)) / (self.time * self.time);
            (self.place(part), self.speed(part), bend)
        };
        MotionState {
            distance: Length::from_m(place),
            speed: Speed::from_m_per_s(speed),
            acceleration: Acceleration::from_m_per_s2(acceleration),
        }
    }

    fn time_at(&self, distance: Length) -> Option<TimeSpan> {
        let distance = distance.as_m();
        if distance == 0.0 {
            return Some(TimeSpan::ZERO);
        }
        if distance < 0.0 {
            return (self.from > 0.0).then(|| TimeSpan::from_s(distance / self.from));
        }
        if distance > self.distance {
            let since = (distance - self.distance) / self.to;
            return (self.to > 0.0 && since.is_finite()).then(|| span_of(self.time + since));
        }
        distance
            .is_finite()
            .then(|| span_of(self.time * crossing(0.0, 1.0, |part| self.place(part) - distance)))
    }

    fn duration(&self) -> TimeSpan {
        TimeSpan::from_s(self.time)
    }

    fn distance(&self) -> Length {
        Length::from_m(self.distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_rest_to_rest_it_is_the_textbook_polynomial() {
        let motion = MinimumJerk::new(Length::from_m(2.0), Speed::ZERO, Speed::ZERO, TimeSpan::from_s(4.0));
        for tenth in 0..=10 {
            let part = 0.1 * f64::from(tenth);
            let there = motion.state_at(TimeSpan::from_s(4.0 * part));
            let expected = 2.0 * (10.0 * part.powi(3) - 15.0 * part.powi(4) + 6.0 * part.powi(5));
            assert!((there.distance.as_m() - expected).abs() < 1e-12);
            let back = motion.time_at(Length::from_m(expected)).expect("within the motion");
            assert!((back.as_s() - 4.0 * part).abs() < 1e-4, "{part}");
        }
        // The textbook's fastest speed is 15/8 of the mean.
        let [slowest, fastest] = motion.speeds();
        assert!((fastest.as_m_per_s() - 1.875 * 0.5).abs() < 1e-12 && slowest == Speed::ZERO);
    }

    #[test]
    fn it_has_the_ends_that_were_asked_for_and_is_smooth_there() {
        let (from, to) = (Speed::from_mm_per_s(120.0), Speed::from_mm_per_s(300.0));
        let motion = MinimumJerk::new(Length::from_m(3.0), from, to, TimeSpan::from_s(11.0));
        let at = |s| motion.state_at(TimeSpan::from_s(s));
        assert!((at(11.0).distance.as_m() - 3.0).abs() < 1e-12);
        for (before, after, speed) in [(-1e-6, 1e-6, from), (11.0 - 1e-6, 11.0 + 1e-6, to)] {
            assert!((at(before).speed - speed).abs() < Speed::from_mm_per_s(1e-3));
            assert!((at(after).speed - speed).abs() < Speed::from_mm_per_s(1e-3));
            assert!(at(before).acceleration.as_m_per_s2().abs() < 1e-5);
        }
        let [slowest, fastest] = motion.speeds();
        let all = || (0..=1100).map(|n| at(f64::from(n) * 0.01).speed);
        assert!(all().all(|speed| speed >= slowest && speed <= fastest));
    }
}
