//! How one train answers its commands: speeds, ways of changing speed, stops, and lengths as it feels them.
//!
//! [`MotionModel`] is all of it with its uncertainty, and the covariance between any two of its numbers, from which
//! experiments are planned and stops are promised. It is made by [`MotionFit`] from everything the train did so far:
//! not from experiments of a set form, but from the one chain of commands and contacts that any driving is.

mod fit;
mod model;
mod parameters;

pub use fit::MotionFit;
pub use model::{MotionModel, StepUse, StopForecast};
