//! How well speed and acceleration are known, and how they are known together.

/// Least part of `speed · acceleration` that a determinant is taken for: beyond it, rounding is all that is left of
/// the difference of two products of 52-bit numbers.
const LEAST_DETERMINANT: f64 = 1e-12;

/// Variances beyond which more ignorance means nothing, (m/s)² and (m/s²)²: a thousand times the fastest train, and
/// of an acceleration of which nothing is known. They keep a filter without measurements finite for ever.
const MOST: (f64, f64) = (1e10, 1e6);

/// A symmetric positive definite 2 × 2 matrix over speed and acceleration, in SI units.
///
/// As a covariance its entries are (m/s)², m²/s³ and (m/s²)²; the inverse of one, its information, has the same form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Covariance {
    /// Variance of the speed.
    pub speed: f64,
    /// What speed and acceleration have in common.
    pub mixed: f64,
    /// Variance of the acceleration.
    pub acceleration: f64,
}

impl Covariance {
    /// Nothing at all: the neutral element of [`plus`](Self::plus).
    pub const ZERO: Self = Self { speed: 0.0, mixed: 0.0, acceleration: 0.0 };

    /// Speed and acceleration that have nothing to do with each other.
    #[must_use]
    pub const fn diagonal(speed: f64, acceleration: f64) -> Self {
        Self { speed, mixed: 0.0, acceleration }
    }

    /// Every entry times the same number.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            speed: self.speed * factor,
            mixed: self.mixed * factor,
            acceleration: self.acceleration * factor,
        }
    }

    /// Entry by entry.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            speed: self.speed + other.speed,
            mixed: self.mixed + other.mixed,
            acceleration: self.acceleration + other.acceleration,
        }
    }

    /// Positive whatever rounding did to it.
    #[must_use]
    pub fn determinant(self) -> f64 {
        let product = self.speed * self.acceleration;
        let (difference, least) = (product - self.mixed * self.mixed, LEAST_DETERMINANT * product);
        if difference > least { difference } else { least }
    }

    /// The information matrix of a covariance, and the inverse.
    #[must_use]
    pub fn inverse(self) -> Self {
        let scale = 1.0 / self.determinant();
        Self {
            speed: self.acceleration * scale,
            mixed: -self.mixed * scale,
            acceleration: self.speed * scale,
        }
    }

    /// The matrix applied to speed and acceleration.
    #[must_use]
    pub fn applied(self, [speed, acceleration]: [f64; 2]) -> [f64; 2] {
        [
            self.speed * speed + self.mixed * acceleration,
            self.mixed * speed + self.acceleration * acceleration,
        ]
    }

    /// The same, with variances that are no larger than what means something.
    pub(super) fn bounded(self) -> Self {
        let (speed, acceleration) = MOST;
        if self.speed <= speed && self.acceleration <= acceleration { self } else { self.shrunk() }
    }

    /// Each quantity in a larger unit: what they have in common stays the same part of both.
    #[cold]
    fn shrunk(self) -> Self {
        let (most_speed, most_acceleration) = MOST;
        let speed = self.speed.min(most_speed);
        let acceleration = self.acceleration.min(most_acceleration);
        let shrink = libm::sqrt((speed / self.speed) * (acceleration / self.acceleration));
        Self { speed, mixed: self.mixed * shrink, acceleration }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_changes_nothing() {
        let p = Covariance { speed: 0.04, mixed: 0.03, acceleration: 0.09 };
        let [speed, acceleration] = p.inverse().applied(p.applied([3.0, -7.0]));
        assert!((speed - 3.0).abs() < 1e-12 && (acceleration + 7.0).abs() < 1e-12);
        // 0.09 / (0.04 · 0.09 − 0.03²) by hand.
        assert!((p.inverse().speed - 33.333_333_333_333_3).abs() < 1e-9);
    }

    #[test]
    fn a_matrix_that_rounding_made_indefinite_still_has_an_inverse() {
        let p = Covariance { speed: 1.0, mixed: 1.0 + 1e-15, acceleration: 1.0 };
        assert!(p.determinant() > 0.0);
        assert!(p.inverse().speed.is_finite());
    }

    #[test]
    fn sums_multiples_and_determinants_are_those_of_matrices() {
        let p = Covariance { speed: 2.0, mixed: 1.0, acceleration: 3.0 };
        assert_eq!(p.determinant(), 5.0);
        assert_eq!(p.times(4.0), Covariance { speed: 8.0, mixed: 4.0, acceleration: 12.0 });
        let sum = p.plus(Covariance { speed: 0.5, mixed: -3.0, acceleration: 7.0 });
        assert_eq!(sum, Covariance { speed: 2.5, mixed: -2.0, acceleration: 10.0 });
        assert_eq!(p.plus(Covariance::ZERO), p);
        assert_eq!(Covariance::diagonal(2.0, 3.0), Covariance { mixed: 0.0, ..p });
        // Of a product of 6 no less than 6e-12 is left.
        assert_eq!(Covariance { mixed: 3.0, ..p }.determinant(), 6e-12);
    }

    #[test]
    fn one_variance_beyond_its_limit_takes_what_both_have_in_common_with_it() {
        let within = Covariance { speed: 1e10, mixed: 2.0, acceleration: 1e6 };
        assert_eq!(within.bounded(), within);
        // A quarter of a variance is half of what is in common.
        let halved = Covariance { mixed: 1.0, ..within };
        assert_eq!(Covariance { speed: 4e10, ..within }.bounded(), halved);
        assert_eq!(Covariance { acceleration: 4e6, ..within }.bounded(), halved);
    }

    #[test]
    fn shrinking_keeps_the_correlation() {
        let p = Covariance { speed: 4e14, mixed: 1e11, acceleration: 1e8 };
        let correlation = |p: Covariance| p.mixed / (p.speed * p.acceleration).sqrt();
        let shrunk = p.bounded();
        assert_eq!((shrunk.speed, shrunk.acceleration), MOST);
        assert!((correlation(shrunk) - correlation(p)).abs() < 1e-12);
    }
}
