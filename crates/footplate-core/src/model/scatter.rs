//! The scatter of single stops and starts: what is usual for model trains, and what this train shows.

use super::priors::LATE_START;

/// Standard deviation of repeated stops: train 2 at step 8, 0.39 m/s, 4 mm; slower stops in proportion to the speed, as their
/// distances. Train 77 at step 14, 0.61 m/s: 21 mm (both measured, 2020).
const MID: (f64, f64) = (0.39, 0.004);
const TOP: (f64, f64) = (0.61, 0.021);
/// The rest at creep speed (m): play of couplings and gears.
const LEAST: f64 = 0.0005;

/// One standard deviation (m) of stops from a speed (m/s).
pub(super) fn usual_scatter(speed: f64) -> f64 {
    let (mid_speed, mid) = MID;
    let (top_speed, top) = TOP;
    if speed <= mid_speed {
        return LEAST.max(mid * speed / mid_speed);
    }
    mid + (top - mid) * (speed - mid_speed) / (top_speed - mid_speed)
}

/// Scatter of the stops and starts of one train.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Scatter {
    /// Of stops: factor on the usual scatter at their speed, ...
    pub(super) stops: f64,
    /// ... and a standard deviation (m) that does not depend on the speed: slopes, loads, and shapes of laws that the model
    /// lacks.
    pub(super) floor: f64,
    /// Of starts: factor on the usual scatter.
    pub(super) starts: f64,
}

impl Scatter {
    /// Usual for model trains.
    pub(super) const USUAL: Self = Self { stops: 1.0, floor: 0.0, starts: 1.0 };

    /// One standard deviation (m) of stops from a speed (m/s).
    pub(super) fn of_stop(self, speed: f64) -> f64 {
        libm::hypot(self.of_stop_alone(speed), self.floor)
    }

    /// The same without the floor.
    pub(super) fn of_stop_alone(self, speed: f64) -> f64 {
        self.stops * usual_scatter(speed)
    }

    /// Standard deviation (s) of how late or early starts are.
    pub(super) fn of_start(self) -> f64 {
        self.starts * LATE_START
    }
}

/// The usual scatter weighs as much as this many stops or starts of the train.
const USUAL: f64 = 10.0;
/// Measurements after which older ones fade: of residuals, and of promises, where a change has to show soon.
const MEMORY: f64 = 60.0;
const PROMISES_KEPT: f64 = 25.0;
/// Larger squared residuals (in variances) have another cause than the train's own scatter; they count as this large.
const WILD: f64 = 9.0;
const WILD_PROMISE: f64 = 16.0;
/// Bounds of the factors.
const SCALES: (f64, f64) = (0.4, 6.0);
/// A priori stops have no floor; that weighs as much as this many promises that were kept.
const NO_FLOOR: f64 = 3.0;
/// Promises are weighted as if the floor were at least this (m), about the uncertainty of the next sensor. With the weights of a
/// zero floor, no promise would ever outweigh the prior.
const LEAST_FLOOR: f64 = 0.015;

/// Sum of squared residuals of stops or starts, each divided by the usual variance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ScatterSum {
    sum: f64,
    count: f64,
}

impl ScatterSum {
    /// Adds one: its square divided by the usual variance.
    pub(super) fn take(&mut self, square: f64) {
        self.add(square.min(WILD), 1.0, MEMORY);
    }

    fn add(&mut self, square: f64, weight: f64, memory: f64) {
        let kept = if self.count >= memory { 1.0 - weight / memory } else { 1.0 };
        self.sum = kept * self.sum + weight * square;
        self.count = kept * self.count + weight;
    }

    /// Standard deviation divided by the usual one.
    pub(super) fn scale(&self) -> f64 {
        libm::sqrt((self.sum + USUAL) / (self.count + USUAL)).clamp(SCALES.0, SCALES.1)
    }
}

/// Sums of stops, of starts, and of both together: by how much the squared error at the first sensor after a stop exceeds its
/// predicted variance (m²).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ScatterSums {
    pub(super) stops: ScatterSum,
    pub(super) starts: ScatterSum,
    promises: ScatterSum,
}

impl ScatterSums {
    /// Adds a promise with this squared error (m²). `explained` (m²) is its predicted variance without the floor.
    ///
    /// The mean of what they leave over, each weighted by how sharply it determines the floor, is the square of the floor:
    /// the maximum of the likelihood, approached one promise at a time.
    pub(super) fn take_promise(&mut self, square: f64, explained: f64) {
        let floor = self.floor() * self.floor();
        let left = square.min(WILD_PROMISE * (explained + floor)) - explained;
        let floor = floor.max(LEAST_FLOOR * LEAST_FLOOR);
        let weight = floor / (explained + floor);
        self.promises.add(left, weight * weight, PROMISES_KEPT);
    }

    /// With the promises of other sums.
    pub(super) const fn with_promises_of(self, other: &Self) -> Self {
        Self { promises: other.promises, ..self }
    }

    /// The floor by the promises so far (m).
    fn floor(&self) -> f64 {
        libm::sqrt((self.promises.sum / (self.promises.count + NO_FLOOR)).max(0.0))
    }

    /// The scatter by all sums. Residuals show too little where a fit has many parameters to explain them; broken promises
    /// show the rest.
    pub(super) fn scatter(&self) -> Scatter {
        Scatter { stops: self.stops.scale(), floor: self.floor(), starts: self.starts.scale() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn promises_that_are_kept_leave_no_floor_and_broken_ones_find_it() {
        // Turns of plus and minus one standard deviation.
        let shown = |scatter: f64| {
            let mut sums = ScatterSums::default();
            for nth in 0..60 {
                let explained = if nth % 2 == 0 { 0.005 } else { 0.02 };
                sums.take_promise(explained * explained + scatter * scatter, explained * explained);
            }
            sums.scatter().floor
        };
        assert_eq!(shown(0.0), 0.0);
        assert!((0.022..=0.03).contains(&shown(0.03)), "{}", shown(0.03));
    }

    #[test]
    fn one_stop_45_mm_off_is_no_floor_to_speak_of() {
        let mut sums = ScatterSums::default();
        for _ in 0..20 {
            sums.take_promise(0.005 * 0.005, 0.005 * 0.005);
        }
        sums.take_promise(0.045 * 0.045, 0.005 * 0.005);
        assert!(sums.scatter().floor < 0.006, "{}", sums.scatter().floor);
    }
}
