//! Trains that a program has learnt by itself, put on the rails by hand: where every scored drive begins.
//!
//! [`VirtualLine`] is the loop between a machine and a simulated station; [`Calibrated`] what a calibration leaves;
//! [`Rehearsal`] several trains on one layout, each of which was calibrated while the others were lifted; [`Way`] where they
//! can run round and round.

mod calibrated;
mod stage;
mod virtual_line;
mod way;

pub(super) use self::calibrated::{Calibrated, calibrate};
pub(super) use self::stage::Rehearsal;
pub(super) use self::virtual_line::VirtualLine;
pub(super) use self::way::Way;
