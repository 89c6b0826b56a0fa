//! How exactly the place of a train is known at the moment it passes a balise.

use crate::units::Length;

/// The error of one passage: where the balise lies, where its antenna hears it, and how late it is said.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BaliseAccuracy {
    /// One standard deviation.
    pub deviation: Length,
    /// Largest error of a passage, forward or backward. Every guarantee rests on it.
    pub bound: Length,
}

impl Default for BaliseAccuracy {
    /// A standard deviation of 0.5 m and a bound five times as wide. Chosen: an antenna that hears a balise within about a
    /// metre, and a survey of the same quality.
    fn default() -> Self {
        Self { deviation: Length::from_m(0.5), bound: Length::from_m(2.5) }
    }
}
