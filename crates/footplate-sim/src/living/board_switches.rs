//! The properties of a virtual DCC-EX board, as observed on the real firmware or reported of it.

use footplate_core::Ratio;

use crate::living::delivery::Delivery;

/// The properties of the board and its line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardSwitches {
    /// Whether it sends its identity after a reset, with the text around it.
    pub has_banner: bool,
    /// How often a message has a diagnostic or display text before it.
    pub chatter: Ratio,
    /// Whether it confirms a command to a turnout that is already in that position.
    pub answers_unchanged: bool,
    /// Whether bytes beyond its input buffer of 64 are lost.
    pub overruns: bool,
    /// How often a byte is lost on the line, in either direction.
    pub lost: Ratio,
    /// The portions in which its messages arrive.
    pub delivery: Delivery,
}

impl Default for BoardSwitches {
    fn default() -> Self {
        Self {
            has_banner: true,
            chatter: Ratio::ZERO,
            answers_unchanged: false,
            overruns: true,
            lost: Ratio::ZERO,
            delivery: Delivery::Each,
        }
    }
}
