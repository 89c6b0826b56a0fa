//! Coverage: the share of values inside their intervals, with the uncertainty of that share.

use footplate_core::HALF_95;

/// A count of reports inside intervals of one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coverage {
    /// The stated probability of the intervals, 0 to 1.
    pub level: f64,
    /// Reports inside.
    pub inside: usize,
    /// All reports, at least one.
    pub of: usize,
}

impl Coverage {
    /// The share inside.
    #[must_use]
    pub fn fraction(self) -> f64 {
        self.inside as f64 / self.of as f64
    }

    /// The 95 % interval of the true probability: the score interval (Wilson, 1927), which remains valid for small
    /// counts and near 0 and 1, unlike the normal approximation.
    #[must_use]
    pub fn plausible(self) -> (f64, f64) {
        let (n, p, z) = (self.of as f64, self.fraction(), HALF_95);
        let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        ((middle - half).max(0.0), (middle + half).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_wilsons() {
        // Newcombe (1998), table I: 81 of 263 gives 0.2553 to 0.3662, 15 of 148 gives 0.0624 to 0.1605,
        // 0 of 20 gives 0 to 0.1611.
        for (inside, of, low, high) in
            [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611)]
        {
            let (found_low, found_high) = Coverage { level: 0.5, inside, of }.plausible();
            assert!((found_low - low).abs() < 5e-5 && (found_high - high).abs() < 5e-5, "{inside} of {of}");
        }
    }
}
