//! Nonlinear least squares with priors.
//!
//! Gauss-Newton iteration, damped until a step lowers the cost (Levenberg, 1944). Letters: `x` unknowns, `r`
//! residual, `σ²` variance of one measurement.
//!
//! ```text
//! cost = Σ r²/σ² + Σ (x − prior)²/spread²
//! ```
#![expect(clippy::indexing_slicing, reason = "every index is below the number of unknowns")]

use alloc::vec::Vec;

use super::{NormalEquations, Solution};

const MAX_ITERATIONS: usize = 80;
/// The iteration ends after a step that lowers the cost by less than this part.
const CONVERGED: f64 = 1e-9;
/// Initial damping, and the damping beyond which no step lowers the cost.
const DAMPING: f64 = 1e-3;
const MIN_DAMPING: f64 = 1e-9;
const MAX_DAMPING: f64 = 1e9;
/// Factor of the damping after a step that lowers the cost, and after one that does not.
const DAMPING_DECREASE: f64 = 0.2;
const DAMPING_INCREASE: f64 = 8.0;
/// Information of an unknown that no measurement depends on; keeps its damping finite.
const LEAST_INFORMATION: f64 = 1e-12;

/// One unknown: its prior, and the step of its numerical derivative.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unknown {
    /// Mean of the prior.
    pub(crate) prior: f64,
    /// Standard deviation of the prior.
    pub(crate) spread: f64,
    /// Step of the numerical derivative, small compared with the curvature.
    pub(crate) step: f64,
    /// Whether it is fitted; otherwise it keeps its initial value.
    pub(crate) is_free: bool,
}

/// A curve to fit: residuals of its measurements (measured minus predicted), and the variance of one measurement.
pub(crate) struct CurveFit<'f, R, V> {
    pub(crate) unknowns: &'f [Unknown],
    pub(crate) residuals: R,
    pub(crate) variance: V,
}

/// The fitted unknowns and their covariance.
#[derive(Debug, Clone)]
pub(crate) struct FittedCurve {
    pub(crate) x: Vec<f64>,
    free: Vec<usize>,
    solution: Solution,
}

impl<R: Fn(&[f64]) -> Vec<f64>, V: Fn(&[f64]) -> f64> CurveFit<'_, R, V> {
    /// The unknowns with the lowest cost near `first`; `None` if the measurements do not determine them.
    pub(crate) fn fitted(&self, first: &[f64]) -> Option<FittedCurve> {
        let free: Vec<usize> = (0..self.unknowns.len()).filter(|&at| self.unknowns[at].is_free).collect();
        let mut x = first.to_vec();
        let mut variance = (self.variance)(&(self.residuals)(&x));
        let (mut damping, mut cost) = (DAMPING, self.cost(&x, variance));
        for _ in 0..MAX_ITERATIONS {
            let step = self.equations(&x, variance, &free, damping).values()?;
            let mut next = x.clone();
            for (unknown, by) in free.iter().zip(&step) {
                next[*unknown] += by;
            }
            let next_cost = self.cost(&next, variance);
            if next_cost < cost {
                let gained = cost - next_cost;
                x = next;
                damping = (DAMPING_DECREASE * damping).max(MIN_DAMPING);
                let settled = gained < CONVERGED * cost;
                variance = (self.variance)(&(self.residuals)(&x));
                cost = self.cost(&x, variance);
                if settled {
                    break;
                }
            } else {
                damping *= DAMPING_INCREASE;
                if damping > MAX_DAMPING {
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

    /// The normal equations of the step from `x`; the prior acts on the distance of `x` from it.
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

    /// The derivative of each prediction with respect to one unknown.
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

    /// A function of the unknowns, with its standard deviation to first order.
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
