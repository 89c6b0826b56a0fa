//! The one loop around a line, a session and a machine: live, simulated and in tests.
//!
//! ```text
//! run         bytes in, bytes out, entries written down before the machine sees them
//! attendant   who watches it: notices to people, orders from them
//! ending      trains are commanded to stop, whatever ends it; what could not be confirmed is said
//! last_will   what a guardian says to the station if this program dies
//! stop_flag   Ctrl-C and the signals that end a program
//! ```

mod attendant;
mod ending;
mod last_will;
mod run;
mod stop_flag;

#[cfg(test)]
mod over_a_board;
#[cfg(test)]
mod over_a_network;
#[cfg(test)]
mod over_a_simulation;

pub(crate) use attendant::{Attendant, Recorder, Wish};
pub(crate) use ending::Ended;
pub(crate) use last_will::{WillLine, carry_out, written};
pub(crate) use run::Runtime;
pub(crate) use stop_flag::StopFlag;
