//! Command station protocols: bytes to reports, commands to bytes; one folder for each station, no sockets.
//!
//! - A codec knows bytes and their meaning. A [`Session`] knows which requests are outstanding and when to repeat them. The caller
//!   chooses the cable.
#![no_std]

extern crate alloc;

mod blocks;
pub mod dcc_ex;
mod dialogue;
mod directions;
mod farewell;
pub mod jmri;
mod lines;
mod locomotives;
pub mod loconet;
pub mod marklin_can;
pub mod marklin_serial;
mod news;
mod outstanding;
mod pacing;
mod protocol;
mod queue;
mod reported_functions;
mod sensors;
mod session;
mod silence;
pub mod withrottle;
pub mod z21;

pub use blocks::BlockReports;
pub use reported_functions::ReportedFunctions;
pub use session::{Closing, CommandError, Confirmation, LinkNotice, Session, Transmit};
