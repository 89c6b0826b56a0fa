//! A limit of acceleration and the limit of jerk that leads up to it.

/// Both limits, and the values that every ramp derives from them; SI units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rate {
    pub(super) limit: f64,
    pub(super) jerk: f64,
    /// Reciprocals of jerk and limit.
    pub(super) per_jerk: f64,
    per_limit: f64,
    /// Time to build up to the limit.
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

    /// Whether a gain of speed is large enough to reach the limit.
    #[inline(always)]
    pub(super) fn is_reached_by(&self, gain: f64) -> bool {
        gain >= self.least_gain
    }

    /// Peak acceleration for a gain of speed, with the times to build it up and to hold it.
    #[inline(always)]
    pub(super) fn peak_for(&self, gain: f64) -> (f64, f64, f64) {
        if self.is_reached_by(gain) {
            (self.limit, self.full_build_up, (gain - self.least_gain) * self.per_limit)
        } else {
            let build_up = libm::sqrt(gain * self.per_jerk);
            (self.jerk * build_up, build_up, 0.0)
        }
    }

    /// Distance of a ramp from `low` by a gain of speed, and its derivative with respect to the gain; a gain below
    /// zero is rounding.
    #[inline]
    pub(super) fn distance_and_slope(&self, low: f64, gain: f64) -> (f64, f64) {
        let gain = gain.max(0.0);
        let (_, build_up, hold) = self.peak_for(gain);
        let (time, mean) = (2.0 * build_up + hold, low + 0.5 * gain);
        // The time grows by x/A while the limit is held, and otherwise as 2√(x/J).
        let slope = if self.is_reached_by(gain) { self.per_limit } else { self.per_jerk / build_up };
        (mean * time, 0.5 * time + mean * slope)
    }
}
