//! The limits of a calibration.

use alloc::vec::Vec;

use crate::ids::StretchId;
use crate::time::TimeSpan;
use crate::units::Length;

/// The limits of one session with one train.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratorSettings {
    /// Longest track time of the session, from its first command to the train at rest.
    pub budget: TimeSpan,
    /// Longest distance from the pickup to the rear of the train: no turnout closer behind it is thrown.
    pub train_length: Length,
    /// Stretches that other trains occupy or have reserved: no circuit uses them.
    pub avoid: Vec<StretchId>,
}

impl Default for CalibratorSettings {
    fn default() -> Self {
        Self {
            // A full calibration takes five minutes.
            budget: TimeSpan::from_s(300.0),
            // A locomotive with three coaches of 27 cm and a pickup in the middle.
            train_length: Length::from_mm(900.0),
            avoid: Vec::new(),
        }
    }
}
