//! Linear algebra as small as the estimators need it.

mod cholesky;
mod normal_equations;

pub use normal_equations::{Eliminated, NormalEquations, Solution};
