//! A normal prediction of a quantity that is then known to be between two bounds: a prediction given a report.
//!
//! Letters: forecast N(m, s²), bounds a and b in standard deviations: α = (a − m)/s, β = (b − m)/s; Z = Φ(β) − Φ(α).
//!
//! ```text
//! mean      m + s (φ(α) − φ(β)) / Z
//! variance  s² (1 + (α φ(α) − β φ(β)) / Z − ((φ(α) − φ(β)) / Z)²)
//! ```
//!
//! (Johnson, Kotz and Balakrishnan, Continuous Univariate Distributions 1, 1994, section 10.1.) A window that is much
//! wider than the uncertainty of the prediction contains no information, wherever its middle is.

use super::uniform_normal::{normal_cdf, normal_density};

/// Beyond so many standard deviations differences of Φ lose their digits; the tail is exponential there.
const FAR: f64 = 6.0;
/// A report that reduces a variance by less than this part contains no information.
const NOTHING: f64 = 1e-6;

/// A forecast and the bounds of what was then reported; the unit is the caller's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruncatedNormal {
    /// Mean of the forecast.
    pub mean: f64,
    /// Variance of the forecast.
    pub variance: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound, not below the lower one.
    pub high: f64,
}

impl TruncatedNormal {
    /// Mean and variance of the quantity, given that it lies within the bounds.
    ///
    /// The variance is never less than that after a normal report of the same width (variance width²/12): a forecast
    /// that lies outside the bounds was less accurate than stated, and must not gain certainty from that.
    #[must_use]
    pub fn moments(self) -> (f64, f64) {
        let s = libm::sqrt(self.variance.max(f64::MIN_POSITIVE));
        let (alpha, beta) = ((self.low - self.mean) / s, (self.high - self.mean) / s);
        let (shift, share) = if alpha > FAR {
            (alpha + 1.0 / alpha, 1.0 / (alpha * alpha))
        } else if beta < -FAR {
            (beta + 1.0 / beta, 1.0 / (beta * beta))
        } else {
            let inside = (normal_cdf(beta) - normal_cdf(alpha)).max(f64::MIN_POSITIVE);
            let (at_low, at_high) = (normal_density(alpha), normal_density(beta));
            let shift = (at_low - at_high) / inside;
            // At infinite bounds α φ(α) is zero.
            let slope = |z: f64, density: f64| if density > 0.0 { z * density } else { 0.0 };
            let spread = 1.0 + (slope(alpha, at_low) - slope(beta, at_high)) / inside - shift * shift;
            (shift, spread)
        };
        let width = self.high - self.low;
        let report = width * width / 12.0;
        let normal = if report.is_finite() { report / (self.variance + report) } else { 1.0 };
        let mean = (self.mean + s * shift).clamp(self.low, self.high);
        (mean, self.variance * share.max(normal).min(1.0))
    }

    /// The normal measurement (value, variance) that takes the forecast to the same [`moments`](Self::moments): what a
    /// filter is given.
    #[must_use]
    pub fn as_measurement(self) -> (f64, f64) {
        let (mean, variance) = self.moments();
        let left = (variance / self.variance.max(f64::MIN_POSITIVE)).min(1.0 - NOTHING);
        // s² r/(s² + r) is left of s², so r is s² times this.
        let times = left / (1.0 - left);
        (self.mean + (mean - self.mean) * (1.0 + times), self.variance * times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(mean: f64, sd: f64, low: f64, high: f64) -> TruncatedNormal {
        TruncatedNormal { mean, variance: sd * sd, low, high }
    }

    #[test]
    fn moments_agree_with_sums_over_the_density() {
        for (mean, sd, low, high) in
            [(0.0, 1.0, -1.0, 1.0), (0.3, 2.0, -1.0, 4.0), (-2.0, 1.0, -1.0, 5.0), (9.0, 1.0, 0.0, 5.0)]
        {
            let (mut all, mut first, mut second) = (0.0, 0.0, 0.0);
            for i in 0..200_000 {
                let x = low + (high - low) * (f64::from(i) + 0.5) / 200_000.0;
                let weight = libm::exp(-0.5 * (x - mean) * (x - mean) / (sd * sd));
                (all, first, second) = (all + weight, first + weight * x, second + weight * x * x);
            }
            let (exact, spread) = (first / all, second / all - first / all * (first / all));
            let (found, variance) = of(mean, sd, low, high).moments();
            assert!((found - exact).abs() < 1e-6, "{mean} {sd}: {found} for {exact}");
            assert!(variance >= spread - 1e-6, "{mean} {sd}: {variance} for {spread}");
        }
    }

    #[test]
    fn a_wide_window_does_not_change_a_good_forecast_wherever_its_middle_is() {
        // 0.8 s of a lost reply at 500 mm/s, the forecast good to 8 mm and 60 mm from the end of the window.
        let (mean, variance) = of(0.0, 8.0, -340.0, 60.0).moments();
        assert!(mean.abs() < 1e-6 && (variance - 64.0).abs() < 0.4, "{mean} {variance}");
    }

    #[test]
    fn a_narrow_window_dates_a_poor_forecast() {
        let (mean, variance) = of(0.0, 500.0, 100.0, 130.0).moments();
        assert!((mean - 115.0).abs() < 0.1 && (variance - 75.0).abs() < 0.1, "{mean} {variance}");
    }

    #[test]
    fn the_measurement_takes_a_filter_to_the_same_moments() {
        for (mean, sd, low, high) in [
            (0.0, 5.0, -15.0, 15.0),
            (20.0, 8.0, -15.0, 15.0),
            (0.0, 1.0, -400.0, 10.0),
            (90.0, 3.0, 0.0, 20.0),
        ] {
            let forecast = of(mean, sd, low, high);
            let (value, noise) = forecast.as_measurement();
            let gain = forecast.variance / (forecast.variance + noise);
            let (expected, variance) = forecast.moments();
            assert!((mean + gain * (value - mean) - expected).abs() < 1e-3, "{forecast:?}");
            assert!((forecast.variance * (1.0 - gain) - variance).abs() < 1e-3 * sd * sd, "{forecast:?}");
        }
    }
}
