//! Linear least squares with priors, by normal equations and Cholesky factorisation.
//!
//! Letters: `a` information matrix (lower triangle, row by row), `b` information vector, `n` unknowns. A measurement
//! `z = h·x + e` with variance `r` adds `hᵀh / r` to `a` and `hᵀz / r` to `b`; a prior is a measurement of one
//! unknown. Priors keep `a` positive definite, so that no rank decision is needed.
#![expect(
    clippy::indexing_slicing,
    reason = "all indices stay below `unknowns`, the size both vectors are made for"
)]

use alloc::vec;
use alloc::vec::Vec;

use super::cholesky::{backward, cholesky, first_of_inverse, forward, row};

/// The sum of the information of all measurements and priors.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "Written"))]
pub struct NormalEquations {
    unknowns: usize,
    a: Vec<f64>,
    b: Vec<f64>,
}

/// Equations as read from a file, before their sizes are checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Written {
    unknowns: usize,
    a: Vec<f64>,
    b: Vec<f64>,
}

#[cfg(feature = "serde")]
impl TryFrom<Written> for NormalEquations {
    type Error = &'static str;

    fn try_from(Written { unknowns, a, b }: Written) -> Result<Self, Self::Error> {
        let fits = b.len() == unknowns
            && unknowns.checked_add(1).is_some_and(|n| unknowns.checked_mul(n) == Some(2 * a.len()));
        fits.then_some(Self { unknowns, a, b })
            .ok_or("the information matrix does not have the size of its vector")
    }
}

/// The estimates of the unknowns and their covariance.
#[derive(Debug, Clone)]
pub struct Solution {
    /// One value for each unknown.
    pub values: Vec<f64>,
    /// Lower triangle of the inverse of the information matrix, as far as requested.
    covariance: Vec<f64>,
}

impl NormalEquations {
    /// Equations without information about this many unknowns.
    pub fn new(unknowns: usize) -> Self {
        Self { unknowns, a: vec![0.0; row(unknowns)], b: vec![0.0; unknowns] }
    }

    /// Adds the measurement `Σ weight·x[unknown] = measured` with this variance. Each unknown occurs at most once; a
    /// term beyond the last unknown is a bug of the caller and is ignored.
    pub fn add(&mut self, terms: &[(usize, f64)], measured: f64, variance: f64) {
        debug_assert!(variance > 0.0 && measured.is_finite());
        for &(i, left) in terms {
            debug_assert!(i < self.unknowns);
            if i >= self.unknowns {
                continue;
            }
            self.b[i] += left * measured / variance;
            for &(j, right) in terms {
                if j <= i {
                    self.a[row(i) + j] += left * right / variance;
                }
            }
        }
    }

    /// The number of unknowns.
    pub const fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Appends unknowns without information.
    pub fn append(&mut self, count: usize) {
        self.unknowns += count;
        self.a.resize(row(self.unknowns), 0.0);
        self.b.resize(self.unknowns, 0.0);
    }

    /// Exchanges the last two unknowns.
    pub fn swap_last_two(&mut self) {
        let Some(first) = self.unknowns.checked_sub(2) else { return };
        let (one, other) = (row(first), row(first + 1));
        for j in 0..first {
            self.a.swap(one + j, other + j);
        }
        self.a.swap(one + first, other + first + 1);
        self.b.swap(first, first + 1);
    }

    /// Removes the last unknown and keeps the information about the others (Schur complement). `None` if it is
    /// correlated with others and not bounded, which only rounding can cause.
    pub fn eliminate_last(&mut self) -> Option<Eliminated> {
        let last = self.unknowns.checked_sub(1)?;
        let mut line = self.a.split_off(row(last));
        let pivot = line.pop()?;
        let right = self.b.pop()?;
        self.unknowns = last;
        if pivot.is_nan() || pivot <= 0.0 {
            let is_free = pivot == 0.0 && line.iter().all(|tie| *tie == 0.0);
            return is_free.then_some(Eliminated { line, pivot: 1.0, right });
        }
        for i in 0..last {
            let factor = line[i] / pivot;
            if factor == 0.0 {
                continue;
            }
            self.b[i] -= factor * right;
            for (sum, tie) in self.a[row(i)..=row(i) + i].iter_mut().zip(&line) {
                *sum -= factor * tie;
            }
        }
        Some(Eliminated { line, pivot, right })
    }

    /// The sum of squared residuals over variances at `x`, up to a constant.
    pub fn cost(&self, x: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (i, value) in x.iter().enumerate().take(self.unknowns) {
            let line = &self.a[row(i)..row(i) + i];
            let others: f64 = line.iter().zip(x).map(|(tie, other)| tie * other).sum();
            sum += value * (2.0 * others + self.a[row(i) + i] * value - 2.0 * self.b[i]);
        }
        sum
    }

    /// Adds variances (the lower triangle of a covariance, row by row) to the unknowns: they may have changed by as
    /// much since they were measured. Every unknown must be bounded.
    pub fn widen(&mut self, by: &[f64]) {
        self.change(|_, covariance| {
            covariance.iter_mut().zip(by).for_each(|(variance, more)| *variance += more);
        });
    }

    /// Replaces what is known by what a function makes of the values and of the lower triangle of their covariance, row by row.
    /// Every unknown must be bounded.
    pub fn change(&mut self, by: impl FnOnce(&mut [f64], &mut [f64])) {
        let Some(mut solution) = self.solve() else { return };
        by(&mut solution.values, &mut solution.covariance);
        let Some(factor) = cholesky(&solution.covariance, self.unknowns) else { return };
        self.a = first_of_inverse(&factor, self.unknowns, self.unknowns);
        for i in 0..self.unknowns {
            self.b[i] =
                (0..self.unknowns).map(|j| self.a[row(i.max(j)) + i.min(j)] * solution.values[j]).sum();
        }
    }

    /// Solves for the values without covariances, in a sixth of the time. `None` if an unknown is neither measured
    /// nor bounded by a prior.
    pub fn values(&self) -> Option<Vec<f64>> {
        let factor = cholesky(&self.a, self.unknowns)?;
        let mut values = self.b.clone();
        forward(&factor, &mut values);
        backward(&factor, &mut values);
        Some(values)
    }

    /// Solves for the unknowns. `None` if an unknown is neither measured nor bounded by a prior.
    pub fn solve(&self) -> Option<Solution> {
        self.solve_for_first(self.unknowns)
    }

    /// The same with the covariance of only the first `known` unknowns: for ninety of a thousand, this takes a tenth
    /// of the time.
    pub fn solve_for_first(&self, known: usize) -> Option<Solution> {
        let (n, side) = (self.unknowns, known.min(self.unknowns));
        let factor = cholesky(&self.a, n)?;
        let mut values = self.b.clone();
        forward(&factor, &mut values);
        backward(&factor, &mut values);
        Some(Solution { values, covariance: first_of_inverse(&factor, n, side) })
    }
}

/// A removed unknown, which follows from the others.
#[derive(Debug, Clone)]
pub struct Eliminated {
    line: Vec<f64>,
    pivot: f64,
    right: f64,
}

impl Eliminated {
    /// Its value, given those of the unknowns before it.
    pub fn value(&self, others: &[f64]) -> f64 {
        let tied: f64 = self.line.iter().zip(others).map(|(tie, value)| tie * value).sum();
        (self.right - tied) / self.pivot
    }
}

impl Solution {
    /// The variance of `Σ weight·x[unknown]`.
    pub fn variance_of(&self, terms: &[(usize, f64)]) -> f64 {
        let mut sum = 0.0;
        for &(i, left) in terms {
            for &(j, right) in terms {
                sum += left * right * self.covariance[row(i.max(j)) + i.min(j)];
            }
        }
        sum.max(0.0)
    }

    /// The covariance of two unknowns.
    pub fn covariance(&self, one: usize, other: usize) -> f64 {
        self.covariance[row(one.max(other)) + one.min(other)]
    }

    /// The covariance of one unknown and the sum of others.
    pub fn covariance_with_sum(&self, one: usize, of: &[usize]) -> f64 {
        of.iter().map(|other| self.covariance(one, *other)).sum()
    }

    /// The variance of one unknown.
    pub fn variance(&self, unknown: usize) -> f64 {
        self.covariance[row(unknown) + unknown].max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_three_points_is_found_with_its_covariance() {
        // Given y = 2 + 3 x at x = 0, 1, 2 with unit variance,
        let mut line = NormalEquations::new(2);
        for (x, y) in [(0.0, 2.0), (1.0, 5.0), (2.0, 8.0)] {
            line.add(&[(0, 1.0), (1, x)], y, 1.0);
        }
        // then the textbook result: slope variance 1/Σ(x-x̄)² = 1/2, intercept variance 1/3 + 1/2.
        let found = line.solve().unwrap();
        assert!((found.values[0] - 2.0).abs() < 1e-12 && (found.values[1] - 3.0).abs() < 1e-12);
        assert!((found.variance(1) - 0.5).abs() < 1e-12);
        assert!((found.variance(0) - (1.0 / 3.0 + 0.5)).abs() < 1e-12);
        assert!((found.variance_of(&[(0, 1.0), (1, 1.0)]) - 1.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn eliminating_an_unknown_keeps_the_solution_and_its_value() {
        // Given a chain of three places, one of them measured, and a scale common to all,
        let mut all = NormalEquations::new(4);
        all.add(&[(0, 1.0)], 1.0, 0.04);
        all.add(&[(1, 1.0)], 0.3, 0.01);
        all.add(&[(1, -1.0), (2, 1.0), (0, -2.0)], 0.1, 0.02);
        all.add(&[(2, -1.0), (3, 1.0), (0, -1.5)], -0.2, 0.03);
        let known = all.solve().unwrap();
        // when the last two are swapped and removed one after the other,
        let mut fewer = all.clone();
        fewer.swap_last_two();
        let second = fewer.eliminate_last().unwrap();
        let third = fewer.eliminate_last().unwrap();
        let left = fewer.solve().unwrap();
        for i in 0..2 {
            assert!((left.values[i] - known.values[i]).abs() < 1e-12);
            assert!((left.variance(i) - known.variance(i)).abs() < 1e-12);
        }
        let mut values = left.values.clone();
        values.push(third.value(&values));
        values.push(second.value(&values));
        assert!((values[2] - known.values[3]).abs() < 1e-12 && (values[3] - known.values[2]).abs() < 1e-12);
        let moved: Vec<f64> = known.values.iter().map(|value| value + 0.1).collect();
        let rise = all.cost(&moved) - all.cost(&known.values);
        let sum: f64 = (0..4)
            .flat_map(|i| (0..4).map(move |j| (i, j)))
            .map(|(i, j)| all.a[row(i.max(j)) + i.min(j)])
            .sum();
        assert!((rise - 0.01 * sum).abs() < 1e-9, "{rise} {sum}");
    }

    #[test]
    fn widening_increases_the_variance() {
        let mut equations = NormalEquations::new(2);
        equations.add(&[(0, 1.0)], 3.0, 0.5);
        equations.add(&[(0, -1.0), (1, 1.0)], 1.0, 0.25);
        equations.widen(&[0.1, 0.1, 0.4]);
        let known = equations.solve().unwrap();
        assert!((known.values[0] - 3.0).abs() < 1e-12 && (known.values[1] - 4.0).abs() < 1e-12);
        assert!((known.variance(0) - 0.6).abs() < 1e-12 && (known.variance(1) - 1.15).abs() < 1e-12);
        assert!((known.covariance(0, 1) - 0.6).abs() < 1e-12);
    }

    /// Twenty unknowns, all correlated.
    fn correlated() -> NormalEquations {
        let mut equations = NormalEquations::new(20);
        for i in 0..20_usize {
            equations.add(&[(i, 1.0)], 0.1 * i as f64, 2.0);
            let terms = [(i, 1.0), ((i * 7 + 3) % 20, -0.5), ((i * 11 + 5) % 20, 0.25)];
            if terms[1].0 != i && terms[2].0 != i && terms[1].0 != terms[2].0 {
                equations.add(&terms, libm::sin(i as f64), 0.3);
            }
        }
        equations
    }

    #[test]
    fn rows_computed_together_have_the_bits_of_single_rows() {
        let NormalEquations { a, .. } = correlated();
        // The textbook's order: row by row, sum by sum.
        let mut textbook = a.clone();
        for i in 0..20 {
            for j in 0..=i {
                let sum = (0..j)
                    .fold(textbook[row(i) + j], |sum, k| sum - textbook[row(i) + k] * textbook[row(j) + k]);
                textbook[row(i) + j] = if i == j { libm::sqrt(sum) } else { sum / textbook[row(j) + j] };
            }
        }
        assert_eq!(cholesky(&a, 20).unwrap(), textbook);
    }

    #[test]
    fn the_first_unknowns_have_the_same_covariance_in_a_partial_solution() {
        let equations = correlated();
        let (some, all) = (equations.solve_for_first(6).unwrap(), equations.solve().unwrap());
        assert_eq!(some.values, all.values);
        for i in 0..6 {
            for j in 0..=i {
                assert_eq!(some.covariance(i, j), all.covariance(i, j));
            }
        }
        // By definition of the inverse: the matrix times one of its columns is a column of the unit matrix.
        for column in 0..6 {
            for line in 0..20 {
                let sum: f64 = (0..20)
                    .map(|k| equations.a[row(line.max(k)) + line.min(k)] * all.covariance(k, column))
                    .sum();
                assert!((sum - f64::from(u8::from(line == column))).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn an_unbounded_unknown_has_no_solution() {
        let mut half = NormalEquations::new(2);
        half.add(&[(0, 1.0)], 1.0, 1.0);
        assert!(half.solve().is_none());
    }
}
