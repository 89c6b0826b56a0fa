//! Moments at which something is killed: many, and all drawn from one seed that a failure names.

use std::ops::Range;
use std::time::Duration;

/// Draws other moments than those of every day: any whole number.
const SEED: &str = "FOOTPLATE_SEED";

/// Moments drawn from a seed.
pub(crate) struct DrawnMoments {
    pub(crate) seed: u64,
    state: u64,
}

impl DrawnMoments {
    /// From the seed in the environment, or that of every day.
    pub(crate) fn new() -> Self {
        let seed = std::env::var(SEED).ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
        Self { seed, state: seed }
    }

    /// SplitMix64 (Steele, Lea and Flood, 2014).
    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// One of these numbers.
    pub(crate) fn one_of(&mut self, numbers: Range<u64>) -> u64 {
        numbers.start + self.bits() % (numbers.end - numbers.start)
    }

    /// A time to wait, in microseconds within this range.
    pub(crate) fn wait_us(&mut self, range: Range<u64>) -> Duration {
        Duration::from_micros(self.one_of(range))
    }
}
