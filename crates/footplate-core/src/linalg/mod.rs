//! Linear algebra as small as the estimators need it.

mod normal_equations;

pub use normal_equations::{Group, NormalEquations, Solution};
