//! Robust weights of large residuals: one outlier costs one outlier.
//!
//! The cost is quadratic at first, linear beyond (Huber, 1964), and logarithmic in the end (Cauchy), so that gross errors
//! pull ever less. Cost and slope are continuous.

/// Limits of the residuals, in standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RobustWeight {
    /// Beyond this a residual counts linearly.
    huber: f64,
    /// Beyond this it has another cause: a train that was pushed, a sensor that another train closed.
    wild: f64,
}

impl RobustWeight {
    /// For sensors: their times scatter within a poll, without tails.
    pub(super) const SENSORS: Self = Self { huber: 2.5, wild: 5.0 };
    /// For stops and starts: dirt, load and temperature give them tails, and few are alike.
    pub(super) const STOPS: Self = Self { huber: 1.5, wild: 3.0 };

    /// The weight of a measurement in a least-squares step (iteratively reweighted).
    pub(super) fn weight(self, size: f64) -> f64 {
        if size <= self.huber {
            1.0
        } else if size <= self.wild {
            self.huber / size
        } else {
            self.huber * self.wild / (size * size)
        }
    }

    /// The cost, which is the square of a small residual.
    pub(super) fn cost(self, size: f64) -> f64 {
        if size <= self.huber {
            return size * size;
        }
        let linear = self.huber * (2.0 * size.min(self.wild) - self.huber);
        linear + 2.0 * self.huber * self.wild * libm::log((size / self.wild).max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_the_cost_is_twice_weight_times_residual() {
        for robust in [RobustWeight::SENSORS, RobustWeight::STOPS] {
            for size in [0.5, 1.4, 1.6, 2.4, 2.6, 2.9, 3.1, 4.9, 5.1, 30.0] {
                let slope = (robust.cost(size + 1e-6) - robust.cost(size - 1e-6)) / 2e-6;
                assert!((slope - 2.0 * size * robust.weight(size)).abs() < 1e-6, "{size}");
            }
        }
    }
}
