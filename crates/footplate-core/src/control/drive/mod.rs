//! Driving: from an order to a train at rest within millimetres of where it should be.
//!
//! A [`Driver`] takes [`Order`]s and says with [`Notice`]s what comes of them. It follows every train between
//! contacts, plans each stop anew at every report, and commands it at the planned time by the clock, whatever is or is
//! not reported until then.

mod approach;
mod attribution;
mod command_time;
mod contact_conduct;
mod doubt;
mod driven_train;
mod driver;
mod expectation;
mod hypotheses;
mod known_track;
mod limit;
mod order;
mod outputs;
mod pacing;
mod path_length;
mod refusal;
mod restricted_stretch;
mod speed_supervision;
mod stop_planning;
mod task;
mod turning;
mod turnout_guard;
mod watched;

pub use driver::Driver;
pub use order::{Aim, Gap, Order, OrderId, StopOrder};
pub use pacing::ArrivalProfile;
pub use refusal::Refusal;
pub(in crate::control) use stop_planning::THERE;
