//! Bytes to reports, commands to bytes: one folder a command station, no sockets.
#![no_std]
