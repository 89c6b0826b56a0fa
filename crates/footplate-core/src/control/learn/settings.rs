//! What a calibration may take, and what it has to keep away from.

use alloc::vec::Vec;

use crate::ids::StretchId;
use crate::time::TimeSpan;
use crate::units::Length;

/// The bounds of one session with one train.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratorSettings {
    /// Track time that the session may take, from its first command to the train at rest.
    pub budget: TimeSpan,
    /// The longest that the train may be behind its pickup: no turnout so near behind it is thrown.
    pub train_length: Length,
    /// Rails that others stand on or own: no circuit leads over them.
    pub avoid: Vec<StretchId>,
    /// Set every turnout of unknown position straight before the train moves.
    pub sets_turnouts: bool,
}

impl Default for CalibratorSettings {
    fn default() -> Self {
        Self {
            // The five minutes in which a full calibration should be done.
            budget: TimeSpan::from_s(300.0),
            // A locomotive with three coaches of 27 cm and a pickup in the middle.
            train_length: Length::from_mm(900.0),
            avoid: Vec::new(),
            sets_turnouts: false,
        }
    }
}
