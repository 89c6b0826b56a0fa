//! From the chain of commands and reports to a motion model.
//!
//! [`MotionFit`] takes a chain of trips (`chain`, `trip`), makes a row of residuals of each (`rows`, made robust by
//! `robust`), and solves for the model; trips that are old are kept as a prior (`marginal_prior`). [`Refit`] does the same
//! in parts of milliseconds.

#[cfg(feature = "serde")]
mod bits;
mod chain;
mod course;
mod foreseen;
mod hindsight;
mod learn;
mod marginal_prior;
mod motion_fit;
mod robust;
mod rows;
mod stated;
mod steady_passes;
mod step_changes;
mod trip;
mod unknowns;

pub use motion_fit::{MotionFit, Refit};
pub use stated::{StatedFit, StatedMotion, StatedSpeed};
pub use step_changes::StepChanges;
