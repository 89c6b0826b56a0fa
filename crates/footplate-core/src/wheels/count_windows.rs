//! Between which speeds a wheel must have turned, from its counts alone.
//!
//! Over a window of τ seconds in which N pulses came, a wheel of pitch `p` turned by more than `(N - 1) p` and less
//! than `(N + 1) p`: sharp statements, whatever the noise. If its acceleration lay between `a` and `b`, its speed
//! at the end differs from the mean by `a τ/2` to `b τ/2`. Long windows divide the pulse by more time, short ones know
//! the acceleration better; each window is asked, and the narrowest answers are taken.

#![expect(clippy::indexing_slicing, reason = "a ring indexed modulo its length")]

use super::range::Range;

/// Readings remembered: the longest window at the shortest period in use.
const RING: usize = 64;
const WINDOWS: usize = 6;
/// Lengths of the windows (s): around `2 √(p / (b - a))`, where pulse and acceleration cost the same, for pitches of 10
/// to 40 mm and accelerations known to 0.3 to 3 m/s².
const LENGTHS_S: [f64; WINDOWS] = [0.1, 0.16, 0.25, 0.4, 0.6, 0.9];
/// The window for a mean speed: long enough for a pulse to be 0.1 m/s, short enough for a wheel that touches the speed of
/// the train for a moment.
const MEAN_WINDOW: usize = 2;
/// What jitter and pitch errors of a tooth can add to the one pulse of a count, in pulses (2 % of a pitch once per
/// revolution, 0.5 % a tooth, each at both ends).
const PITCH_ERROR: f64 = 0.1;

/// Fewer pulses do not prove that a wheel turns.
const SHAKEN: f64 = 3.0;

/// The last counts of one wheel.
#[derive(Debug, Clone)]
pub struct CountWindows {
    times: [f64; RING],
    totals: [f64; RING],
    doubts: [f64; RING],
    newest: usize,
    /// Readings in a row that are good, the newest included.
    good: usize,
    lags: [usize; WINDOWS],
}

impl CountWindows {
    /// Windows of a wheel that is read every `period` seconds.
    #[must_use]
    pub fn new(period: f64) -> Self {
        let lags = LENGTHS_S.map(|length| (libm::round(length / period) as usize).clamp(1, RING - 1));
        Self { times: [0.0; RING], totals: [0.0; RING], doubts: [0.0; RING], newest: 0, good: 0, lags }
    }

    /// So many pulses more by the time `now` (s), of which so many may be wrong.
    pub fn counted(&mut self, now: f64, pulses: f64, doubt: f64) {
        let total = self.totals[self.newest] + pulses;
        let doubts = self.doubts[self.newest] + doubt;
        self.newest = (self.newest + 1) % RING;
        self.times[self.newest] = now;
        self.totals[self.newest] = total;
        self.doubts[self.newest] = doubts;
        self.good = (self.good + 1).min(RING);
    }

    /// The last reading was not good: no window may reach over it.
    pub fn interrupt(&mut self) {
        self.good = 1;
    }

    /// Counts the other way from now on.
    pub fn reverse(&mut self) {
        for total in &mut self.totals {
            *total = -*total;
        }
    }

    /// The mean speed (m/s) with this pitch (m) over the shortest window of at least a fifth of a second, and how long
    /// ago its middle was (s); nothing before there is one.
    #[must_use]
    pub fn mean_speed(&self, pitch: f64) -> Option<(f64, f64)> {
        let lag = self.lags[MEAN_WINDOW];
        if lag >= self.good {
            return None;
        }
        let then = (self.newest + RING - lag) % RING;
        let span = self.times[self.newest] - self.times[then];
        Some(((self.totals[self.newest] - self.totals[then]) * pitch / span, 0.5 * span))
    }

    /// Between which speeds (m/s) the wheel must turn now, with a pitch (m) within `pitch` and accelerations (m/s²)
    /// within `acceleration`.
    #[must_use]
    pub fn speed(&self, pitch: Range, acceleration: Range) -> Range {
        let mut speed = Range::ANY;
        let now = self.times[self.newest];
        let total = self.totals[self.newest];
        let doubts = self.doubts[self.newest];
        for lag in self.lags {
            if lag >= self.good {
                break;
            }
            let then = (self.newest + RING - lag) % RING;
            let span = now - self.times[then];
            let pulses = total - self.totals[then];
            let per_second = 1.0 / span;
            let off = 1.0 + PITCH_ERROR + doubts - self.doubts[then];
            // A tooth that stands at the edge and is shaken over it to and fro is no motion.
            let fewest = if pulses.abs() < SHAKEN { (pulses - off).min(0.0) } else { pulses - off };
            let most = if pulses.abs() < SHAKEN { (pulses + off).max(0.0) } else { pulses + off };
            // A negative count is longest with the longest pitch.
            let slowest = fewest * if fewest < 0.0 { pitch.high } else { pitch.low };
            let fastest = most * if most < 0.0 { pitch.low } else { pitch.high };
            speed.low = speed.low.max(slowest * per_second + 0.5 * span * acceleration.low);
            speed.high = speed.high.min(fastest * per_second + 0.5 * span * acceleration.high);
        }
        speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts of a wheel that starts with speed `v` and acceleration `a`.
    fn windows(v: f64, a: f64, pitch: f64, period: f64, until: f64) -> (CountWindows, f64) {
        let mut windows = CountWindows::new(period);
        let mut before = 0.0;
        let mut k = 0;
        loop {
            let t = f64::from(k) * period;
            let pulses = libm::floor((v * t + 0.5 * a * t * t) / pitch + 0.37);
            windows.counted(t, pulses - before, 0.0);
            before = pulses;
            if t >= until {
                return (windows, v + a * t);
            }
            k += 1;
        }
    }

    #[test]
    fn the_true_speed_is_always_within() {
        for period in [0.02, 0.05, 0.1] {
            for v in [0.3, 5.0, 20.0, 83.0] {
                for a in [-1.4, -0.2, 0.0, 1.2] {
                    if v + 2.0 * a < 0.0 {
                        continue;
                    }
                    let (windows, truth) = windows(v, a, 0.0338, period, 2.0);
                    let speed = windows.speed(Range::exactly(0.0338), Range { low: -1.4, high: 1.2 });
                    assert!(speed.low <= truth && truth <= speed.high, "{v} {a} {period}: {speed:?} {truth}");
                    assert!(speed.high - speed.low < 1.6, "and not much more: {speed:?}");
                }
            }
        }
    }

    #[test]
    fn knowing_the_acceleration_better_narrows_the_speed() {
        let (windows, _) = windows(20.0, 0.0, 0.0338, 0.05, 3.0);
        let width = |range: Range| {
            let speed = windows.speed(Range::exactly(0.0338), range);
            speed.high - speed.low
        };
        assert!(width(Range { low: -0.1, high: 0.1 }) < 0.5 * width(Range { low: -1.4, high: 1.2 }));
    }

    #[test]
    fn no_window_reaches_over_an_interruption() {
        let (mut windows, _) = windows(20.0, 0.0, 0.0338, 0.05, 3.0);
        windows.interrupt();
        assert_eq!(windows.speed(Range::exactly(0.0338), Range { low: -1.0, high: 1.0 }), Range::ANY);
    }
}
