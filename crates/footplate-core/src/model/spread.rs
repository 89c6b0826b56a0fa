//! How sure a model's numbers are, one by one and together.
#![expect(clippy::indexing_slicing, reason = "indices stay below the side of the matrix")]

use alloc::vec;
use alloc::vec::Vec;

use super::parameters::{
    Answers, HYSTERESIS_SPREAD, NODES, PRIOR, Read, SHAPE_DEVIATION, SHAPES, START_NODES, STOP_NODES, count,
    hysteresis_at, knots, node_covariance, shape_at, speed_at, speed_prior,
};
use super::variation::Variation;
use crate::linalg::Solution;

/// Steps of numerical slopes.
const STEP: f64 = 1e-4;

/// The covariance of a model's numbers.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Spread {
    side: usize,
    covariance: Vec<f64>,
}

impl Spread {
    /// Before a train has moved: every number by itself, nodes of residuals by their speeds.
    pub(super) fn prior(highest: usize) -> Self {
        let side = count(highest);
        let mut spread = Self { side, covariance: vec![0.0; side * side] };
        for (i, (_, deviation)) in PRIOR.iter().enumerate() {
            spread.covariance[i * side + i] = deviation * deviation;
        }
        for first in [STOP_NODES, START_NODES] {
            for i in 0..NODES {
                for j in 0..NODES {
                    spread.covariance[(first + i) * side + first + j] = node_covariance(i, j);
                }
            }
        }
        for place in (shape_at(false, highest)..).take(2 * SHAPES) {
            spread.covariance[place * side + place] = SHAPE_DEVIATION * SHAPE_DEVIATION;
        }
        for knot in 1..=knots(highest) {
            let (_, deviation) = speed_prior(knot, knots(highest));
            let (speed, hysteresis) = (speed_at(knot), hysteresis_at(knot, highest));
            spread.covariance[speed * side + speed] = deviation * deviation;
            spread.covariance[hysteresis * side + hysteresis] = HYSTERESIS_SPREAD * HYSTERESIS_SPREAD;
        }
        spread
    }

    /// Of the first numbers of a solution, if the total length of the sections passed (by their columns) were known; and what
    /// each number is off by for one standard deviation of that total.
    ///
    /// Speeds and lengths could all be larger by the same part and no timing would tell. Where a train is and where it comes to
    /// rest is the same in both cases, so the scale of the survey is kept apart from what is not known of the train.
    pub(super) fn of(solution: &Solution, highest: usize, sections: &[usize]) -> (Self, Vec<f64>) {
        let side = count(highest);
        let with_total = |i: usize| solution.covariance_with_sum(i, sections);
        let total: f64 = sections.iter().map(|section| with_total(*section)).sum();
        let deviation = libm::sqrt(total.max(0.0));
        let scale = |i: usize| if deviation > 0.0 { with_total(i) / deviation } else { 0.0 };
        let scale: Vec<f64> = (0..side).map(scale).collect();
        let at = |i: usize| solution.covariance(i / side, i % side) - scale[i / side] * scale[i % side];
        (Self { side, covariance: (0..side * side).map(at).collect() }, scale)
    }

    /// What may have changed is known less well.
    pub(super) fn widen(&mut self, by: &Variation, values: &[f64], highest: usize) {
        let (side, covariance) = (self.side, &mut self.covariance);
        by.each(values, highest, |one, other, more| {
            covariance[one * side + other] += more;
            if one != other {
                covariance[other * side + one] += more;
            }
        });
    }

    /// Of a lower triangle, row after row, that is as long as `side` asks for.
    pub(super) fn of_lower_triangle(side: usize, lower: &[f64]) -> Self {
        let at = |i: usize, j: usize| lower[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
        Self { side, covariance: (0..side * side).map(|place| at(place / side, place % side)).collect() }
    }

    /// Covariance of two numbers.
    pub(super) fn between(&self, one: usize, other: usize) -> f64 {
        if one.max(other) < self.side { self.covariance[one * self.side + other] } else { 0.0 }
    }

    /// Variance of one number.
    pub(super) fn variance(&self, place: usize) -> f64 {
        if place < self.side { self.covariance[place * self.side + place].max(0.0) } else { 0.0 }
    }

    /// Variance of the sum of numbers times slopes.
    pub(super) fn variance_along(&self, slopes: &[(usize, f64)]) -> f64 {
        self.covariance_of(slopes, slopes).max(0.0)
    }

    /// Covariance of two such sums.
    pub(super) fn covariance_of(&self, one: &[(usize, f64)], other: &[(usize, f64)]) -> f64 {
        let mut sum = 0.0;
        for (i, left) in one {
            for (j, right) in other {
                sum += left * right * self.covariance[i * self.side + j];
            }
        }
        sum
    }

    /// How what follows from the numbers changes with each of them.
    pub(super) fn slopes(
        &self,
        values: &[f64],
        highest: usize,
        of: impl Fn(&Answers<'_>) -> f64,
    ) -> Vec<(usize, f64)> {
        let read = Read::nothing();
        let here = of(&Answers::noting(values, highest, &read));
        let mut moved = values.to_vec();
        let mut slopes = Vec::new();
        for place in (0..self.side.min(values.len())).filter(|place| read.contains(*place)) {
            moved[place] += STEP;
            let slope = (of(&Answers::new(&moved, highest)) - here) / STEP;
            moved[place] = values[place];
            if slope != 0.0 {
                slopes.push((place, slope));
            }
        }
        slopes
    }
}
