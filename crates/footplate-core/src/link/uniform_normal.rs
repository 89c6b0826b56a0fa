//! The distribution of a report about its prediction: normal uncertainty of the motion, uniform uncertainty of the
//! poll.
//!
//! Letters: `s` standard deviation of the normal part, `w` width of the uniform part, `F` an antiderivative
//! of the normal distribution function Φ: F(z) = z Φ(z) + φ(z). The sum of both has
//! P(X ≤ x) = s/w · (F((x + w/2)/s) − F((x − w/2)/s)) (convolution written out).
//! A normal distribution of the same variance would be wrong where it matters: with s ≪ w the central half
//! is ±w/4, not ±0.195 w.

use core::f64::consts::{FRAC_1_SQRT_2, PI};

/// A sum of a normal and a uniform variable, both with mean zero; the unit is the caller's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UniformNormal {
    /// Standard deviation of the normal part.
    pub deviation: f64,
    /// Full width of the uniform part.
    pub width: f64,
}

/// Below this ratio of one part to the other the smaller one no longer changes a quantile by 1e-6, and
/// dividing by it would only lose digits.
const NEGLIGIBLE: f64 = 1e-4;

pub(super) fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * FRAC_1_SQRT_2)
}

pub(super) fn normal_density(z: f64) -> f64 {
    libm::exp(-0.5 * z * z) / libm::sqrt(2.0 * PI)
}

/// F of the legend.
fn normal_cdf_integral(z: f64) -> f64 {
    z * normal_cdf(z) + normal_density(z)
}

impl UniformNormal {
    /// The probability of a value up to `x`.
    #[must_use]
    pub fn cdf(self, x: f64) -> f64 {
        let (s, w) = (self.deviation.abs(), self.width.abs());
        if s <= NEGLIGIBLE * w {
            return (x / w + 0.5).clamp(0.0, 1.0);
        }
        if w <= NEGLIGIBLE * s {
            return normal_cdf(x / s);
        }
        let half = 0.5 * w;
        (s / w * (normal_cdf_integral((x + half) / s) - normal_cdf_integral((x - half) / s))).clamp(0.0, 1.0)
    }

    /// The probability density at `x`, per unit of `x`.
    #[must_use]
    pub fn density(self, x: f64) -> f64 {
        let (s, w) = (self.deviation.abs(), self.width.abs());
        if s <= NEGLIGIBLE * w {
            return if x.abs() <= 0.5 * w { 1.0 / w } else { 0.0 };
        }
        if w <= NEGLIGIBLE * s {
            return normal_density(x / s) / s;
        }
        let half = 0.5 * w;
        (normal_cdf((x + half) / s) - normal_cdf((x - half) / s)) / w
    }

    /// Half the width of the central interval that holds a value with probability `level`.
    /// Symmetric, so the interval is ±this. `level` is clamped to 0…1 − 1e-12.
    #[must_use]
    pub fn half_width(self, level: f64) -> f64 {
        let (s, w) = (self.deviation.abs(), self.width.abs());
        let target = 0.5 + 0.5 * level.clamp(0.0, 1.0 - 1e-12);
        // The quantile of the sum lies below the sum of what each part alone can reach (8 s: 1 − 1e-15).
        let (mut low, mut high) = (0.0, 0.5 * w + 8.0 * s);
        // Newton from the middle, kept inside the bracket; halving is the worst case.
        let mut x = 0.5 * high * level;
        for _ in 0..60 {
            let miss = self.cdf(x) - target;
            if miss.abs() < 1e-13 || high - low <= 1e-9 * (w + s) {
                break;
            }
            if miss < 0.0 {
                low = x;
            } else {
                high = x;
            }
            let density = self.density(x);
            let newton = x - miss / density;
            x = if density > 0.0 && newton > low && newton < high { newton } else { 0.5 * (low + high) };
        }
        x
    }

    /// The value below which a share `part` of all values lies: the inverse of [`cdf`](Self::cdf).
    /// `part` is clamped to 1e-12/2 … 1 − 1e-12/2.
    #[must_use]
    pub fn quantile(self, part: f64) -> f64 {
        let from_middle = 2.0 * part - 1.0;
        libm::copysign(self.half_width(libm::fabs(from_middle)), from_middle)
    }

    /// The variance of the sum: s² + w²/12.
    #[must_use]
    pub fn variance(self) -> f64 {
        self.deviation * self.deviation + self.width * self.width / 12.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limits_are_the_uniform_and_the_normal() {
        let uniform = UniformNormal { deviation: 0.0, width: 4.0 };
        assert!((uniform.half_width(0.5) - 1.0).abs() < 1e-9);
        let normal = UniformNormal { deviation: 2.0, width: 0.0 };
        // 1.644 854 σ: the table value of the central 90 %.
        assert!((normal.half_width(0.9) - 2.0 * 1.644_853_627).abs() < 1e-6);
    }

    #[test]
    fn quantiles_of_the_normal_are_those_of_the_tables() {
        let normal = UniformNormal { deviation: 1.0, width: 0.0 };
        // Abramowitz and Stegun, 1964, table 26.5.
        for (part, z) in
            [(0.5, 0.0), (0.95, 1.644_854), (0.99, 2.326_348), (0.999, 3.090_232), (0.05, -1.644_854)]
        {
            assert!((normal.quantile(part) - z).abs() < 1e-6, "{part}: {}", normal.quantile(part));
        }
    }

    #[test]
    fn the_mixed_case_agrees_with_counting() {
        // Independent check: midpoint sums over both parts, not the closed form.
        let both = UniformNormal { deviation: 0.7, width: 3.0 };
        for x in [-2.0, -0.4, 0.0, 1.1, 2.5] {
            let (mut inside, mut all) = (0.0, 0.0);
            for i in 0..400 {
                let u = -1.5 + 3.0 * (f64::from(i) + 0.5) / 400.0;
                for j in 0..400 {
                    let z = -5.0 + 10.0 * (f64::from(j) + 0.5) / 400.0;
                    let weight = libm::exp(-0.5 * z * z);
                    all += weight;
                    if u + 0.7 * z <= x {
                        inside += weight;
                    }
                }
            }
            assert!((both.cdf(x) - inside / all).abs() < 2e-3, "at {x}");
        }
    }

    #[test]
    fn half_widths_and_probabilities_are_inverse() {
        for (deviation, width) in [(1.0, 1.0), (0.01, 1.0), (1.0, 0.01), (5.0, 70.0), (1e-9, 1e-9)] {
            let distribution = UniformNormal { deviation, width };
            for level in [0.1, 0.5, 0.9, 0.99, 0.9999] {
                let half = distribution.half_width(level);
                let held = distribution.cdf(half) - distribution.cdf(-half);
                assert!((held - level).abs() < 1e-6, "{deviation} {width} {level}: {held}");
            }
        }
    }
}
