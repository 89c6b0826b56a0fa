//! WiThrottle, the server's side: phones with Engine Driver, WiThrottle or a similar program drive trains.
//!
//! A phone sends lines of text; it has no sensors and no clock of its own. It is the only throttle protocol whose
//! server notices that a throttle has died.
//!
//! - [`ClientLine`] is a line of a phone, [`ServerLine`] a line to it.
//! - [`Phone`] is the conversation with one phone: which trains it drives, what it displays, and when it was last heard.

mod client_line;
mod phone;
mod server_line;

pub use client_line::{Action, ClientLine, LONGEST_LINE, ThrottleKey, TurnoutAction};
pub use phone::{HEARTBEAT, Phone, PhoneOrder, PhoneOutput, Railway, RosterTrain, SILENCE_LIMIT, TrainState};
pub use server_line::{FULL_SPEED, ServerLine};
