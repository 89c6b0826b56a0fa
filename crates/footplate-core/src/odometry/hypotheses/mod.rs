//! Competing hypotheses of what two wheelsets and their sensors do, each with a filter and a probability.
//!
//! [`Hypothesis`] lists them. Each explains all counts of a period with some likelihood (`evidence`), and follows another at stated
//! rates (`rates`). Where likelihoods cannot tell them apart, the interval reaches further (`reach`). The bank of filters
//! (`bank`) is an interacting multiple model (Blom and Bar-Shalom, 1988) in which all transitions pass through one pool.

mod advance;
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
