//! What two wheelsets and their sensors may be doing, side by side, each hypothesis with a filter and a probability.
//!
//! The hypotheses are listed in [`Hypothesis`]. Every one explains all counts of a period; how well it does is its
//! likelihood (`evidence`). A hypothesis can end and another begin at stated rates (`rates`). The bank of filters
//! (`bank`) is an interacting multiple model (Blom and Bar-Shalom, 1988) in which all transitions pass through one pool.

mod arrivals;
mod bank;
mod evidence;
mod filters;
mod interval;
mod lanes;
mod rates;
mod reach;
mod scene;
mod slides;
mod touch;

pub(super) use bank::Bank;
pub use rates::{HYPOTHESES, Hypothesis};
pub(super) use scene::{Scene, WheelScene};
