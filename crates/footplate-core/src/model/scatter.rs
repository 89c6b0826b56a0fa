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
    /// ... and one of the time until they begin (s): decoders that change their speed by a clock of their own, stations that
    /// repeat commands in turn.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) delay: f64,
    /// Of starts: factor on the usual scatter.
    pub(super) starts: f64,
}

impl Scatter {
    /// Usual for model trains.
    pub(super) const USUAL: Self = Self { stops: 1.0, floor: 0.0, delay: 0.0, starts: 1.0 };

    /// One standard deviation (m) of stops from a speed (m/s).
    pub(super) fn of_stop(self, speed: f64) -> f64 {
        libm::hypot(self.of_stop_alone(speed), self.unexplained(speed))
    }

    /// The same for a forecast of where a stop ends. What laws lack shows in the sum of a stop and the next start; their
    /// difference, which no sensor shows, is assumed to be as far off, as far as this part of all stops was compared with promises.
    pub(super) fn of_forecast(self, speed: f64, compared: f64) -> f64 {
        libm::hypot(self.of_stop_alone(speed), libm::sqrt(1.0 + compared) * self.unexplained(speed))
    }

    /// What only broken promises show.
    pub(super) fn unexplained(self, speed: f64) -> f64 {
        libm::hypot(self.floor, self.delay * speed)
    }

    /// What the residuals of the fit show.
    pub(super) fn of_stop_alone(self, speed: f64) -> f64 {
        self.stops * usual_scatter(speed)
    }

    /// Standard deviation (s) of how late or early starts are.
    pub(super) fn of_start(self) -> f64 {
        self.starts * LATE_START
    }
}

/// Promises are checked once this many stops are known. Before that they are broken because the fit is far from linear, which
/// shows nothing about the scatter of stops.
pub(super) const WATCHED_FROM: u32 = 20;
/// The usual scatter weighs as much as this many stops or starts of the train.
const USUAL: f64 = 10.0;
/// Measurements after which older ones fade: of residuals, and of promises, where a change has to show soon.
const MEMORY: f64 = 60.0;
const PROMISES_KEPT: f64 = 25.0;
/// Larger squared residuals (in variances of the train, at least the usual one) have another cause than the train's own scatter; they
/// count as this large.
const WILD: f64 = 9.0;
const WILD_PROMISE: f64 = 16.0;
/// Bounds of the factors.
const SCALES: (f64, f64) = (0.4, 6.0);
/// A priori stops have no unexplained scatter; that weighs as much as this many promises that were kept, ...
const NOTHING_UNEXPLAINED: f64 = 3.0;
/// ... for the scatter of their delay from this speed (m/s), the middle of those that trains are driven at.
pub(super) const MEDIUM_SPEED: f64 = 0.3;
/// Promises are weighted as if the unexplained scatter were at least this (m), about the uncertainty of the next sensor. With the
/// weights of none, no promise would ever outweigh the prior.
const LEAST_UNEXPLAINED: f64 = 0.015;

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
        let scale = self.scale().max(1.0);
        self.add(square.min(WILD * scale * scale), 1.0, MEMORY);
    }

    /// Returns the share of all before that is kept.
    fn add(&mut self, square: f64, weight: f64, memory: f64) -> f64 {
        let kept = if self.count >= memory { 1.0 - weight / memory } else { 1.0 };
        self.sum = kept * self.sum + weight * square;
        self.count = kept * self.count + weight;
        kept
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
    /// The same weights times the square and the fourth power of the speed, and what is left over times its square.
    #[cfg_attr(feature = "serde", serde(default))]
    promises_by_speed: [f64; 3],
}

impl ScatterSums {
    /// Adds a promise of a stop from a speed (m/s) with this squared error (m²). `explained` (m²) is its predicted variance without
    /// what is unexplained.
    ///
    /// What they leave over is a straight line over the square of the speed, whose numbers are the squares of the floor and of the
    /// scatter of the delay: weighted by how sharply each determines them, the maximum of the likelihood, approached one promise at
    /// a time.
    pub(super) fn take_promise(&mut self, speed: f64, square: f64, explained: f64) {
        let unexplained = self.scatter().unexplained(speed);
        let unexplained = unexplained * unexplained;
        let left = square.min(WILD_PROMISE * (explained + unexplained)) - explained;
        let unexplained = unexplained.max(LEAST_UNEXPLAINED * LEAST_UNEXPLAINED);
        let weight = unexplained / (explained + unexplained);
        let weight = weight * weight;
        let kept = self.promises.add(left, weight, PROMISES_KEPT);
        let squared = speed * speed;
        let new = [squared, squared * squared, squared * left];
        for (sum, new) in self.promises_by_speed.iter_mut().zip(new) {
            *sum = kept * *sum + weight * new;
        }
    }

    /// With the promises of other sums.
    pub(super) const fn with_promises_of(self, other: &Self) -> Self {
        Self { promises: other.promises, promises_by_speed: other.promises_by_speed, ..self }
    }

    /// The floor (m) and the scatter of the delay (s) by the promises so far: both, or the one that explains them without a negative
    /// other.
    fn unexplained(&self) -> (f64, f64) {
        let [squares, fourths, left_by_square] = self.promises_by_speed;
        let medium = MEDIUM_SPEED * MEDIUM_SPEED;
        let (count, left) = (self.promises.count + NOTHING_UNEXPLAINED, self.promises.sum);
        let fourths = fourths + NOTHING_UNEXPLAINED * medium * medium;
        let determinant = count * fourths - squares * squares;
        let floor = (left * fourths - left_by_square * squares) / determinant;
        let delay = (left_by_square * count - left * squares) / determinant;
        let (floor, delay) = match (floor > 0.0, delay > 0.0) {
            (true, true) => (floor, delay),
            (true, false) => (left / count, 0.0),
            _ => (0.0, left_by_square / fourths),
        };
        (libm::sqrt(floor.max(0.0)), libm::sqrt(delay.max(0.0)))
    }

    /// The scatter by all sums. Residuals show too little where a fit has many parameters to explain them; broken promises
    /// show the rest.
    pub(super) fn scatter(&self) -> Scatter {
        let (floor, delay) = self.unexplained();
        Scatter { stops: self.stops.scale(), floor, delay, starts: self.starts.scale() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is found of promises whose errors turn between plus and minus one standard deviation, from slow and fast stops.
    fn shown(scatter: impl Fn(f64) -> f64) -> Scatter {
        let mut sums = ScatterSums::default();
        for nth in 0..60 {
            let explained = if nth % 2 == 0 { 0.005 } else { 0.02 };
            let speed = if nth % 4 < 2 { 0.1 } else { 0.5 };
            sums.take_promise(
                speed,
                explained * explained + scatter(speed) * scatter(speed),
                explained * explained,
            );
        }
        sums.scatter()
    }

    #[test]
    fn promises_that_are_kept_leave_nothing_and_broken_ones_find_the_floor_or_the_delay() {
        let kept = shown(|_| 0.0);
        assert_eq!((kept.floor, kept.delay), (0.0, 0.0));
        let even = shown(|_| 0.03);
        assert!((0.024..=0.032).contains(&even.unexplained(0.1)), "{even:?}");
        assert!((0.024..=0.032).contains(&even.unexplained(0.5)), "{even:?}");
        let late = shown(|speed| 0.09 * speed);
        assert!(late.unexplained(0.1) < 0.012, "{late:?}");
        assert!((0.038..=0.047).contains(&late.unexplained(0.5)), "{late:?}");
    }

    #[test]
    fn slow_stops_that_scatter_more_are_a_floor_and_no_negative_delay() {
        let slow = shown(|speed| if speed < 0.2 { 0.04 } else { 0.01 });
        assert_eq!(slow.delay, 0.0, "{slow:?}");
        // Both together: the root of (0.04² + 0.01²) / 2 is 29 mm, and sharp promises count for more.
        assert!((0.01..0.035).contains(&slow.floor), "{slow:?}");
    }

    #[test]
    fn sums_with_the_promises_of_others_keep_their_own_stops_and_starts() {
        let (mut own, mut other) = (ScatterSums::default(), ScatterSums::default());
        (0..8).for_each(|_| own.stops.take(4.0));
        for _ in 0..40 {
            other.take_promise(0.5, 0.05 * 0.05, 0.005 * 0.005);
        }
        let both = own.with_promises_of(&other).scatter();
        assert_eq!((both.stops, both.starts), (own.scatter().stops, own.scatter().starts));
        assert_eq!((both.floor, both.delay), (other.scatter().floor, other.scatter().delay));
        assert!(both.unexplained(0.5) > 0.02 && own.scatter().unexplained(0.5) < 0.01, "{both:?}");
    }

    #[test]
    fn one_stop_45_mm_off_is_nothing_to_speak_of() {
        let mut sums = ScatterSums::default();
        for _ in 0..20 {
            sums.take_promise(0.2, 0.005 * 0.005, 0.005 * 0.005);
        }
        sums.take_promise(0.2, 0.045 * 0.045, 0.005 * 0.005);
        assert!(sums.scatter().unexplained(0.2) < 0.006, "{:?}", sums.scatter());
    }
}
