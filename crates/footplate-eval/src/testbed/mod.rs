//! Calibrated trains in a simulated world: the starting point of all scores.
//!
//! [`VirtualLine`] connects a machine with a simulated station; [`Calibrated`] is the result of a calibration;
//! [`PreparedTrains`] are several trains on one layout, each calibrated while the others were off it;
//! [`LongestCircuit`] is where they run.

mod calibrated;
mod longest_circuit;
mod prepared_trains;
mod virtual_line;

pub use self::calibrated::{Calibrated, calibrate};
pub use self::longest_circuit::LongestCircuit;
pub use self::prepared_trains::PreparedTrains;
pub(crate) use self::prepared_trains::{GRIEF, in_words, nearest_step, speed, steps};
pub use self::virtual_line::VirtualLine;
