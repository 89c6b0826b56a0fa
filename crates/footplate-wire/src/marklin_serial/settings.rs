//! What an interface and the line to it are like.

use footplate_core::TimeSpan;

use super::exchange::REPLY_ALLOWANCE;
use super::pacing::Pace;

/// What the interface is like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// How many S88 modules are on its bus, 1 to 31.
    pub modules: u8,
    /// How it is known when it takes the next byte.
    pub pace: Pace,
    /// How much later than its bytes take a reply may come before it is lost: 20 ms where the line ends at this
    /// computer, more where bytes travel further or are handed over in portions.
    pub reply_allowance: TimeSpan,
    /// Whether trains drive with F0 on, which is said anew with each step.
    pub light: bool,
}

impl Settings {
    /// A line with a hand-shake that ends at this computer.
    pub const fn with_cts(modules: u8) -> Self {
        Self { modules, pace: Pace::Cts, reply_allowance: REPLY_ALLOWANCE, light: true }
    }

    /// The same line without the hand-shake.
    pub const fn timed(modules: u8, pace: Pace) -> Self {
        Self { pace, ..Self::with_cts(modules) }
    }
}
