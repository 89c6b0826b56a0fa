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
mod trip;
mod unknowns;

pub use motion_fit::{MotionFit, Refit};
pub use stated::{StatedFit, StatedMotion, StatedSpeed};

/// Runs with more step changes than this are not fitted. A train that holds a speed between two steps changes every
/// second; the cost of a fit is changes times detections, and such a run adds little information.
pub const MOST_STEP_CHANGES: usize = 16;
