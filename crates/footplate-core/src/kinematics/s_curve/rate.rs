//! A limit of acceleration and the limit of jerk that leads up to it.

/// Both limits, and what every ramp asks of them; SI units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rate {
    pub(super) limit: f64,
    pub(super) jerk: f64,
    /// One over the jerk, and over the limit.
    pub(super) per_jerk: f64,
    per_limit: f64,
    /// Time to build the limit up.
    full_build_up: f64,
    /// Speed gained while acceleration builds up to the limit and fades again at once.
    least_gain: f64,
}

impl Rate {
    #[inline(always)]
    pub(super) fn new(limit: f64, jerk: f64, per_jerk: f64) -> Self {
        let full_build_up = limit * per_jerk;
        Self {
            limit,
            jerk,
            per_jerk,
            per_limit: 1.0 / limit,
            full_build_up,
            least_gain: limit * full_build_up,
        }
    }

    /// Whether a gain of speed is large enough for the limit to be reached.
    #[inline(always)]
    pub(super) fn is_reached_by(&self, gain: f64) -> bool {
        gain >= self.least_gain
    }

    /// Peak acceleration, how long it takes to build up, and how long it is held, for a gain of speed.
    #[inline(always)]
    pub(super) fn peak_for(&self, gain: f64) -> (f64, f64, f64) {
        if self.is_reached_by(gain) {
            (self.limit, self.full_build_up, (gain - self.least_gain) * self.per_limit)
        } else {
            let build_up = libm::sqrt(gain * self.per_jerk);
            (self.jerk * build_up, build_up, 0.0)
        }
    }

    /// The distance of a gain from a speed, and its derivative by the gain; a gain below zero is rounding.
    #[inline]
    pub(super) fn way_and_slope(&self, low: f64, gain: f64) -> (f64, f64) {
        let gain = gain.max(0.0);
        let (_, build_up, hold) = self.peak_for(gain);
        let (time, mean) = (2.0 * build_up + hold, low + 0.5 * gain);
        // The time grows by x/A while the limit is held, and otherwise as 2√(x/J).
        let slope = if self.is_reached_by(gain) { self.per_limit } else { self.per_jerk / build_up };
        (mean * time, 0.5 * time + mean * slope)
    }
}
