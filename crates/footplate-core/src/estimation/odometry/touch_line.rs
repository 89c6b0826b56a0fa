//! The line through the moments at which a sliding wheel touched the speed of the train.
//!
//! Letters: `t` time, `v` speed, `w` weight of a touch, `m` slope of the line. Weighted least squares with a prior for
//! the slope; old touches fade, because adhesion changes along the line.

/// Standard deviation of a touch (m/s): a wheel that is let go turns a little slower than the train, by as much as its
/// speed is uncertain.
const TOUCH_DEVIATION: f64 = 0.2;
/// Standard deviation of the slope before any touch (m/s²): low adhesion gives 0.3 to 1.
const SLOPE_DEVIATION: f64 = 0.2;
/// Time in which a touch fades (s).
const FADES_S: f64 = 15.0;
/// Weight of the beginning: the speed before a slide is pulled along by it.
const BEGINNING: f64 = 0.3;

/// Slope of the speed by its touches.
#[derive(Debug, Clone)]
pub(super) struct TouchLine {
    prior: f64,
    at: f64,
    w: f64,
    wt: f64,
    wv: f64,
    wtt: f64,
    wtv: f64,
    slope: f64,
}

impl TouchLine {
    /// A line that begins at time 0 with this speed (m/s) and probably falls like this (m/s²).
    pub(super) fn from(speed: f64, prior: f64) -> Self {
        Self {
            prior,
            at: 0.0,
            w: BEGINNING,
            wt: 0.0,
            wv: BEGINNING * speed,
            wtt: 0.0,
            wtv: 0.0,
            slope: prior,
        }
    }

    /// How fast the speed changes (m/s²).
    pub(super) fn slope(&self) -> f64 {
        self.slope
    }

    /// A touch at time `t` (s).
    pub(super) fn touched(&mut self, t: f64, v: f64) {
        let kept = 1.0 / (1.0 + (t - self.at) / FADES_S);
        self.at = t;
        self.w = self.w * kept + 1.0;
        self.wt = self.wt * kept + t;
        self.wv = self.wv * kept + v;
        self.wtt = self.wtt * kept + t * t;
        self.wtv = self.wtv * kept + t * v;
        let spread = self.wtt - self.wt * self.wt / self.w;
        let covered = self.wtv - self.wt * self.wv / self.w;
        let of_touch = 1.0 / (TOUCH_DEVIATION * TOUCH_DEVIATION);
        let of_prior = 1.0 / (SLOPE_DEVIATION * SLOPE_DEVIATION);
        self.slope = (self.prior * of_prior + covered * of_touch) / (of_prior + spread * of_touch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touches_tell_the_slope_and_a_lone_one_hardly_does() {
        let mut line = TouchLine::from(50.0, -0.6);
        assert_eq!(line.slope(), -0.6);
        line.touched(1.0, 49.7);
        assert!((-0.6..-0.5).contains(&line.slope()), "a second after the beginning: {}", line.slope());
        for k in 1..8 {
            let t = f64::from(k) * 4.0;
            line.touched(t, 50.0 - 0.4 * t);
        }
        assert!((line.slope() + 0.4).abs() < 0.01, "{}", line.slope());
    }
}
