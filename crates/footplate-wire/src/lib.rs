//! Bytes to reports, commands to bytes: one folder a command station, no sockets.
//!
//! - A codec knows bytes and what they mean. A [`Session`] knows who asked what and when, and when to ask again. Over
//!   which cable, is decided above.
#![no_std]

extern crate alloc;

pub mod dcc_ex;
mod dialogue;
mod farewell;
mod locomotives;
pub mod loconet;
pub mod marklin_can;
pub mod marklin_serial;
mod news;
mod opening;
mod outstanding;
mod pacing;
mod queue;
mod sensors;
mod session;
mod silence;
pub mod z21;

pub use session::{Closing, CommandError, Confirmation, LinkNotice, Session, Transmit};
