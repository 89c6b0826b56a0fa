//! Cholesky factorisation of a symmetric positive definite matrix, stored as a lower triangle row by row.
#![expect(
    clippy::indexing_slicing,
    reason = "all indices stay below the size for which the vectors are made"
)]

use alloc::vec;
use alloc::vec::Vec;

/// The index at which row `i` of a lower triangle starts.
pub(super) const fn row(i: usize) -> usize {
    i * (i + 1) / 2
}

/// Rows of the factor that are computed together, so that their sums do not wait for one another.
const ROWS_TOGETHER: usize = 8;

/// The lower factor of a positive definite matrix, or `None` if the matrix is not.
///
/// Every sum is taken term by term in the textbook's order: the result has the same bits as one row after another.
pub(super) fn cholesky(a: &[f64], n: usize) -> Option<Vec<f64>> {
    let mut factor = a.to_vec();
    // The rows in progress, column by column.
    let mut columns = vec![[0.0; ROWS_TOGETHER]; n];
    for first in (0..n).step_by(ROWS_TOGETHER) {
        let rows = ROWS_TOGETHER.min(n - first);
        let (above, work) = factor.split_at_mut(row(first));
        let begins = |i: usize| row(i) - row(first);
        for j in 0..first {
            let line = &above[row(j)..row(j + 1)];
            let mut sums = [0.0; ROWS_TOGETHER];
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

/// The lower triangle of the first `side` rows of the inverse of `factor · factorᵀ`: all columns at once, each as by
/// [`forward`] and [`backward`].
pub(super) fn first_of_inverse(factor: &[f64], n: usize, side: usize) -> Vec<f64> {
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
pub(super) fn forward(factor: &[f64], x: &mut [f64]) {
    for i in 0..x.len() {
        let known: f64 = (0..i).map(|j| factor[row(i) + j] * x[j]).sum();
        x[i] = (x[i] - known) / factor[row(i) + i];
    }
}

/// Solves `factorᵀ · y = x` in place.
pub(super) fn backward(factor: &[f64], x: &mut [f64]) {
    for i in (0..x.len()).rev() {
        let known: f64 = (i + 1..x.len()).map(|j| factor[row(j) + i] * x[j]).sum();
        x[i] = (x[i] - known) / factor[row(i) + i];
    }
}
