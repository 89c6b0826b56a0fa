//! What one period does to speed, acceleration and how well they are known, before anything is measured.

use super::covariance::Covariance;
use super::current_statistical::CurrentStatistical;
use crate::odometry::sound::sound_period;

/// One period of a motion model, worked out once and applied to every filter that follows the same train.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionStep {
    /// What the mean acceleration adds to the speed if the state's own has nothing beyond it.
    distance_of_mean: f64,
    mean: f64,
    /// What acceleration beyond the mean does to speed and acceleration.
    of_excess: [f64; 2],
    /// What an error of acceleration does to the errors of both.
    of_error: [f64; 2],
    noise: Covariance,
}

impl MotionStep {
    /// Acceleration wanders freely: over T its variance grows by `q` T, where `q` is in m²/s⁵.
    #[must_use]
    pub fn wandering(q: f64, period: f64) -> Self {
        let period = sound_period(period);
        let errors = [period, 1.0];
        Self {
            distance_of_mean: 0.0,
            mean: 0.0,
            of_excess: errors,
            of_error: errors,
            noise: wandering_noise(q * period, period),
        }
    }

    /// The current statistical model about a mean acceleration. `of_error` says what an error of acceleration does
    /// to the errors of speed and acceleration, and `gained` how much variance acceleration gains at least and at
    /// most (m²/s⁴).
    pub(super) fn about_mean(
        model: &CurrentStatistical,
        mean: f64,
        of_error: [f64; 2],
        period: f64,
        (least, most): (f64, f64),
    ) -> Self {
        let noise = model.process_noise_up_to(most);
        let missing = (least - noise.acceleration).max(0.0);
        Self {
            distance_of_mean: period,
            mean,
            of_excess: model.of_acceleration(),
            of_error,
            noise: noise.plus(wandering_noise(missing, period)),
        }
    }

    /// What becomes of speed and acceleration: A x + U ā, written as the mean and what goes beyond it.
    #[must_use]
    pub fn state(&self, [speed, acceleration]: [f64; 2]) -> [f64; 2] {
        let excess = acceleration - self.mean;
        let [to_speed, to_acceleration] = self.of_excess;
        [speed + self.distance_of_mean * self.mean + to_speed * excess, self.mean + to_acceleration * excess]
    }

    /// What becomes of the covariance: F P Fᵀ + Q.
    #[must_use]
    pub fn covariance(&self, p: Covariance) -> Covariance {
        let [to_speed, to_acceleration] = self.of_error;
        let mixed = p.mixed + to_speed * p.acceleration;
        let after = Covariance {
            speed: p.speed + to_speed * (p.mixed + mixed) + self.noise.speed,
            mixed: to_acceleration * mixed + self.noise.mixed,
            acceleration: to_acceleration * to_acceleration * p.acceleration + self.noise.acceleration,
        };
        after.bounded()
    }

    /// Q: what chance adds to the covariance.
    #[must_use]
    pub fn noise(&self) -> Covariance {
        self.noise
    }
}

/// The noise of an acceleration whose variance grows evenly, by so much over the period.
fn wandering_noise(gained: f64, period: f64) -> Covariance {
    Covariance {
        speed: gained * (period * period) * (1.0 / 3.0),
        mixed: gained * (0.5 * period),
        acceleration: gained,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANY: (f64, f64) = (0.0, f64::INFINITY);

    #[test]
    fn the_mean_and_what_goes_beyond_it_are_a_x_and_u() {
        let model = CurrentStatistical::new(2.0, 0.3, 0.05);
        let step = MotionStep::about_mean(&model, 0.4, [0.05, 1.0], 0.05, ANY);
        let ([a12, a22], [u1, u2]) = (model.of_acceleration(), model.of_mean());
        let [speed, acceleration] = step.state([20.0, -0.9]);
        assert!((speed - (20.0 - 0.9 * a12 + 0.4 * u1)).abs() < 1e-13);
        assert!((acceleration - (-0.9 * a22 + 0.4 * u2)).abs() < 1e-13);
    }

    #[test]
    fn the_floor_is_what_acceleration_gains_at_least() {
        let quiet = CurrentStatistical::new(1e-3, 1e-4, 0.05);
        let step = MotionStep::about_mean(&quiet, 0.0, [0.05, 1.0], 0.05, (0.001, f64::INFINITY));
        assert!((step.noise().acceleration - 0.001).abs() < 1e-18);
        let lively = CurrentStatistical::new(5.0, 1.0, 0.05);
        let step = MotionStep::about_mean(&lively, 0.0, [0.05, 1.0], 0.05, (0.001, f64::INFINITY));
        assert_eq!(step.noise(), lively.process_noise());
    }

    #[test]
    fn a_wandering_acceleration_is_the_limit_of_a_slow_one() {
        // 2 α σ² is the rate at which the variance of acceleration grows while αT is small.
        let slow = CurrentStatistical::new(1e-9, 0.02 / 2e-9, 0.05);
        let (slow, free) = (slow.process_noise(), MotionStep::wandering(0.02, 0.05).noise());
        let off = |slow: f64, free: f64| (slow / free - 1.0).abs();
        assert!(off(slow.speed, free.speed) < 1e-9);
        assert!(off(slow.mixed, free.mixed) < 1e-9);
        assert!(off(slow.acceleration, free.acceleration) < 1e-9);
    }

    #[test]
    fn a_covariance_goes_on_as_the_product_of_matrices() {
        let p = Covariance { speed: 0.04, mixed: 0.02, acceleration: 0.09 };
        let model = CurrentStatistical::new(4.0, 0.3, 0.05);
        let [f, g] = model.of_acceleration();
        let step = MotionStep::about_mean(&model, 0.0, [f, g], 0.05, ANY);
        // F P Fᵀ with F = | 1 f | , multiplied out by hand.
        //                 | 0 g |
        let (after, q) = (step.covariance(p), model.process_noise());
        assert!((after.speed - (0.04 + 2.0 * f * 0.02 + f * f * 0.09 + q.speed)).abs() < 1e-15);
        assert!((after.mixed - (g * 0.02 + f * g * 0.09 + q.mixed)).abs() < 1e-15);
        assert!((after.acceleration - (g * g * 0.09 + q.acceleration)).abs() < 1e-15);
    }
}
