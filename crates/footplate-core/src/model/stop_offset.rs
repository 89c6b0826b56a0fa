//! What stops are longer or shorter by for the place where they end: gradients, mostly.
//!
//! Downhill friction takes less of a stop, uphill more; nobody surveys the gradients of a layout. Each hop has a number of its
//! own for how much longer stops that end on it are, learnt from where the train was found to have stopped. How far these
//! numbers may be from nothing is learnt with them: on a level layout they stay there.

use alloc::collections::BTreeMap;

use crate::linalg::Gaussian;

/// Speed (m/s) up to which a stop grows as friction lets it: friction of 15 mm/s² over a lag of 2 s.
const FRICTION_SPEED: f64 = 0.03;
/// Offsets are those of stops from this speed (m/s), a middle one.
const REFERENCE_SPEED: f64 = 0.3;
/// Offsets are at least so free (m), so that those of a level layout could still become something.
const LEAST_DEVIATION: f64 = 0.0005;
/// Beforehand half of what stops scatter by beyond what is usual (m²) is by their places, ...
const BY_PLACE: f64 = 0.5;
/// ... which is worth as much as so many hops.
const WORTH: f64 = 4.0;

/// The part of its offset that a stop from a speed (m/s) shows.
///
/// A lagging stop is shorter by `f θ² ln(1 + v/(f θ))` for the friction `f`: what a gradient adds to `f` tells by the logarithm of
/// the speed. The same shape does for other laws, which feel gradients less.
pub(super) fn stop_offset_share(speed: f64) -> f64 {
    libm::log1p(speed.max(0.0) / FRICTION_SPEED) / libm::log1p(REFERENCE_SPEED / FRICTION_SPEED)
}

/// By how much stops that end on a hop are longer than elsewhere, hop by hop.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct StopOffsets {
    /// By hop: the offset of a stop from the reference speed (m), and its variance.
    pub(super) of_hop: BTreeMap<usize, (f64, f64)>,
    /// One standard deviation of them (m).
    pub(super) deviation: f64,
}

impl StopOffsets {
    /// Of a stop that ends on a hop, at the reference speed; of one that ends nobody knows where.
    pub(super) fn of(&self, hop: Option<usize>) -> Gaussian {
        let known = hop.and_then(|hop| self.of_hop.get(&hop).copied());
        let (mean, variance) = known.unwrap_or((0.0, self.variance()));
        Gaussian { mean, variance }
    }

    /// Their variance about nothing (m²).
    pub(super) fn variance(&self) -> f64 {
        self.deviation.max(LEAST_DEVIATION) * self.deviation.max(LEAST_DEVIATION)
    }

    /// A fit found these. The deviation goes towards what they and what is not known of them show, by expectation and
    /// maximisation (Dempster, Laird and Rubin, 1977), from what stops scatter by anyway (m).
    pub(super) fn learn(&mut self, found: BTreeMap<usize, (f64, f64)>, floor: f64) {
        let squares: f64 = found.values().map(|(offset, variance)| offset * offset + variance).sum();
        let count = found.len() as f64;
        self.deviation = libm::sqrt((squares + WORTH * BY_PLACE * floor * floor) / (count + WORTH));
        self.of_hop = found;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_count_in_full_at_a_middle_speed_and_little_at_a_crawl() {
        assert!((stop_offset_share(REFERENCE_SPEED) - 1.0).abs() < 1e-12);
        assert!((0.2..0.35).contains(&stop_offset_share(0.03)));
        assert_eq!(stop_offset_share(-1.0), 0.0);
    }

    #[test]
    fn the_deviation_becomes_that_of_the_offsets() {
        let mut offsets = StopOffsets::default();
        let found =
            |size: f64| (0..40).map(|hop| (hop, (if hop % 2 == 0 { size } else { -size }, 1e-6))).collect();
        offsets.learn(found(0.03), 0.0);
        assert!((0.027..0.031).contains(&offsets.deviation), "{}", offsets.deviation);
        offsets.learn(found(0.0), 0.0);
        assert!(offsets.deviation < 0.001);
        assert_eq!(offsets.of(Some(99)).mean, 0.0);
    }
}
