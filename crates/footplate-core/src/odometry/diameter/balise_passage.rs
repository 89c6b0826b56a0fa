//! Passages of balises, how exactly each tells the place of a train, and the distances between them by position and by wheels.

use super::scale_interval::ScaleInterval;
use crate::units::Length;

/// No wheel that was never found slipping or sliding creeps more than this in the mean between two balises, its cone in
/// curves included. Chosen: 0.1 % for curves and 0.2 % for creepage.
const CREEPAGE_BOUND: f64 = 3e-3;

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

/// One passage of a balise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passage {
    /// Where it lies.
    pub(super) place: Length,
    /// What was counted by the middle of the period ...
    pub(super) counted: [Length; 2],
    /// ... and half of what was counted in it: it was passed at any time within.
    pub(super) within: [Length; 2],
    /// Which wheelsets were counted and rolled ever since.
    pub(super) rolled: [bool; 2],
}

/// The distance from one balise to another by one wheelset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PairedDistance {
    /// By the balises, negative if the wheels turned backwards.
    pub(super) said: Length,
    /// By the wheelset.
    pub(super) counted: Length,
    /// Uncertainty of that, because balises are passed at any time of a period.
    pub(super) within: Length,
    /// Whether it was read and rolled throughout.
    pub(super) rolled: bool,
}

impl Passage {
    /// The distances to a later passage by both wheelsets.
    pub(super) fn distances_to(&self, later: &Self) -> [PairedDistance; 2] {
        let [first, second] = distances(self.counted, later.counted);
        let [first_from, second_from] = self.counted;
        let [first_to, second_to] = later.counted;
        let backward = first_to + second_to < first_from + second_from;
        let said = (later.place - self.place) * if backward { -1.0 } else { 1.0 };
        let [first_within, second_within] = self.within;
        let [first_open, second_open] = later.within;
        let [first_rolled, second_rolled] = self.rolled;
        [
            PairedDistance { said, counted: first, within: first_within + first_open, rolled: first_rolled },
            PairedDistance {
                said,
                counted: second,
                within: second_within + second_open,
                rolled: second_rolled,
            },
        ]
    }
}

impl PairedDistance {
    /// The scales that are possible when the wheelset rolled, for balises that are off by this together and a pulse.
    pub(super) fn allows(&self, off: Length, pulse: Length) -> Option<ScaleInterval> {
        let open = pulse + self.within;
        ScaleInterval::of_distances(
            [(self.said - off) * (1.0 - CREEPAGE_BOUND), (self.said + off) * (1.0 + CREEPAGE_BOUND)],
            [self.counted - open, self.counted + open],
        )
    }

    /// What the balises could say when the scale is within an interval.
    pub(super) fn possible(&self, interval: ScaleInterval, off: Length, pulse: Length) -> [Length; 2] {
        let open = pulse + self.within;
        let low = (self.counted - open).max(Length::ZERO) * (interval.low / (1.0 + CREEPAGE_BOUND)) - off;
        let high = (self.counted + open) * (interval.high / (1.0 - CREEPAGE_BOUND)) + off;
        [low.max(Length::ZERO), high]
    }
}

/// How far both wheelsets turned from one reading to another.
pub(super) fn distances([first_from, second_from]: [Length; 2], [first, second]: [Length; 2]) -> [Length; 2] {
    [(first - first_from).abs(), (second - second_from).abs()]
}
