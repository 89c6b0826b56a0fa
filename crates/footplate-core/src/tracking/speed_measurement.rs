//! A measurement of the speed of a train that runs steadily, as its decoder reports it.
#![expect(clippy::indexing_slicing, reason = "arrays of letters, indexed by letters")]

use super::filter_state::{E, N};
use super::motion_filter::{MotionFilter, STEADY};
use crate::linalg::Gaussian;
use crate::model::MotionModel;

/// A report further than this many standard deviations from the estimate is not taken: the decoder or the model is wrong, and the
/// next sensor shows which.
const GATE: f64 = 4.0;

impl<const L: usize> MotionFilter<L> {
    /// A report of the speed (ln m/s), that may be so much late (s). Returns whether it changed the estimate.
    ///
    /// Reports share their error, so that no number of them makes the estimate surer than one. With variance `P` of the estimate and
    /// `R` of the report, the measurement counts with `R P / (P − R)`, which leaves exactly `R`: of two estimates with unknown
    /// correlation, the better one (covariance intersection of one number, Julier and Uhlmann, 1997).
    pub(crate) fn take_speed(
        &mut self,
        model: &MotionModel,
        time: f64,
        latest: f64,
        ln_speed: Gaussian,
    ) -> bool {
        let before = self.at(model, time);
        let is_steady = before.course.step != 0
            && before.course.next_effect(model).is_none()
            && before.course.segment.share(time - latest) >= STEADY;
        let known = before.ln_speed_variance();
        let off = ln_speed.mean - libm::log(before.course.speed(time));
        let is_outlier = off * off > GATE * GATE * (known + ln_speed.variance);
        if !is_steady || known <= ln_speed.variance || is_outlier || !off.is_finite() {
            return false;
        }
        let mut slope = [0.0; L];
        slope[E] = 1.0;
        if let Some(letter) = before.course.speed {
            slope[letter] = 1.0;
        }
        let with = before.covariance_along(&slope);
        // known + R P / (P − R)
        let innovation = known * known / (known - ln_speed.variance);
        *self = before;
        for i in 0..L {
            if i < N {
                self.course.x[i] += with[i] / innovation * off;
            }
            for j in 0..L {
                self.p[i][j] -= with[i] * with[j] / innovation;
            }
        }
        self.course.hold_deviations();
        self.course.linearise(model);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{SpeedStep, TrainId};

    #[test]
    fn a_report_that_is_repeated_leaves_the_uncertainty_of_one() {
        let model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        let start = Gaussian { mean: 0.0, variance: 1e-6 };
        let mut filter: MotionFilter = MotionFilter::running(&model, 0.0, 8, start);
        let ln = libm::log(filter.speed(&model, 0.0).mean);
        // 63 units of which the scale is known: 1/(√12 63) = 0.458 %.
        let report = Gaussian { mean: ln + 0.1, variance: 1.0 / (12.0 * 63.0 * 63.0) };
        for nth in 0..50 {
            filter.take_speed(&model, 10.0 + 0.01 * f64::from(nth), 1.5, report);
            let speed = filter.speed(&model, 11.0);
            let relative = libm::sqrt(speed.variance) / speed.mean;
            assert!((0.00457..0.0050).contains(&relative), "{relative} after {nth} more");
        }
        let speed = filter.speed(&model, 11.0).mean;
        assert!((libm::log(speed) - ln - 0.1).abs() < 0.002, "{speed}");
        // 10 % in 10 s since the run began have moved the train on.
        let place = filter.place(&model, 10.5).mean / (10.5 * libm::exp(ln));
        assert!((libm::log(place) - 0.1).abs() < 0.002, "{place}");
        assert!(!filter.take_speed(&model, 12.0, 1.5, Gaussian { mean: ln + 0.2, ..report }), "an outlier");
    }
    #[test]
    fn a_report_beyond_four_deviations_or_while_the_speed_changes_is_not_taken() {
        let model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        let start = Gaussian { mean: 0.0, variance: 1e-6 };
        let running: MotionFilter = MotionFilter::running(&model, 0.0, 8, start);
        let now = running.at(&model, 10.0);
        let (ln, known) = (libm::log(now.course.speed(10.0)), now.ln_speed_variance());
        let report = |deviations: f64, variance: f64| Gaussian {
            mean: ln + deviations * libm::sqrt(known + variance),
            variance,
        };
        let taken = |filter: &MotionFilter, time: f64, report: Gaussian| {
            let mut filter = *filter;
            filter.take_speed(&model, time, 1.5, report).then_some(filter)
        };
        let variance = 0.01 * known;
        assert!(taken(&running, 10.0, report(3.9, variance)).is_some(), "it may be chance");
        for deviations in [2.0, -2.0] {
            let filter = taken(&running, 10.0, report(deviations, variance)).expect("it is likely");
            // What is known of the speed is as good as the report, and as near to it as both variances say.
            assert!(
                (filter.ln_speed_variance() / variance - 1.0).abs() < 0.01,
                "{}",
                filter.ln_speed_variance()
            );
            let by = libm::log(filter.course.speed(10.0)) - ln;
            let expected = deviations * libm::sqrt(known + variance) * (1.0 - variance / known);
            assert!((by / expected - 1.0).abs() < 0.01, "{by}, not {expected}");
        }
        for refused in [report(4.1, variance), report(-4.1, variance), report(0.1, 1.1 * known)] {
            assert!(taken(&running, 10.0, refused).is_none(), "{refused:?}");
        }
        // A command was sent just before, or it gets faster, or it is at rest.
        let mut changing = running;
        changing.command(&model, 9.9, 12);
        assert!(taken(&changing, 10.0, report(0.1, variance)).is_none());
        assert!(taken(&changing, 11.5, report(0.1, variance)).is_none());
        assert!(taken(&MotionFilter::at_rest(0.0, start), 10.0, report(0.1, variance)).is_none());
    }
}
