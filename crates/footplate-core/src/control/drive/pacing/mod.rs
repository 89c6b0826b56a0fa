//! Pacing: holds any speed with coarse steps, follows another train, or arrives at a place at a given time.
//!
//! A [`Reference`](reference::Reference) states where the train should be at a few times ahead, in surveyed lengths.
//! A [`StepSearch`](step_search::StepSearch) finds the commands that bring its predicted motion closest to that,
//! within a budget of commands. The first of them is sent; the search is repeated after each report.

mod arrival_plan;
mod arrive;
mod follow;
mod hold;
mod last_step;
mod lead_line;
mod pace;
mod reference;
mod step_search;
mod zoned_transit;

pub use arrival_plan::ArrivalProfile;
pub(super) use lead_line::Passages;
pub(super) use pace::Pacing;
