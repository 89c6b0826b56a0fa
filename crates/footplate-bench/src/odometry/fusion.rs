//! The federated filter of the odometer alone, fed with the two speeds and their mean.

use footplate_core::odometry::paper::{FederatedFilter, Fusion, MeasuredSpeed, MotionStep};

use super::PERIOD_S;
use crate::operation::Operation;

/// Variance of a measured speed, (m/s)², and of the mean of two.
pub(super) const VARIANCES: [f64; 2] = [0.04, 0.02];
/// How much variance acceleration gains in a second (m²/s⁵).
pub(super) const JERK: f64 = 0.5;

pub(super) fn operation(group: &'static str, means: &'static str, speeds: Vec<[f64; 2]>) -> Operation {
    let [variance, of_mean] = VARIANCES;
    let step = MotionStep::wandering(JERK, PERIOD_S);
    let start = MeasuredSpeed { speed: 0.0, variance: 1.0 };
    let mut filter = FederatedFilter::starting_at(Fusion::CovarianceIntersection, start);
    Operation::new(group, means, speeds, move |&[first, second]| {
        let measured = [
            MeasuredSpeed { speed: first, variance },
            MeasuredSpeed { speed: second, variance },
            MeasuredSpeed { speed: 0.5 * (first + second), variance: of_mean },
        ];
        filter.step(&step, measured, [1.0 / 3.0; 3]);
        let master = filter.master();
        master.state[0] + 1e-12 * master.covariance.speed
    })
}
