//! Least squares of a curve that is not linear in its unknowns, with priors.
//!
//! Gauss's and Newton's iteration, its steps damped until they lower the cost (Levenberg, 1944). Letters: `x` unknowns, `r`
//! residual, `σ²` variance that one measurement counts with.
//!
//! ```text
//! cost = Σ r²/σ² + Σ (x − prior)²/spread²
//! ```
#![expect(clippy::indexing_slicing, reason = "every index is below the number of unknowns")]

use alloc::vec::Vec;

use super::{NormalEquations, Solution};

const MOST_ITERATIONS: usize = 80;
/// A step that lowers the cost by less than this share is the last.
const CONVERGED: f64 = 1e-9;
/// Damping at the beginning, and beyond which no step lowers the cost.
const DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-9;
const MOST_DAMPING: f64 = 1e9;
/// How much less after a step that lowers the cost, how much more after one that does not.
const DAMPED_LESS: f64 = 0.2;
const DAMPED_MORE: f64 = 8.0;
/// Information of an unknown that no measurement depends on: keeps its damping finite.
const LEAST_INFORMATION: f64 = 1e-12;

/// One unknown of a curve: what is known of it beforehand, and how finely it is varied.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unknown {
    /// Mean of the prior.
    pub(crate) prior: f64,
    /// Standard deviation of the prior.
    pub(crate) spread: f64,
    /// Step of the numerical derivative, as fine as the curve is smooth.
    pub(crate) step: f64,
    /// Whether it is found; if not, it stays as it is at the beginning.
    pub(crate) is_free: bool,
}

/// A curve to fit: residuals of its measurements (measured less predicted), and the variance one of them counts with.
pub(crate) struct CurveFit<'f, R, V> {
    pub(crate) unknowns: &'f [Unknown],
    pub(crate) residuals: R,
    pub(crate) variance: V,
}

/// Values of all unknowns, and how those that were free are known.
#[derive(Debug, Clone)]
pub(crate) struct FittedCurve {
    pub(crate) x: Vec<f64>,
    free: Vec<usize>,
    solution: Solution,
}

impl<R: Fn(&[f64]) -> Vec<f64>, V: Fn(&[f64]) -> f64> CurveFit<'_, R, V> {
    /// The unknowns with the lowest cost near `first`; `None` if they are not determined.
    pub(crate) fn fitted(&self, first: &[f64]) -> Option<FittedCurve> {
        let free: Vec<usize> = (0..self.unknowns.len()).filter(|&at| self.unknowns[at].is_free).collect();
        let mut x = first.to_vec();
        let mut variance = (self.variance)(&(self.residuals)(&x));
        let (mut damping, mut cost) = (DAMPING, self.cost(&x, variance));
        for _ in 0..MOST_ITERATIONS {
            let step = self.equations(&x, variance, &free, damping).values()?;
            let mut next = x.clone();
            for (unknown, by) in free.iter().zip(&step) {
                next[*unknown] += by;
            }
            let next_cost = self.cost(&next, variance);
            if next_cost < cost {
                let gained = cost - next_cost;
                x = next;
                damping = (DAMPED_LESS * damping).max(LEAST_DAMPING);
                let settled = gained < CONVERGED * cost;
                variance = (self.variance)(&(self.residuals)(&x));
                cost = self.cost(&x, variance);
                if settled {
                    break;
                }
            } else {
                damping *= DAMPED_MORE;
                if damping > MOST_DAMPING {
                    break;
                }
            }
        }
        let solution = self.equations(&x, variance, &free, 0.0).solve()?;
        x.iter().all(|value| value.is_finite()).then_some(FittedCurve { x, free, solution })
    }

    fn cost(&self, x: &[f64], variance: f64) -> f64 {
        let squares: f64 = (self.residuals)(x).iter().map(|r| r * r).sum();
        let offs = self.unknowns.iter().zip(x).map(|(of, value)| (value - of.prior) / of.spread);
        let prior: f64 = offs.map(|off| off * off).sum();
        let cost = squares / variance + prior;
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// For the step from `x`, so that a prior counts with how far `x` is from it.
    fn equations(&self, x: &[f64], variance: f64, free: &[usize], damping: f64) -> NormalEquations {
        let residuals = (self.residuals)(x);
        let slopes: Vec<Vec<f64>> = free.iter().map(|unknown| self.slopes(x, *unknown)).collect();
        let mut equations = NormalEquations::new(free.len());
        for (row, residual) in residuals.iter().enumerate() {
            let terms: Vec<(usize, f64)> =
                slopes.iter().enumerate().map(|(unknown, slope)| (unknown, slope[row])).collect();
            equations.add(&terms, *residual, variance);
        }
        for (place, unknown) in free.iter().enumerate() {
            let Unknown { prior, spread, .. } = self.unknowns[*unknown];
            equations.add(&[(place, 1.0)], prior - x[*unknown], spread * spread);
            if damping > 0.0 {
                let information: f64 =
                    slopes[place].iter().map(|slope| slope * slope).sum::<f64>() / variance;
                equations.add(&[(place, 1.0)], 0.0, 1.0 / (damping * information.max(LEAST_INFORMATION)));
            }
        }
        equations
    }

    /// Derivative of each prediction by one unknown.
    fn slopes(&self, x: &[f64], unknown: usize) -> Vec<f64> {
        let (mut up, mut down) = (x.to_vec(), x.to_vec());
        up[unknown] += self.unknowns[unknown].step;
        down[unknown] -= self.unknowns[unknown].step;
        let width = up[unknown] - down[unknown];
        let pairs = (self.residuals)(&down).into_iter().zip((self.residuals)(&up));
        pairs.map(|(below, above)| (below - above) / width).collect()
    }
}

impl FittedCurve {
    /// One standard deviation of an unknown; 0 if it was not free.
    pub(crate) fn deviation(&self, unknown: usize) -> f64 {
        let place = self.free.iter().position(|free| *free == unknown);
        place.map_or(0.0, |place| libm::sqrt(self.solution.variance(place)))
    }

    /// A figure that follows from the unknowns, with its standard deviation to first order.
    pub(crate) fn derived(&self, unknowns: &[Unknown], of: impl Fn(&[f64]) -> f64) -> (f64, f64) {
        let value = of(&self.x);
        let terms: Vec<(usize, f64)> = self
            .free
            .iter()
            .enumerate()
            .map(|(place, unknown)| {
                let mut up = self.x.clone();
                up[*unknown] += unknowns[*unknown].step;
                (place, (of(&up) - value) / unknowns[*unknown].step)
            })
            .collect();
        (value, libm::sqrt(self.solution.variance_of(&terms)))
    }
}
