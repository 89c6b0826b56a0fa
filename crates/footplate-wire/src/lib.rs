//! Bytes to reports, commands to bytes: one folder a command station, no sockets.
//!
//! A codec knows bytes and what they mean. Who asked what and when, and over which cable, is decided above.
#![no_std]

pub mod marklin_serial;
