//! Starts that are later than the law has them, and what follows when another step is commanded during one.
//!
//! A train that started late is late in all of its change of speed, `η`: a command that interrupts the change finds it slower, not
//! only less far. Folded into the place alone, a start that is late by a second makes a train seem fast where it still stands.
#![expect(clippy::indexing_slicing, reason = "arrays of letters, indexed by letters")]

use super::filter_state::{B, FilterState, H, SpeedCommand};
use super::motion_filter::MotionFilter;
use crate::linalg::Gaussian;
use crate::model::MotionModel;

/// Wheels stick until the set speed is large enough, at a low step longer than at another: starts of different trains differ by as
/// much as 0.35 s, and this is about what one differs by from step to step (chosen).
const BREAKS_AWAY: f64 = 0.3;

impl FilterState {
    /// When it starts, or last started, from rest, with a standard deviation (s); `None` once it has been running at one speed or
    /// slows down.
    pub(super) fn start(&self, model: &MotionModel) -> Option<(f64, f64)> {
        let pending = self.next_effect(model).filter(|(commanded, _)| commanded.at_rest);
        let starts = self.segment.from.speed == 0.0 && !self.is_still();
        let begins = pending.map(|(_, begins)| begins).or(starts.then_some(self.segment.begins));
        Some((begins?, libm::sqrt(model.start_variance() + BREAKS_AWAY * BREAKS_AWAY)))
    }

    /// By how much later (s) a start is because another step is commanded during it: as likely as not, a decoder whose train has not
    /// moved yet begins to start anew.
    pub(super) fn started_anew(&self, model: &MotionModel, commanded: &SpeedCommand) -> Gaussian {
        let start = self.start(model).filter(|_| !commanded.at_rest && commanded.to != 0);
        let Some((begins, deviation)) = start else { return Gaussian { mean: 0.0, variance: 0.0 } };
        let begun = (commanded.sent - begins) / deviation;
        let share = 0.5 * 0.5 * libm::erfc(begun * core::f64::consts::FRAC_1_SQRT_2);
        let by = SpeedCommand { at_rest: true, ..*commanded }.effect(&model.answers()) - begins;
        Gaussian { mean: share * by, variance: share * (1.0 - share) * by * by }
    }
}

impl<const L: usize> MotionFilter<L> {
    /// A change at a speed (m/s) is as much later as the last one, times this, and by so much (s) besides. The train is where it was.
    pub(super) fn stay_late(&mut self, by: f64, besides: Gaussian, speed: f64) {
        for other in 0..L {
            self.p[H][other] *= by;
            self.p[other][H] *= by;
        }
        self.p[H][H] += besides.variance;
        self.course.x[H] = besides.mean;
        self.course.x[B] += speed * besides.mean;
        let mut slope: [f64; L] = core::array::from_fn(|letter| f64::from(letter == B));
        slope[H] = speed;
        self.transform(slope);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{SpeedStep, TrainId};

    /// A train that is known well.
    fn model() -> MotionModel {
        let mut numbers = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step")).numbers();
        numbers.covariance.iter_mut().for_each(|covariance| *covariance *= 1e-3);
        MotionModel::from_numbers(&numbers).expect("a model")
    }

    /// Set out at 0 s, from 6 to 10 after 1.8 s, while it still becomes faster.
    fn commanded(at: f64) -> MotionFilter {
        let mut filter = MotionFilter::at_rest(0.0, Gaussian { mean: 0.0, variance: 1e-6 });
        filter.command(&model(), at, 6);
        filter.command(&model(), at + 1.8, 10);
        filter
    }

    #[test]
    fn a_late_start_is_late_in_the_change_that_interrupts_it_too() {
        let model = model();
        // Given a train that does as the law says, 0.5 s later than it,
        let (mut filter, truth) = (commanded(0.0), commanded(0.5));
        let speed_error = |filter: &MotionFilter, time: f64| {
            filter.speed(&model, time).mean - truth.speed(&model, time).mean
        };
        let before = speed_error(&filter, 2.7);
        // when it passes places during the change that interrupts its start,
        for passes in [2.2, 2.7] {
            let place = Gaussian { mean: truth.place(&model, passes).mean, variance: 1e-6 };
            filter.pass(&model, passes, 1e-6, place);
        }
        // then nearly half of what its speed was off by is found; a fifth would be if the start counted for its place alone.
        let after = speed_error(&filter, 2.7);
        assert!(before > 0.08 && after.abs() < 0.65 * before, "{before} m/s, and {after} m/s");
    }

    #[test]
    fn a_step_commanded_before_a_train_has_started_leaves_its_start_unknown() {
        let model = model();
        let anew = |after: f64| {
            let mut course = commanded(0.0).course;
            course.settle(&model, 0.6);
            let command = SpeedCommand { sent: after, from: 6, to: 10, at_rest: false };
            course.started_anew(&model, &command)
        };
        // The start takes 0.55 s: after 0.2 s it has not begun, and as likely as not begins 0.2 s later.
        let early = anew(0.2);
        assert!((early.mean - 0.08).abs() < 0.02 && (early.variance.sqrt() - 0.1).abs() < 0.01, "{early:?}");
        // After three seconds it is over.
        let late = anew(3.0);
        assert!(late.mean.abs() < 0.001 && late.variance < 1e-3, "{late:?}");
    }
}
