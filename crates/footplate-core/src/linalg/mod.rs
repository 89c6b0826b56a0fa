//! The linear algebra that the estimators need.

mod cholesky;
mod curve_fit;
mod normal_equations;

pub(crate) use curve_fit::{CurveFit, FittedCurve, Unknown};
pub use normal_equations::{Eliminated, NormalEquations, Solution};

/// A normal distribution of one number: its mean and variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gaussian {
    pub(crate) mean: f64,
    pub(crate) variance: f64,
}
