//! By how much stops are longer or shorter because of where they end, mostly through gradients.
//!
//! Gravity lengthens a stop downhill and shortens it uphill; layouts come without surveyed gradients. Each hop therefore has a
//! stop offset, learnt from where trains came to rest there. The standard deviation of these offsets is learnt with them: on a
//! level layout they stay near zero.

use alloc::collections::BTreeMap;

use crate::linalg::Gaussian;

/// Speed (m/s) up to which a stop grows as friction lets it: friction of 15 mm/s² over a lag of 2 s.
const FRICTION_SPEED: f64 = 0.03;
/// Offsets are those of stops from this speed (m/s), a middle one.
const REFERENCE_SPEED: f64 = 0.3;
/// Least prior standard deviation of an offset (m), so that offsets can still grow on a layout that seemed level.
const LEAST_DEVIATION: f64 = 0.0005;
/// A priori, half of the unexplained variance of stops (m²) comes from where they end; ...
const BY_PLACE: f64 = 0.5;
/// ... this prior weighs as much as four hops.
const WORTH: f64 = 4.0;

/// The share of its hop's offset that applies to a stop from a speed (m/s).
///
/// Friction `f` shortens a lagging stop by `f θ² ln(1 + v/(f θ))`; a gradient adds to `f`, so its effect grows with the logarithm
/// of the speed. The same shape serves for other laws, on which gradients have less effect.
pub(super) fn stop_offset_share(speed: f64) -> f64 {
    libm::log1p(speed.max(0.0) / FRICTION_SPEED) / libm::log1p(REFERENCE_SPEED / FRICTION_SPEED)
}

/// Stop offsets of all hops.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct StopOffsets {
    /// By hop: the offset of a stop from the reference speed (m), and its variance.
    pub(super) of_hop: BTreeMap<usize, (f64, f64)>,
    /// The prior standard deviation of offsets (m).
    pub(super) deviation: f64,
}

impl StopOffsets {
    /// The offset of a stop that ends on a hop, at the reference speed; the prior for an unknown hop.
    pub(super) fn of(&self, hop: Option<usize>) -> Gaussian {
        let known = hop.and_then(|hop| self.of_hop.get(&hop).copied());
        let (mean, variance) = known.unwrap_or((0.0, self.variance()));
        Gaussian { mean, variance }
    }

    /// The prior variance of offsets (m²).
    pub(super) fn variance(&self) -> f64 {
        self.deviation.max(LEAST_DEVIATION) * self.deviation.max(LEAST_DEVIATION)
    }

    /// Takes the offsets of a fit and updates their prior deviation by expectation and maximisation (Dempster, Laird and Rubin,
    /// 1977). `floor` is the unexplained scatter of stops (m), which the prior starts from.
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
