//! How far single stops from one speed scatter, as far as model trains usually do.

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

/// How much the scatter that a train has shown is worth against what is usual, in stops or starts.
const USUAL: f64 = 10.0;
/// Measurements after which the past fades: of residuals, and of promises, which have to be noticed soon when they are broken.
const MEMORY: f64 = 60.0;
const PROMISES_KEPT: f64 = 25.0;
/// What is further off than this (squared standard deviations) was not by the train's own law; it counts as this far.
const WILD: f64 = 9.0;
const WILD_PROMISE: f64 = 25.0;
/// Bounds of what is believed at all.
const SCALES: (f64, f64) = (0.4, 6.0);
/// Promises that are broken no more often than this scale says are kept as they should be.
const KEPT: f64 = 1.2;

/// Squares of what stops and starts of a train were off by, over what is usual of model trains.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ScatterSum {
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

/// Of stops and of starts; and of both together, by how much the first sensor after a stop was missed that had been promised.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ScatterSums {
    pub(super) stops: ScatterSum,
    pub(super) starts: ScatterSum,
    promises: ScatterSum,
}

impl ScatterSums {
    /// A promise was off by so much (squared, m²), where scatter as usual explains `usual` of it and what was not known yet
    /// the rest (m²).
    pub(super) fn take_promise(&mut self, square: f64, usual: f64, unknown: f64) {
        let scattered = ((square - unknown).max(0.0) / usual).min(WILD_PROMISE);
        self.promises.add(scattered, usual / (usual + unknown), PROMISES_KEPT);
    }

    /// Promises of other sums.
    pub(super) const fn with_promises_of(self, other: &Self) -> Self {
        Self { promises: other.promises, ..self }
    }

    /// How far stops and starts scatter, over the usual. What residuals show is too little where a fit has much to explain
    /// them by; promises that are broken say so.
    pub(super) fn scales(&self) -> (f64, f64) {
        let promised = Some(self.promises.scale()).filter(|scale| *scale > KEPT).unwrap_or(0.0);
        (self.stops.scale().max(promised), self.starts.scale().max(promised))
    }
}
