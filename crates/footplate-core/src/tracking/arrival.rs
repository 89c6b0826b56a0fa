//! When a train comes to a place that is known only together with other numbers, such as the length of the hop before it.
//!
//! The letters of [`MotionFilter`] have companions `c` then: the place is `W + Σ h c`, with slopes `h`, and the train is there
//! when `x(t) = W + Σ h c`. The variance of that difference, over the squared speed, is the variance of the time.
#![expect(
    clippy::indexing_slicing,
    reason = "arrays of letters, indexed by letters; companions are counted by the caller"
)]

use super::filter_state::{B, E, N};
use super::motion_filter::MotionFilter;
use crate::linalg::Gaussian;
use crate::model::MotionModel;

/// A train that has not arrived after this long (s) does not arrive: the longest hop at the lowest step takes a minute.
const LONGEST_WAIT: f64 = 200.0;
/// Halvings of half a second that leave less than a microsecond.
const BISECTIONS: usize = 30;
/// Below this (m/s) a place says nothing of a time.
const SLOWEST: f64 = 0.002;

/// When a train reaches a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Arrival {
    /// Mean time (s) and its variance (s²).
    pub(crate) time: f64,
    pub(crate) variance: f64,
    /// How fast it is there (m/s).
    pub(crate) speed: f64,
}

impl<const L: usize> MotionFilter<L> {
    /// Slopes of how far a train is past a place that companions move.
    pub(super) fn past(mut slope: [f64; L], companions: &[(usize, f64)]) -> [f64; L] {
        for (companion, by) in companions {
            slope[N + companion] -= by;
        }
        slope
    }

    /// All distances are counted from elsewhere from now on: from a place that is so far (m) as the companions are now, and
    /// moves with them.
    pub(crate) fn shift_beside(&mut self, by: f64, slopes: &[(usize, f64)]) {
        let mut slope = [0.0; L];
        slope[B] = 1.0;
        for (companion, by) in slopes {
            slope[N + companion] += by;
        }
        self.transform(slope);
        self.course.x[B] += by;
    }

    /// A companion of which nothing else that is kept here tells anything, with its variance.
    pub(crate) fn keep_beside(&mut self, companion: usize, variance: f64) {
        self.forget(N + companion);
        self.p[N + companion][N + companion] = variance;
    }

    /// When it reaches a place (s), with the standard deviation of that; `None` if it comes to rest before.
    pub(crate) fn reaches(&self, model: &MotionModel, place: Gaussian, now: f64) -> Option<(f64, f64)> {
        if let Some((rest, _, _)) = self.rest(model)
            && rest.mean <= place.mean
        {
            return None;
        }
        let place_at = |time: f64| self.place(model, time).mean;
        let (mut low, mut high) = (now, now + 0.5);
        while place_at(high) < place.mean {
            (low, high) = (high, now + 2.0 * (high - now));
            if high - now > LONGEST_WAIT {
                return None;
            }
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if place_at(middle) < place.mean { low = middle } else { high = middle }
        }
        let speed = self.speed(model, high).mean.max(SLOWEST);
        let deviation = libm::sqrt(self.place(model, high).variance + place.variance) / speed;
        Some((high, deviation))
    }

    /// When it reaches a place that companions move (see [`pass_beside`](Self::pass_beside)), looked for from a time on;
    /// `None` if it comes to rest before.
    pub(crate) fn arrives(
        &self,
        model: &MotionModel,
        place: Gaussian,
        slopes: &[(usize, f64)],
        now: f64,
    ) -> Option<Arrival> {
        let mut course = self.course;
        let is_there = |time: f64| {
            let mut later = course;
            later.settle(model, time);
            later.place(time) >= place.mean
        };
        let (mut low, mut high) = (now, now + 0.5);
        while !is_there(high) {
            (low, high) = (high, now + 2.0 * (high - now));
            if high - now > LONGEST_WAIT {
                return None;
            }
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if is_there(middle) { high = middle } else { low = middle }
        }
        course.settle(model, high);
        let speed = course.speed(high).max(SLOWEST);
        let there = self.at(model, high);
        let (_, slope) = there.place_and_slopes(high);
        let shape = there.course.segment.shape_error(high);
        let variance = there.variance_along(Self::past(slope, slopes)) + shape * shape + place.variance;
        Some(Arrival { time: high, variance: variance / (speed * speed), speed })
    }

    /// Whether all that was commanded has taken effect by a time, and its speed no longer changes.
    pub(crate) fn is_settled(&self, model: &MotionModel, time: f64) -> bool {
        self.course.next_effect(model).is_none()
            && (self.course.segment.is_steady() || self.course.segment.settled() <= time)
    }

    /// The model was exchanged while it ran steadily; what is known of each step's speed is counted from the new one.
    pub(crate) fn exchange(&mut self, before: &MotionModel, after: &MotionModel) {
        self.course.exchange_apart(before, after);
    }

    /// Adds to the variance of ln of its speed.
    pub(crate) fn widen_speed(&mut self, variance: f64) {
        self.p[E][E] += variance;
    }
}
