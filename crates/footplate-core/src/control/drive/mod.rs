//! Driving: from an order to a train at rest within millimetres of its target.
//!
//! A [`Driver`] accepts [`Order`]s and reports their progress in [`Notice`](super::Notice)s. It estimates every
//! train's position between sensors, plans each stop again after every detection, and sends the stop command at the
//! planned time by the clock, even if no further sensor reports.

mod ambiguity;
mod approach;
mod backward;
mod blocks;
mod command_time;
mod data_association;
mod detections;
mod driven_train;
mod driver;
mod ends;
mod expectation;
mod hypotheses;
mod order;
mod outputs;
mod pacing;
mod path;
mod queries;
mod refusal;
mod reported_speed;
mod sensor_faults;
mod speed_reports;
mod speed_supervision;
mod stop_planning;
mod strayed;
mod task;
mod turnout_guard;
mod unassigned;

pub use driver::Driver;
pub use order::{Aim, Gap, Order, OrderId, StopOrder};
pub use pacing::ArrivalProfile;
pub use refusal::Refusal;
pub(in crate::control) use stop_planning::AT_TARGET;
