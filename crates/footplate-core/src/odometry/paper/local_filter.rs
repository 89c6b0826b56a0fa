//! A Kalman filter for speed and acceleration that takes one measured speed a period.
//!
//! Letters: x = (v, a) the state, P its covariance, z the speed measured, r its variance, s = P₁₁ + r the variance
//! of the innovation z − v.
//!
//! With a scalar measurement of the speed the covariance after it can be written without a difference,
//!
//! ```text
//! P₁₁' = r P₁₁/s      P₁₂' = r P₁₂/s      P₂₂' = (r P₂₂ + det P)/s
//! ```
//!
//! so it stays symmetric and positive whatever is rounded; it equals the form of Bucy and Joseph (1968). A
//! measurement that is no number, or that no train can mean, is refused: its verdict says so, and the state stays.

use super::covariance::Covariance;
use super::motion_step::MotionStep;

/// Speeds that a measurement may have (m/s): five times what any wheel on rails has.
const LARGEST_SPEED: f64 = 1e3;

/// Variances that a measurement may have, (m/s)²: from the roundness of a wheel to nothing known at all.
const VARIANCES: (f64, f64) = (1e-12, 1e12);

/// Variance of the acceleration of a train that has just been met, (m/s²)².
const ACCELERATION_VARIANCE_AT_FIRST: f64 = 1.0;

/// A speed that was measured, and how well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredSpeed {
    /// The speed (m/s).
    pub speed: f64,
    /// Its variance ((m/s)²).
    pub variance: f64,
}

impl MeasuredSpeed {
    /// Nothing was measured.
    pub const MISSING: Self = Self { speed: 0.0, variance: f64::INFINITY };

    /// Whether a filter can take it.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        let (least, most) = VARIANCES;
        self.speed.abs() <= LARGEST_SPEED && self.variance >= least && self.variance <= most
    }
}

/// How surprising a measurement was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// What was measured less what was expected (m/s); 0 if nothing was taken.
    pub value: f64,
    /// The variance it was expected to have ((m/s)²), measurement included; that of the prediction if nothing was
    /// taken.
    pub variance: f64,
    /// Whether the measurement was taken. One that is missing, no number or beyond any train is not.
    pub taken: bool,
}

impl Innovation {
    /// The normalised innovation squared: 1 on average if the filter knows what it knows.
    #[must_use]
    pub fn squared(&self) -> f64 {
        self.value * self.value / self.variance
    }
}

/// Speed and acceleration, and how well they are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalFilter {
    /// Speed (m/s) and acceleration (m/s²).
    pub state: [f64; 2],
    /// Their covariance.
    pub covariance: Covariance,
}

impl LocalFilter {
    /// A train that was met at this speed; its acceleration could be anything a train does.
    #[must_use]
    pub fn starting_at(measured: MeasuredSpeed) -> Self {
        let known = measured.is_usable();
        let (_, unknown) = VARIANCES;
        let speed = if known { measured.speed } else { 0.0 };
        let variance = if known { measured.variance } else { unknown };
        Self {
            state: [speed, 0.0],
            covariance: Covariance::diagonal(variance, ACCELERATION_VARIANCE_AT_FIRST).bounded(),
        }
    }

    /// Lets one period go by.
    pub fn predict(&mut self, step: &MotionStep) {
        self.state = step.state(self.state);
        self.covariance = step.covariance(self.covariance);
    }

    /// Folds in one measurement and says how surprising it was.
    pub fn update(&mut self, measured: MeasuredSpeed) -> Innovation {
        self.update_with_share(measured, 1.0)
    }

    /// The same with a measurement that has only so large a share: its variance is divided by it.
    pub(super) fn update_with_share(&mut self, measured: MeasuredSpeed, share: f64) -> Innovation {
        if !measured.is_usable() {
            return self.refuse();
        }
        let [speed, acceleration] = self.state;
        let p = self.covariance;
        let r = measured.variance / share;
        let value = measured.speed - speed;
        let variance = p.speed + r;
        let inverse = 1.0 / variance;
        let surprise = value * inverse;
        self.state = [speed + p.speed * surprise, acceleration + p.mixed * surprise];
        let kept = r * inverse;
        self.covariance = Covariance {
            speed: p.speed * kept,
            mixed: p.mixed * kept,
            acceleration: p.acceleration * kept + p.determinant() * inverse,
        };
        Innovation { value, variance, taken: true }
    }

    /// What nothing corrects drifts; beyond any train it would outrun its own covariance.
    #[cold]
    fn refuse(&mut self) -> Innovation {
        let [speed, acceleration] = self.state;
        self.state = [speed.clamp(-LARGEST_SPEED, LARGEST_SPEED), acceleration];
        Innovation { value: 0.0, variance: self.covariance.speed, taken: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn filter() -> LocalFilter {
        LocalFilter {
            state: [20.0, 0.3],
            covariance: Covariance { speed: 0.04, mixed: 0.01, acceleration: 0.09 },
        }
    }

    #[test]
    fn an_update_is_that_of_the_textbook() {
        let mut filter = filter();
        let innovation = filter.update(MeasuredSpeed { speed: 20.5, variance: 0.06 });
        // s = 0.1, k = (0.4, 0.1), by hand; P' = (I − k h) P.
        assert!((innovation.value - 0.5).abs() < 1e-15 && (innovation.variance - 0.1).abs() < 1e-15);
        assert!((innovation.squared() - 2.5).abs() < 1e-13);
        let [speed, acceleration] = filter.state;
        assert!((speed - 20.2).abs() < 1e-13 && (acceleration - 0.35).abs() < 1e-13);
        let p = filter.covariance;
        assert!((p.speed - 0.024).abs() < 1e-15);
        assert!((p.mixed - 0.006).abs() < 1e-15);
        assert!((p.acceleration - 0.089).abs() < 1e-15);
    }

    #[test]
    fn what_no_train_can_mean_is_refused_and_said_to_be() {
        for speed in [f64::NAN, f64::INFINITY, -1e9, 1e308] {
            let mut refusing = filter();
            let innovation = refusing.update(MeasuredSpeed { speed, variance: 0.06 });
            assert_eq!((refusing, innovation.taken, innovation.value), (filter(), false, 0.0));
        }
        for variance in [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e-300] {
            let mut refusing = filter();
            let innovation = refusing.update(MeasuredSpeed { speed: 20.0, variance });
            assert_eq!((refusing, innovation.taken), (filter(), false));
            assert!(LocalFilter::starting_at(MeasuredSpeed { speed: 20.0, variance }).covariance.speed > 1e9);
        }
    }

    #[test]
    fn without_measurements_it_stays_finite_for_a_year() {
        let mut filter = filter();
        for _ in 0..60 * 24 * 365 {
            filter.predict(&MotionStep::wandering(3.0, 60.0));
            assert!(!filter.update(MeasuredSpeed::MISSING).taken);
        }
        assert!(filter.covariance.speed > 1e9 && filter.covariance.inverse().speed.is_finite());
        for _ in 0..100 {
            filter.predict(&MotionStep::wandering(0.02, 0.05));
            filter.update(MeasuredSpeed { speed: 30.0, variance: 0.05 });
        }
        assert!((filter.state[0] - 30.0).abs() < 1e-3);
    }

    /// Any number that a broken sensor can make of its bytes, and speeds of trains as often.
    fn anything() -> impl Strategy<Value = f64> {
        prop_oneof![
            4 => -100.0..100.0_f64,
            1 => proptest::num::f64::ANY,
            1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(1e308), Just(-1e3), Just(0.0), Just(1e-12)],
        ]
    }

    proptest! {
        #[test]
        fn no_input_poisons_it(
            steps in proptest::collection::vec((anything(), anything(), anything(), anything()), 1..200),
        ) {
            let mut filter = filter();
            for (speed, variance, period, q) in steps {
                filter.predict(&MotionStep::wandering(q.abs().min(1e6), period));
                let innovation = filter.update(MeasuredSpeed { speed, variance });
                let p = filter.covariance;
                prop_assert!(p.speed > 0.0 && p.acceleration > 0.0, "{p:?}");
                prop_assert!(p.mixed * p.mixed <= p.speed * p.acceleration * (1.0 + 1e-9), "{p:?}");
                prop_assert!(filter.state.iter().all(|x| x.is_finite()), "{:?}", filter.state);
                prop_assert!(innovation.variance > 0.0 && innovation.value.is_finite());
            }
            for _ in 0..1200 {
                filter.predict(&MotionStep::wandering(0.02, 0.05));
                filter.update(MeasuredSpeed { speed: 12.0, variance: 0.05 });
            }
            prop_assert!((filter.state[0] - 12.0).abs() < 0.05, "{:?}", filter.state);
        }
    }
}
