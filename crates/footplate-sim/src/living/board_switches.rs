//! How a virtual DCC-EX board behaves, each as it was seen on the real firmware or reported of it.

use footplate_core::Ratio;

use crate::living::delivery::Delivery;

/// How the board and its line behave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardSwitches {
    /// Whether it says after a reset what it is, with the text around that.
    pub has_banner: bool,
    /// How often a message has a diagnostic or display text before it.
    pub chatter: Ratio,
    /// Whether a turnout is answered that lies as it should already.
    pub answers_unchanged: bool,
    /// Whether bytes are lost that its input buffer of 64 does not hold.
    pub overruns: bool,
    /// How often a byte is lost on the line, in either direction.
    pub lost: Ratio,
    /// How its messages are cut.
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
