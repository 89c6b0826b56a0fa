//! How exactly a train's contacts close at their usual place: shoe, dirt, sway and what no state explains.

/// Before a train has shown its own (m): cleaned shoes on the published tracks.
const EXPECTED_M: f64 = 0.003;
/// How many hits that first figure is worth.
const EXPECTED_WEIGHT: f64 = 15.0;
/// Hits after which the past fades, so that a shoe that gets dirty is noticed.
const MEMORY: f64 = 120.0;
/// What is believed at all (m): below, the poll hides it; above, something else is wrong.
const SMALLEST_M: f64 = 0.001;
const LARGEST_M: f64 = 0.025;
/// One hit counts for at most this many times what was expected, so that an outlier is no scatter.
const HELD_AT: f64 = 4.0;

/// Scatter of a train's contacts about their usual place, learnt from how far forecasts miss beyond what
/// poll and motion explain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ContactScatter {
    /// m²
    variance: f64,
    weight: f64,
}

impl Default for ContactScatter {
    fn default() -> Self {
        Self { variance: EXPECTED_M * EXPECTED_M, weight: EXPECTED_WEIGHT }
    }
}

impl ContactScatter {
    /// A hit came `late` seconds late at `speed` m/s where `explained` (s²) was to be expected without scatter.
    pub(super) fn take(&mut self, late: f64, explained: f64, speed: f64) {
        let missed = (late * late).min(HELD_AT * (explained + self.variance_s2(speed)));
        let found = (missed - explained) * speed * speed;
        self.weight = (self.weight + 1.0).min(MEMORY);
        self.variance += (found - self.variance) / self.weight;
        self.variance = self.variance.clamp(SMALLEST_M * SMALLEST_M, LARGEST_M * LARGEST_M);
    }

    /// As variance of the time of a contact (s²) at `speed` m/s.
    pub(super) fn variance_s2(&self, speed: f64) -> f64 {
        // A train at a crawl is held to a walking snail's pace, so that standstill stays finite.
        let speed = speed.max(1e-3);
        self.variance / (speed * speed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_finds_the_scatter_behind_the_poll() {
        // Given errors of ±√(20² + 16²) mm at 0.4 m/s of which the poll explains 16 mm,
        let mut scatter = ContactScatter::default();
        let late = libm::hypot(0.020, 0.016) / 0.4;
        for _ in 0..500 {
            scatter.take(late, (0.016 / 0.4) * (0.016 / 0.4), 0.4);
        }
        // then 20 mm of scatter are left.
        assert!((libm::sqrt(scatter.variance) - 0.020).abs() < 1e-3);
    }
}
