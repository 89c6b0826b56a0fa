//! Keeping trains to a pace: any speed out of coarse steps, behind another train, or in time at a place.
//!
//! What a train should do is a [`Reference`]: where it should be at a few moments ahead, in surveyed lengths. A
//! [`StepSearch`] finds the commands that bring its most likely course nearest to that, within a budget of commands; the
//! first of them is given, and everything is looked at again when something was learnt.

mod arrival_plan;
mod arrive;
mod command_budget;
mod follow;
mod hold;
mod ideal_line;
mod last_step;
mod lead_line;
mod pace;
mod pacer;
mod passages;
mod reference;
mod step_search;
mod surveyed_path;
mod task;
mod zoned_transit;

pub use arrival_plan::ArrivalProfile;
pub(super) use pace::Pacing;
pub(super) use passages::Passages;
