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
    /// Lower triangle of the inverse of the information matrix.
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
        let n = self.unknowns;
        let factor = cholesky(&self.a, n)?;
        let mut values = self.b.clone();
        forward(&factor, &mut values);
        backward(&factor, &mut values);
        let mut covariance = vec![0.0; row(n)];
        for j in 0..n {
            let mut column = vec![0.0; n];
            column[j] = 1.0;
            forward(&factor, &mut column);
            backward(&factor, &mut column);
            for i in j..n {
                covariance[row(i) + j] = column[i];
            }
        }
        Some(Solution { values, covariance })
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

/// The lower factor of a positive definite matrix, or `None` when it is not.
fn cholesky(a: &[f64], n: usize) -> Option<Vec<f64>> {
    let mut factor = a.to_vec();
    for i in 0..n {
        for j in 0..=i {
            let mut sum = factor[row(i) + j];
            for k in 0..j {
                sum -= factor[row(i) + k] * factor[row(j) + k];
            }
            if i == j {
                if sum.is_nan() || sum <= 0.0 {
                    return None;
                }
                factor[row(i) + i] = libm::sqrt(sum);
            } else {
                factor[row(i) + j] = sum / factor[row(j) + j];
            }
        }
    }
    Some(factor)
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

    #[test]
    fn what_nothing_is_known_of_is_refused() {
        let mut half = NormalEquations::new(2);
        half.add(&[(0, 1.0)], 1.0, 1.0);
        assert!(half.solve().is_none());
    }
}
