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
        let Self { times, totals, doubts, newest, .. } = self;
        let (now, total, doubt) = (times[*newest], totals[*newest], 1.0 + PITCH_ERROR + doubts[*newest]);
        for window in 0..WINDOWS {
            let lag = self.lags[window];
            if lag >= self.good {
                break;
            }
            let then = (newest + RING - lag) % RING;
            let span = now - times[then];
            let pulses = total - totals[then];
            let per_second = 1.0 / span;
            let off = doubt - doubts[then];
            let (mut fewest, mut most) = (pulses - off, pulses + off);
            let (mut shortest, mut longest) = (pitch.low, pitch.high);
            // A wheel that runs, forward and beyond doubt, passes this by.
            if pulses < SHAKEN || fewest < 0.0 {
                // A tooth that stands at the edge and is shaken over it to and fro is no motion.
                if pulses.abs() < SHAKEN {
                    (fewest, most) = (fewest.min(0.0), most.max(0.0));
                }
                // A negative count is longest with the longest pitch.
                shortest = if fewest < 0.0 { pitch.high } else { pitch.low };
                longest = if most < 0.0 { pitch.low } else { pitch.high };
            }
            let slowest = fewest * shortest * per_second + 0.5 * span * acceleration.low;
            let fastest = most * longest * per_second + 0.5 * span * acceleration.high;
            // One instruction each, where `f64::max` and `f64::min` take six to mind what is no number.
            speed.low = if slowest > speed.low { slowest } else { speed.low };
            speed.high = if fastest < speed.high { fastest } else { speed.high };
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

    /// Every window by itself, each with all cases minded.
    fn asked_one_by_one(windows: &CountWindows, pitch: Range, acceleration: Range) -> Range {
        let mut speed = Range::ANY;
        for lag in windows.lags.into_iter().filter(|lag| *lag < windows.good) {
            let then = (windows.newest + RING - lag) % RING;
            let span = windows.times[windows.newest] - windows.times[then];
            let pulses = windows.totals[windows.newest] - windows.totals[then];
            let off = 1.0 + PITCH_ERROR + windows.doubts[windows.newest] - windows.doubts[then];
            let shaken = pulses.abs() < SHAKEN;
            let fewest = if shaken { (pulses - off).min(0.0) } else { pulses - off };
            let most = if shaken { (pulses + off).max(0.0) } else { pulses + off };
            let slowest = fewest * if fewest < 0.0 { pitch.high } else { pitch.low } * (1.0 / span);
            let fastest = most * if most < 0.0 { pitch.low } else { pitch.high } * (1.0 / span);
            speed.low = speed.low.max(slowest + 0.5 * span * acceleration.low);
            speed.high = speed.high.min(fastest + 0.5 * span * acceleration.high);
        }
        speed
    }

    #[test]
    fn a_wheel_that_runs_is_asked_no_less() {
        let (pitch, acceleration) = (Range::around(0.0338, 0.012), Range { low: -1.4, high: 1.2 });
        let mut windows = CountWindows::new(0.05);
        let mut seed = 11_u64;
        for reading in 0..4000 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // From full speed over standstill, trembling, to a run backwards; now and then in doubt.
            let tremor = (seed >> 60) as f64 - 7.5;
            let pulses = libm::round(40.0 - f64::from(reading) / 60.0 + 0.2 * tremor);
            let doubt = if seed >> 58 == 0 { 3.0 } else { 0.0 };
            windows.counted(f64::from(reading) * 0.05, pulses, doubt);
            if reading % 500 == 499 {
                windows.interrupt();
            }
            assert_eq!(windows.speed(pitch, acceleration), asked_one_by_one(&windows, pitch, acceleration));
        }
    }
}
