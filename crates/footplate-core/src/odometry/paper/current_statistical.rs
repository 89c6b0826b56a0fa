//! How speed and acceleration go on over one period, if acceleration wanders about its present mean.
//!
//! The current statistical model (Zhou and Kumar, 1984) in the form for speed and acceleration: with the state
//! x = (v, a), the manoeuvre frequency α, the period T and the mean acceleration ā,
//!
//! ```text
//! x' = A x + U ā + w,   A = | 1  (1 − e^−αT)/α |   U = | T − (1 − e^−αT)/α |   cov w = Q(α, σ², T)
//!                           | 0       e^−αT    |       |     1 − e^−αT     |
//! ```
//!
//! The closed form of Q subtracts numbers that agree in almost all digits where αT is small: one entry is off by 3 %
//! at αT = 1e-5 and by a factor of 79 at 1e-6. Written in `s` = tanh(αT/2) nothing is subtracted at all. With
//! `h` = artanh(s)/s and `w` = (h − 1)/s² = 1/3 + s²/5 + s⁴/7 + …
//!
//! ```text
//! (1 − e^−αT)/α = T / ((1 + s) h)         e^−αT = (1 − s)/(1 + s)
//! Q = c | T² (1 + (1 + s)² w)/h²   2T/h |      c = σ² s/(1 + s)²       det Q = (2 c T (1 + s)/h)² w > 0
//!       |         2T/h               4  |
//! ```
//!
//! Better still, `s` is what adaptation measures (`manoeuvre`), so that no exponential is needed in any period.

use super::covariance::Covariance;
use crate::odometry::sound::sound_period;

/// The largest s² for which `w` comes from its series: twelve terms leave 2e-16 of it. Up to 0.51 s at 1/s or
/// 0.1 s at 5/s there is nothing else.
const SERIES_UP_TO: f64 = 1.0 / 16.0;

/// Beyond so much αT the mean is all that is left, and what follows stays finite.
const LARGEST_PRODUCT: f64 = 1e6;

/// 1/3 + y/5 + y²/7 + … for y up to [`SERIES_UP_TO`], as three sums that do not wait for each other.
fn series(y: f64) -> f64 {
    let (y2, y4) = (y * y, y * y * (y * y));
    let low = (1.0 / 3.0 + y / 5.0) + y2 * (1.0 / 7.0 + y / 9.0);
    let middle = (1.0 / 11.0 + y / 13.0) + y2 * (1.0 / 15.0 + y / 17.0);
    let high = (1.0 / 19.0 + y / 21.0) + y2 * (1.0 / 23.0 + y / 25.0);
    low + y4 * (middle + y4 * high)
}

/// The current statistical model at one manoeuvre frequency, variance and period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurrentStatistical {
    period: f64,
    /// σ², the variance of the acceleration about its mean.
    variance: f64,
    /// tanh(αT/2).
    s: f64,
    /// artanh(s)/s.
    h: f64,
    /// (h − 1)/s².
    w: f64,
}

impl CurrentStatistical {
    /// The model of a manoeuvre frequency (1/s), a variance of acceleration ((m/s²)²) and a period (s).
    ///
    /// What is negative or no number counts as 0; at frequency 0 acceleration stays what it is.
    #[must_use]
    pub fn new(frequency: f64, variance: f64, period: f64) -> Self {
        let period = sound_period(period);
        let x = (frequency.max(0.0) * period).min(LARGEST_PRODUCT);
        let s = half_tangent(x);
        let y = s * s;
        let w = if y <= SERIES_UP_TO { series(y) } else { (0.5 * x / s - 1.0) / y };
        Self { period, variance: variance.max(0.0), s, h: 1.0 + y * w, w }
    }

    /// The model of tanh(αT/2), from 0 to 1 (exclusively), a variance and a period, both sound.
    pub(super) fn from_half_tangent(s: f64, variance: f64, period: f64) -> Self {
        let y = s * s;
        let w = if y <= SERIES_UP_TO { series(y) } else { (libm::atanh(s) / s - 1.0) / y };
        Self { period, variance, s, h: 1.0 + y * w, w }
    }

    /// The manoeuvre frequency α (1/s): how quickly acceleration returns to its mean.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        2.0 * self.s * self.h / self.period.max(f64::MIN_POSITIVE)
    }

    /// The variance of the acceleration about its mean.
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.variance
    }

    /// The second column of A: what one m/s² does to speed and acceleration. The first is (1, 0).
    #[must_use]
    pub fn of_acceleration(&self) -> [f64; 2] {
        let part = 1.0 / ((1.0 + self.s) * self.h);
        [self.period * part, (1.0 - self.s) * (self.h * part)]
    }

    /// U: what one m/s² of mean acceleration does to speed and acceleration.
    #[must_use]
    pub fn of_mean(&self) -> [f64; 2] {
        let [speed, acceleration] = self.of_acceleration();
        [self.period - speed, 1.0 - acceleration]
    }

    /// Q: what chance adds to the covariance of speed and acceleration.
    #[must_use]
    pub fn process_noise(&self) -> Covariance {
        self.process_noise_up_to(f64::INFINITY)
    }

    /// The same, made smaller where it would give acceleration more variance than so much.
    pub(super) fn process_noise_up_to(&self, most: f64) -> Covariance {
        let wide = (1.0 + self.s) * (1.0 + self.s);
        let c = (self.variance * self.s / wide).min(0.25 * most);
        let time = self.period / self.h;
        Covariance {
            speed: c * (time * time) * (1.0 + wide * self.w),
            mixed: 2.0 * c * time,
            acceleration: 4.0 * c,
        }
    }
}

/// tanh(x/2) for x ≥ 0, with every digit where x is small.
pub(super) fn half_tangent(x: f64) -> f64 {
    let fallen = -libm::expm1(-x);
    fallen / (2.0 - fallen)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(left: f64, right: f64, within: f64) -> bool {
        (left - right).abs() <= within * right.abs()
    }

    /// The textbook's series of Q / (2 α σ²) for small αT: [speed, mixed, acceleration].
    fn textbook_series(alpha: f64, t: f64) -> [f64; 3] {
        let x = alpha * t;
        let sum = |c: [f64; 5]| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
        [
            t.powi(3) * sum([1.0 / 3.0, -0.25, 7.0 / 60.0, -1.0 / 24.0, 31.0 / 2520.0]),
            t.powi(2) * sum([0.5, -0.5, 7.0 / 24.0, -0.125, 31.0 / 720.0]),
            t * sum([1.0, -1.0, 2.0 / 3.0, -1.0 / 3.0, 2.0 / 15.0]),
        ]
    }

    /// The textbook's closed form of the same.
    fn textbook_closed(alpha: f64, t: f64) -> [f64; 3] {
        let x = alpha * t;
        let fallen = -libm::expm1(-x);
        [
            (2.0 * (x - fallen) - fallen * fallen) / (2.0 * alpha.powi(3)),
            fallen * fallen / (2.0 * alpha.powi(2)),
            -libm::expm1(-2.0 * x) / (2.0 * alpha),
        ]
    }

    fn entries(q: Covariance) -> [f64; 3] {
        [q.speed, q.mixed, q.acceleration]
    }

    #[test]
    fn the_published_example_is_met() {
        // A toolbox's documented example: time constant 20 s, period 1 s, standard deviation 1 m/s².
        let model = CurrentStatistical::new(1.0 / 20.0, 1.0, 1.0);
        let [speed, acceleration] = model.of_acceleration();
        assert!((speed - 0.9754).abs() < 5e-5 && (acceleration - 0.9512).abs() < 5e-5);
        let [speed, acceleration] = model.of_mean();
        assert!((speed - 0.02459).abs() < 5e-6 && (acceleration - 0.04877).abs() < 5e-6);
        let q = model.process_noise();
        assert!((q.speed - 0.0321).abs() < 5e-5);
        assert!((q.mixed - 0.0476).abs() < 5e-5);
        assert!((q.acceleration - 0.0952).abs() < 5e-5);
        assert!(close(model.frequency(), 0.05, 1e-14));
    }

    #[test]
    fn both_forms_of_the_textbook_are_met_and_agree_where_they_meet() {
        for period in [0.01, 0.05, 1.0] {
            for x in [1e-8, 1e-6, 1e-4, 9.999e-3, 1e-2, 0.1, 0.505, 0.52, 2.5, 20.0, 50.0] {
                let alpha = x / period;
                let ours = CurrentStatistical::new(alpha, 0.3, period);
                let textbook =
                    if x <= 1e-2 { textbook_series(alpha, period) } else { textbook_closed(alpha, period) };
                for (ours, textbook) in entries(ours.process_noise()).into_iter().zip(textbook) {
                    assert!(close(ours, 0.6 * alpha * textbook, 1e-9), "αT = {x}: {ours} {textbook}");
                }
                let [speed, acceleration] = ours.of_acceleration();
                assert!(close(speed, -libm::expm1(-x) / alpha, 1e-12), "αT = {x}");
                assert!((acceleration - libm::exp(-x)).abs() < 1e-12, "αT = {x}");
            }
            let at_the_meeting =
                [textbook_series(0.01 / period, period), textbook_closed(0.01 / period, period)];
            for (series, closed) in at_the_meeting[0].into_iter().zip(at_the_meeting[1]) {
                assert!(close(series, closed, 1e-7));
            }
        }
    }

    #[test]
    fn series_and_closed_form_of_w_meet() {
        let s = SERIES_UP_TO.sqrt();
        let closed = (libm::atanh(s) / s - 1.0) / (s * s);
        assert!(close(series(s * s), closed, 1e-13), "{} {closed}", series(s * s));
    }

    #[test]
    fn the_model_of_a_tangent_is_that_of_the_frequency() {
        for x in [1e-7, 1e-3, 0.2, 0.6, 3.0, 10.0] {
            let (by_frequency, by_tangent) = (
                CurrentStatistical::new(x / 0.05, 0.25, 0.05),
                CurrentStatistical::from_half_tangent(half_tangent(x), 0.25, 0.05),
            );
            let both =
                entries(by_frequency.process_noise()).into_iter().zip(entries(by_tangent.process_noise()));
            for (frequency, tangent) in both {
                assert!(close(frequency, tangent, 1e-10), "αT = {x}");
            }
        }
    }

    #[test]
    fn chance_is_positive_definite_at_every_frequency() {
        for step in 0..=2000 {
            let x = 1e-8 * libm::pow(5e9, f64::from(step) / 2000.0);
            let q = CurrentStatistical::new(x / 0.05, 1.0, 0.05).process_noise();
            assert!(q.speed > 0.0 && q.acceleration > 0.0, "αT = {x}");
            assert!(q.speed * q.acceleration - q.mixed * q.mixed > 0.0, "αT = {x}");
        }
    }

    #[test]
    fn chance_is_the_sum_of_what_every_instant_adds() {
        // Q = ∫ g gᵀ dt · 2 α σ² with g = ((1 − e^−αt)/α, e^−αt), by the midpoint rule.
        let (alpha, variance, period) = (3.0, 0.4, 0.2);
        let steps = 20_000;
        let mut sum = [0.0; 3];
        for step in 0..steps {
            let t = (f64::from(step) + 0.5) * period / f64::from(steps);
            let (speed, acceleration) = ((1.0 - libm::exp(-alpha * t)) / alpha, libm::exp(-alpha * t));
            for (sum, term) in
                sum.iter_mut().zip([speed * speed, speed * acceleration, acceleration * acceleration])
            {
                *sum += term * 2.0 * alpha * variance * period / f64::from(steps);
            }
        }
        let q = CurrentStatistical::new(alpha, variance, period).process_noise();
        for (ours, sum) in entries(q).into_iter().zip(sum) {
            assert!(close(ours, sum, 1e-8), "{ours} {sum}");
        }
    }

    #[test]
    fn what_is_no_frequency_or_period_moves_nothing() {
        for absurd in [f64::NAN, -1.0, f64::NEG_INFINITY] {
            let still = CurrentStatistical::new(0.05, 0.25, absurd);
            assert_eq!((still.of_acceleration(), still.process_noise()), ([0.0, 1.0], Covariance::ZERO));
            let constant = CurrentStatistical::new(absurd, 0.25, 0.05);
            assert_eq!((constant.of_acceleration(), constant.of_mean()), ([0.05, 1.0], [0.0, 0.0]));
        }
        let hour = CurrentStatistical::new(5.0, 0.25, f64::INFINITY).process_noise();
        assert!(hour.speed.is_finite() && hour.speed > 0.0);
    }
}
