//! The loop around a line, a session and a machine: the same live, simulated and in tests.
//!
//! ```text
//! run         bytes in, bytes out; entries are recorded before the machine receives them
//! attendant   interfaces to the record and to people
//! ending      how a run ends
//! last_will   what a guardian sends to the station if this program dies
//! will_line   the line over which it does, until the station has heard it
//! stop_flag   Ctrl-C and the signals that end a program
//! ```

mod attendant;
mod ending;
mod last_will;
mod run;
mod stop_flag;
mod will_line;

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
pub(crate) use last_will::written;
pub(crate) use run::Runtime;
pub(crate) use stop_flag::StopFlag;
pub(crate) use will_line::{WillLine, carry_out};
