//! How far single stops from one speed scatter, as far as model trains usually do.

use super::priors::LATE_START;

/// Repeated stops of train 2 at step 8, 0.39 m/s, scatter by 4 mm; below that in proportion to the speed, as their ways
/// do. Of train 77 at step 14, 0.61 m/s, by 21 mm (both measured, 2020).
const MID: (f64, f64) = (0.39, 0.004);
const TOP: (f64, f64) = (0.61, 0.021);
/// What is left at a crawl (m): the play of couplings and gears.
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

/// How far stops and starts of a train scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Scatter {
    /// Of stops, against what is usual at their speed, ...
    pub(super) stops: f64,
    /// ... and what they scatter by besides (m), whatever their speed: slopes, loads, shapes of laws that are none of ours.
    pub(super) floor: f64,
    /// Of starts, against what is usual.
    pub(super) starts: f64,
}

impl Scatter {
    /// As model trains usually do.
    pub(super) const USUAL: Self = Self { stops: 1.0, floor: 0.0, starts: 1.0 };

    /// One standard deviation (m) of stops from a speed (m/s).
    pub(super) fn of_stop(self, speed: f64) -> f64 {
        libm::hypot(self.stops * usual_scatter(speed), self.floor)
    }

    /// One standard deviation (s) of how late or early starts are.
    pub(super) fn of_start(self) -> f64 {
        self.starts * LATE_START
    }
}

/// How much the scatter that a train has shown is worth against what is usual, in stops or starts.
const USUAL: f64 = 10.0;
/// Measurements after which the past fades: of residuals, and of promises, which have to be noticed soon when they are broken.
const MEMORY: f64 = 60.0;
const PROMISES_KEPT: f64 = 25.0;
/// What is further off than this (squared standard deviations) was not by the train's own law; it counts as this far.
const WILD: f64 = 9.0;
const WILD_PROMISE: f64 = 16.0;
/// Bounds of what is believed at all.
const SCALES: (f64, f64) = (0.4, 6.0);
/// How many promises that were kept it is worth, beforehand, that stops have no floor.
const NO_FLOOR: f64 = 3.0;
/// Promises are weighted as if the floor were at least this (m), about what is not known of the next sensor anyway: by the
/// weights of none at all, no promise would ever count against those that are worth beforehand.
const LEAST_FLOOR: f64 = 0.015;

/// Squares of what stops or starts of a train were off by, over what is usual of model trains.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ScatterSum {
    sum: f64,
    count: f64,
}

impl ScatterSum {
    /// One more, whose mean square over the usual is this.
    pub(super) fn take(&mut self, square: f64) {
        self.add(square.min(WILD), 1.0, MEMORY);
    }

    fn add(&mut self, square: f64, weight: f64, memory: f64) {
        let kept = if self.count >= memory { 1.0 - weight / memory } else { 1.0 };
        self.sum = kept * self.sum + weight * square;
        self.count = kept * self.count + weight;
    }

    /// Standard deviation over the usual.
    pub(super) fn scale(&self) -> f64 {
        libm::sqrt((self.sum + USUAL) / (self.count + USUAL)).clamp(SCALES.0, SCALES.1)
    }
}

/// Of stops and of starts; and of both together, by how much more than it should the first sensor after a stop was missed
/// that had been promised (m²).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ScatterSums {
    pub(super) stops: ScatterSum,
    pub(super) starts: ScatterSum,
    promises: ScatterSum,
}

impl ScatterSums {
    /// A promise was off by so much (squared, m²), of which scatter at its speed and what was not known yet explain
    /// `explained` (m²), the floor left out.
    ///
    /// The mean of what they leave over, each weighted by how sharply it tells a floor, is the square of the floor: the
    /// maximum of the likelihood, approached one promise at a time.
    pub(super) fn take_promise(&mut self, square: f64, explained: f64) {
        let floor = self.floor() * self.floor();
        let left = square.min(WILD_PROMISE * (explained + floor)) - explained;
        let floor = floor.max(LEAST_FLOOR * LEAST_FLOOR);
        let weight = floor / (explained + floor);
        self.promises.add(left, weight * weight, PROMISES_KEPT);
    }

    /// Promises of other sums.
    pub(super) const fn with_promises_of(self, other: &Self) -> Self {
        Self { promises: other.promises, ..self }
    }

    /// What promises that were broken say stops scatter by, whatever their speed (m).
    fn floor(&self) -> f64 {
        libm::sqrt((self.promises.sum / (self.promises.count + NO_FLOOR)).max(0.0))
    }

    /// How far stops and starts scatter. What residuals show is too little where a fit has much to explain them by;
    /// promises that are broken say so.
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
