//! Least squares with prior knowledge, by normal equations and Cholesky's factorisation.
//!
//! Letters: `a` information matrix (lower triangle, row by row), `b` information vector, `n` unknowns.
//! A measurement `z = h·x + e` with variance `r` adds `hᵀh / r` to `a` and `hᵀz / r` to `b`; a prior is a
//! measurement of one unknown. Priors keep `a` positive definite, so no rank has to be guessed.
#![expect(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    reason = "all indices stay below `unknowns`, the size both vectors are made for, and run as in the formulas"
)]

use alloc::vec;
use alloc::vec::Vec;

/// The sum of what all measurements and priors say of the unknowns.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    unknowns: usize,
    a: Vec<f64>,
    b: Vec<f64>,
}

/// The best values of the unknowns and how they are known.
#[derive(Debug, Clone)]
pub struct Solution {
    /// One value an unknown.
    pub values: Vec<f64>,
    /// Lower triangle of the inverse of the information matrix, as far as it was asked for.
    covariance: Vec<f64>,
}

/// Where row `i` of a lower triangle begins.
const fn row(i: usize) -> usize {
    i * (i + 1) / 2
}

impl NormalEquations {
    /// Nothing known yet of this many unknowns.
    #[must_use]
    pub fn new(unknowns: usize) -> Self {
        Self { unknowns, a: vec![0.0; row(unknowns)], b: vec![0.0; unknowns] }
    }

    /// Adds the measurement `Σ weight·x[unknown] = measured` with this variance. Terms name each unknown
    /// at most once; a term beyond the last unknown is our bug and is left out.
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

    /// Adds measurements that share unknowns of their own, which nobody else asks for: the unknowns of
    /// `group` are taken out by the Schur complement, so thousands of groups cost no more than their rows.
    pub fn add_group<const LOCAL: usize>(&mut self, group: &Group<LOCAL>) {
        let Some(inverse) = invert(group.local_a) else {
            debug_assert!(false, "a group bounds its own unknowns by priors");
            return;
        };
        for (place, &i) in group.shared.iter().enumerate() {
            let left = group.cross[place];
            let weighed: [f64; LOCAL] =
                core::array::from_fn(|k| (0..LOCAL).map(|l| left[l] * inverse[l][k]).sum());
            self.b[i] += group.shared_b[place] - dot(&weighed, &group.local_b);
            for (other, &j) in group.shared.iter().enumerate() {
                if j <= i {
                    let low = row(place.max(other)) + place.min(other);
                    self.a[row(i) + j] += group.shared_a[low] - dot(&weighed, &group.cross[other]);
                }
            }
        }
    }

    /// Solves for the values of the unknowns alone, which takes a sixth of the time. `None` when something is neither
    /// measured nor bounded by a prior.
    #[must_use]
    pub fn values(&self) -> Option<Vec<f64>> {
        let factor = cholesky(&self.a, self.unknowns)?;
        let mut values = self.b.clone();
        forward(&factor, &mut values);
        backward(&factor, &mut values);
        Some(values)
    }

    /// Solves for the unknowns. `None` when something is neither measured nor bounded by a prior.
    #[must_use]
    pub fn solve(&self) -> Option<Solution> {
        self.solve_for_first(self.unknowns)
    }

    /// The same, but only of the first so many unknowns it is told how they are known: of a thousand of which ninety are asked
    /// for that takes a tenth of the time.
    #[must_use]
    pub fn solve_for_first(&self, known: usize) -> Option<Solution> {
        let (n, side) = (self.unknowns, known.min(self.unknowns));
        let factor = cholesky(&self.a, n)?;
        let mut values = self.b.clone();
        forward(&factor, &mut values);
        backward(&factor, &mut values);
        Some(Solution { values, covariance: first_of_inverse(&factor, n, side) })
    }
}

/// Measurements that have `LOCAL` unknowns of their own beside the shared ones.
#[derive(Debug, Clone)]
pub struct Group<const LOCAL: usize> {
    /// The shared unknowns that occur here.
    shared: Vec<usize>,
    shared_a: Vec<f64>,
    shared_b: Vec<f64>,
    /// Information between each shared unknown and the local ones.
    cross: Vec<[f64; LOCAL]>,
    local_a: [[f64; LOCAL]; LOCAL],
    local_b: [f64; LOCAL],
}

impl<const LOCAL: usize> Group<LOCAL> {
    /// A group whose own unknowns are bounded only by these prior variances about zero.
    #[must_use]
    pub fn new(prior_variances: [f64; LOCAL]) -> Self {
        let mut local_a = [[0.0; LOCAL]; LOCAL];
        for (i, variance) in prior_variances.iter().enumerate() {
            local_a[i][i] = 1.0 / variance;
        }
        Self {
            shared: Vec::new(),
            shared_a: Vec::new(),
            shared_b: Vec::new(),
            cross: Vec::new(),
            local_a,
            local_b: [0.0; LOCAL],
        }
    }

    /// Adds `Σ weight·shared + local·own = measured` with this variance.
    pub fn add(&mut self, terms: &[(usize, f64)], local: [f64; LOCAL], measured: f64, variance: f64) {
        debug_assert!(variance > 0.0 && measured.is_finite());
        let places: Vec<(usize, f64)> = terms.iter().map(|&(unknown, w)| (self.place(unknown), w)).collect();
        for &(i, left) in &places {
            self.shared_b[i] += left * measured / variance;
            for k in 0..LOCAL {
                self.cross[i][k] += left * local[k] / variance;
            }
            for &(j, right) in &places {
                if j <= i {
                    self.shared_a[row(i) + j] += left * right / variance;
                }
            }
        }
        for k in 0..LOCAL {
            self.local_b[k] += local[k] * measured / variance;
            for l in 0..LOCAL {
                self.local_a[k][l] += local[k] * local[l] / variance;
            }
        }
    }

    /// The group's own unknowns and their covariance once the shared ones are solved; the doubt of the
    /// shared ones is not in it.
    #[must_use]
    pub fn own(&self, solution: &Solution) -> Option<([f64; LOCAL], [[f64; LOCAL]; LOCAL])> {
        let inverse = invert(self.local_a)?;
        let mut right = self.local_b;
        for (place, &unknown) in self.shared.iter().enumerate() {
            for k in 0..LOCAL {
                right[k] -= self.cross[place][k] * solution.values[unknown];
            }
        }
        Some((core::array::from_fn(|k| dot(&inverse[k], &right)), inverse))
    }

    fn place(&mut self, unknown: usize) -> usize {
        self.shared.iter().position(|known| *known == unknown).unwrap_or_else(|| {
            self.shared.push(unknown);
            self.shared_a.resize(row(self.shared.len()), 0.0);
            self.shared_b.push(0.0);
            self.cross.push([0.0; LOCAL]);
            self.shared.len() - 1
        })
    }
}

fn dot<const N: usize>(left: &[f64; N], right: &[f64; N]) -> f64 {
    left.iter().zip(right).map(|(l, r)| l * r).sum()
}

/// The inverse of a small positive definite matrix by Gauss and Jordan; `None` when it is not.
fn invert<const N: usize>(mut a: [[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let mut inverse = [[0.0; N]; N];
    for (i, line) in inverse.iter_mut().enumerate() {
        line[i] = 1.0;
    }
    for i in 0..N {
        let pivot = a[i][i];
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        for k in 0..N {
            a[i][k] /= pivot;
            inverse[i][k] /= pivot;
        }
        for j in (0..N).filter(|j| *j != i) {
            let factor = a[j][i];
            for k in 0..N {
                a[j][k] -= factor * a[i][k];
                inverse[j][k] -= factor * inverse[i][k];
            }
        }
    }
    Some(inverse)
}

impl Solution {
    /// The variance of `Σ weight·x[unknown]`.
    #[must_use]
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
    #[must_use]
    pub fn covariance(&self, one: usize, other: usize) -> f64 {
        self.covariance[row(one.max(other)) + one.min(other)]
    }

    /// The variance of one unknown.
    #[must_use]
    pub fn variance(&self, unknown: usize) -> f64 {
        self.covariance[row(unknown) + unknown].max(0.0)
    }
}

/// Rows of a factor that are worked out together, so that one sum need not wait for another.
const TOGETHER: usize = 8;

/// The lower factor of a positive definite matrix, or `None` when it is not.
///
/// Every sum is taken in the order of the textbook's, term by term: whoever works out one row after the other gets the same bits.
fn cholesky(a: &[f64], n: usize) -> Option<Vec<f64>> {
    let mut factor = a.to_vec();
    // The rows under work, column by column.
    let mut columns = vec![[0.0; TOGETHER]; n];
    for first in (0..n).step_by(TOGETHER) {
        let rows = TOGETHER.min(n - first);
        let (above, work) = factor.split_at_mut(row(first));
        let begins = |i: usize| row(i) - row(first);
        for j in 0..first {
            let line = &above[row(j)..row(j + 1)];
            let mut sums = [0.0; TOGETHER];
            for (place, sum) in sums.iter_mut().enumerate().take(rows) {
                *sum = work[begins(first + place) + j];
            }
            for (column, right) in columns.iter().zip(&line[..j]) {
                for (sum, left) in sums.iter_mut().zip(column) {
                    *sum -= left * right;
                }
            }
            for (place, sum) in sums.iter().enumerate() {
                columns[j][place] = sum / line[j];
            }
        }
        for i in first..first + rows {
            for j in 0..first {
                work[begins(i) + j] = columns[j][i - first];
            }
            for j in first..=i {
                let mut sum = work[begins(i) + j];
                for k in 0..j {
                    sum -= work[begins(i) + k] * work[begins(j) + k];
                }
                if i == j {
                    if sum.is_nan() || sum <= 0.0 {
                        return None;
                    }
                    work[begins(i) + i] = libm::sqrt(sum);
                } else {
                    work[begins(i) + j] = sum / work[begins(j) + j];
                }
            }
        }
    }
    Some(factor)
}

/// Lower triangle of the first `side` rows of the inverse of `factor · factorᵀ`: all of its columns at once, each as
/// [`forward`] and [`backward`] would make it.
fn first_of_inverse(factor: &[f64], n: usize, side: usize) -> Vec<f64> {
    if side == 0 {
        return Vec::new();
    }
    let mut x = vec![0.0; n * side];
    for j in 0..side {
        x[j * side + j] = 1.0;
    }
    let mut known = vec![0.0; side];
    for i in 0..n {
        let (before, rest) = x.split_at_mut(i * side);
        known.fill(0.0);
        for (line, weight) in before.chunks_exact(side).zip(&factor[row(i)..row(i) + i]) {
            add_times(&mut known, *weight, line);
        }
        divide(&mut rest[..side], &known, factor[row(i) + i]);
    }
    for i in (0..n).rev() {
        let (rest, behind) = x.split_at_mut((i + 1) * side);
        known.fill(0.0);
        for (line, j) in behind.chunks_exact(side).zip(i + 1..) {
            add_times(&mut known, factor[row(j) + i], line);
        }
        divide(&mut rest[i * side..], &known, factor[row(i) + i]);
    }
    let mut covariance = vec![0.0; row(side)];
    for i in 0..side {
        for j in 0..=i {
            covariance[row(i) + j] = x[i * side + j];
        }
    }
    covariance
}

fn add_times(sums: &mut [f64], weight: f64, line: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(line) {
        *sum += weight * value;
    }
}

fn divide(line: &mut [f64], known: &[f64], pivot: f64) {
    for (value, known) in line.iter_mut().zip(known) {
        *value = (*value - known) / pivot;
    }
}

/// Solves `factor · y = x` in place.
fn forward(factor: &[f64], x: &mut [f64]) {
    for i in 0..x.len() {
        let known: f64 = (0..i).map(|j| factor[row(i) + j] * x[j]).sum();
        x[i] = (x[i] - known) / factor[row(i) + i];
    }
}

/// Solves `factorᵀ · y = x` in place.
fn backward(factor: &[f64], x: &mut [f64]) {
    for i in (0..x.len()).rev() {
        let known: f64 = (i + 1..x.len()).map(|j| factor[row(j) + i] * x[j]).sum();
        x[i] = (x[i] - known) / factor[row(i) + i];
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
    fn a_group_taken_out_leaves_the_same_answer_as_one_kept() {
        // Given two lines of one slope (shared) with their own intercepts and bends,
        let rows = [(0.0, 1.0, 1.1), (1.0, 4.0, 2.9), (2.5, 0.5, 8.0), (4.0, 2.0, 12.5)];
        let mut kept = NormalEquations::new(3);
        kept.add(&[(1, 1.0)], 0.0, 9.0);
        kept.add(&[(2, 1.0)], 0.0, 4.0);
        let mut group = Group::new([9.0, 4.0]);
        for (x, bend, y) in rows {
            kept.add(&[(0, x), (1, 1.0), (2, bend)], y, 0.5);
            group.add(&[(0, x)], [1.0, bend], y, 0.5);
        }
        let mut taken_out = NormalEquations::new(1);
        taken_out.add_group(&group);
        // then slope, its variance and the own unknowns agree with the full system.
        let (full, reduced) = (kept.solve().unwrap(), taken_out.solve().unwrap());
        let (own, _) = group.own(&reduced).unwrap();
        assert!((full.values[0] - reduced.values[0]).abs() < 1e-12);
        assert!((full.variance(0) - reduced.variance(0)).abs() < 1e-12);
        assert!((full.values[1] - own[0]).abs() < 1e-12 && (full.values[2] - own[1]).abs() < 1e-12);
    }

    /// Twenty unknowns that all have to do with each other.
    fn entangled() -> NormalEquations {
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
    fn rows_that_are_worked_out_together_have_the_bits_of_rows_by_themselves() {
        let NormalEquations { a, .. } = entangled();
        // The textbook: one row after the other, one sum after the other.
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
    fn what_is_told_of_the_first_unknowns_is_what_is_told_of_all() {
        let equations = entangled();
        let (some, all) = (equations.solve_for_first(6).unwrap(), equations.solve().unwrap());
        assert_eq!(some.values, all.values);
        for i in 0..6 {
            for j in 0..=i {
                assert_eq!(some.covariance(i, j), all.covariance(i, j));
            }
        }
        // The inverse by its own definition: the matrix times a column of it is a column of the unit matrix.
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
    fn what_nothing_is_known_of_is_refused() {
        let mut half = NormalEquations::new(2);
        half.add(&[(0, 1.0)], 1.0, 1.0);
        assert!(half.solve().is_none());
    }
}
