//! Trains that a program has learnt by itself, put on the rails by hand: where every scored drive begins.
//!
//! [`VirtualLine`] is the loop between a machine and a simulated station; [`Calibrated`] what a calibration leaves;
//! [`Rehearsal`] several trains on one layout, each of which was calibrated while the others were lifted; [`Way`] where they
//! can run round and round.

mod calibrated;
mod stage;
mod virtual_line;
mod way;

pub use self::calibrated::{Calibrated, calibrate};
pub use self::stage::Rehearsal;
pub use self::virtual_line::VirtualLine;
pub use self::way::Way;
