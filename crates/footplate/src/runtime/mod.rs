//! The loop around a line, a session and a machine: the same live, simulated and in tests.
//!
//! ```text
//! run         bytes in, bytes out; entries are recorded before the machine receives them
//! attendant   interfaces to the record and to people
//! ending      how a run ends
//! last_will   what a guardian sends to the station if this program dies
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
mod over_a_half_open_line;
#[cfg(test)]
mod over_a_network;
#[cfg(test)]
mod over_a_simulation;

pub(crate) use attendant::{Attendant, Recorder, Wish};
pub(crate) use ending::Ended;
pub(crate) use last_will::{WillLine, carry_out, written};
pub(crate) use run::Runtime;
pub(crate) use stop_flag::StopFlag;
