//! The linear algebra that the estimators need.

mod cholesky;
mod curve_fit;
mod gaussian;
mod normal_equations;

pub(crate) use curve_fit::{CurveFit, FittedCurve, Unknown};
pub(crate) use gaussian::Gaussian;
pub use normal_equations::{Eliminated, NormalEquations, Solution};
