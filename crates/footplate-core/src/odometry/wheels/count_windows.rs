//! Between which speeds a wheel must have turned, from its counts alone.
//!
//! Over a window of τ seconds in which N pulses came, a wheel of pitch `p` turned by more than `(N - 1) p` and less
//! than `(N + 1) p`: sharp statements, whatever the noise. If its acceleration lay between `a` and `b`, its speed
//! at the end differs from the mean by `a τ/2` to `b τ/2`. Long windows divide the pulse by more time, short ones know
//! the acceleration better; each window is asked, and the narrowest answers are taken.

#![expect(clippy::indexing_slicing, reason = "a ring indexed modulo its length")]

use super::range::{Range, larger, smaller};

/// Readings remembered: the longest window at the shortest period in use.
const RING: usize = 64;
const WINDOWS: usize = 6;
/// Lengths of the windows (s): around `2 √(p / (b - a))`, where pulse and acceleration cost the same, for pitches of 10
/// to 40 mm and accelerations known to 0.3 to 3 m/s².
const LENGTHS_S: [f64; WINDOWS] = [0.1, 0.16, 0.25, 0.4, 0.6, 0.9];
/// What jitter and pitch errors of a tooth can add to the one pulse of a count, in pulses (2 % of a pitch once per
/// revolution, 0.5 % a tooth, each at both ends).
const PITCH_ERROR: f64 = 0.05;

/// A window turned by less than this more or less than it counted (pulses).
const ONE_PULSE: f64 = 1.0 + PITCH_ERROR;
/// Fewer pulses do not prove that a wheel turns.
const SHAKEN: f64 = 3.0;

/// What was known at the end of one reading.
#[derive(Debug, Clone, Copy)]
struct Reading {
    /// When it was (s).
    time: f64,
    /// How many pulses it can be away from the beginning at most, backwards and forwards. Kept like this because both
    /// bounds of a window are then the same operations, two at a time.
    back: f64,
    forth: f64,
}

/// One window of those that end now.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// How many readings it reaches back.
    lag: usize,
    /// How long it is: half of it (s), and its inverse (1/s).
    half: f64,
    per_second: f64,
}

/// The last counts of one wheel.
#[derive(Debug, Clone)]
pub struct CountWindows {
    readings: [Reading; RING],
    newest: usize,
    /// Readings in a row that are good, the newest included.
    good: usize,
    windows: [Window; WINDOWS],
    /// The time between the last two readings (s), and how many readings came that regularly.
    period: f64,
    regular: usize,
}

impl CountWindows {
    /// Windows of a wheel that is read every `period` seconds.
    #[must_use]
    pub fn new(period: f64) -> Self {
        let windows = LENGTHS_S.map(|length| {
            let lag = (libm::round(length / period) as usize).clamp(1, RING - 1);
            Window { lag, half: 0.5 * length, per_second: 1.0 / length }
        });
        let nothing = Reading { time: 0.0, back: 0.0, forth: 0.0 };
        Self { readings: [nothing; RING], newest: 0, good: 0, windows, period: 0.0, regular: 0 }
    }

    /// So many pulses in the last `period` seconds, of which so many may be wrong.
    #[inline]
    pub fn counted(&mut self, period: f64, pulses: f64, uncertainty: f64) {
        let Reading { time, back, forth } = self.readings[self.newest];
        self.newest = (self.newest + 1) % RING;
        self.readings[self.newest] = Reading {
            time: time + period,
            back: back + (uncertainty - pulses),
            forth: forth + (uncertainty + pulses),
        };
        self.good = (self.good + 1).min(RING);
        self.regular = if period == self.period { self.regular + 1 } else { 0 };
        self.period = period;
        // Once every window lies within regular readings, none changes its length any more.
        if self.regular <= RING {
            self.measure();
        }
    }

    /// How long each window is.
    #[cold]
    #[inline(never)]
    fn measure(&mut self) {
        let now = self.readings[self.newest].time;
        for window in &mut self.windows {
            let span = now - self.readings[(self.newest + RING - window.lag) % RING].time;
            window.half = 0.5 * span;
            window.per_second = 1.0 / span;
        }
    }

    /// The last reading was not good: no window may reach over it.
    pub fn interrupt(&mut self) {
        self.good = 1;
    }

    /// Counts in the opposite direction from now on.
    pub fn reverse(&mut self) {
        for reading in &mut self.readings {
            core::mem::swap(&mut reading.back, &mut reading.forth);
        }
    }

    /// Between which speeds (m/s) the wheel must turn now, with a pitch (m) within `pitch` and accelerations (m/s²)
    /// within `acceleration`.
    #[inline]
    #[must_use]
    pub fn speed(&self, pitch: Range, acceleration: Range) -> Range {
        let mut fastest = [f64::INFINITY; 2];
        let now = &self.readings[self.newest];
        for &Window { lag, half, per_second } in &self.windows {
            if lag >= self.good {
                break;
            }
            let then = &self.readings[(self.newest + RING - lag) % RING];
            let turned = Turned::between(now, then);
            let [back, forth] = turned.distances(pitch);
            let [fastest_back, fastest_forth] = fastest;
            fastest = [
                smaller(back * per_second - half * acceleration.low, fastest_back),
                smaller(forth * per_second + half * acceleration.high, fastest_forth),
            ];
        }
        let [back, forth] = fastest;
        Range { low: -back, high: forth }
    }
}

/// How many pulses a wheel can have turned at most in a window, backwards and forwards; the one is negative that it
/// certainly turned backwards.
#[derive(Debug, Clone, Copy)]
struct Turned {
    back: f64,
    forth: f64,
}

impl Turned {
    #[inline]
    fn between(now: &Reading, then: &Reading) -> Self {
        Self { back: now.back - then.back + ONE_PULSE, forth: now.forth - then.forth + ONE_PULSE }
    }

    /// How far the wheel rolled at most, backwards and forwards (m).
    #[inline]
    fn distances(self, pitch: Range) -> [f64; 2] {
        // A wheel that certainly turns forward.
        if self.back <= -SHAKEN {
            return [self.back * pitch.low, self.forth * pitch.high];
        }
        self.short_distances(pitch)
    }

    /// The same of a wheel that may have stood or turned back. Apart from the rest, so that one that runs passes it by.
    #[cold]
    #[inline(never)]
    fn short_distances(self, pitch: Range) -> [f64; 2] {
        // Vibration of a tooth at the edge of the sensor is no motion.
        let shaken = 0.5 * (self.forth - self.back).abs() < SHAKEN;
        // A negative count is longest with the longest pitch.
        [self.back, self.forth].map(|most| {
            let most = if shaken { larger(most, 0.0) } else { most };
            most * if most < 0.0 { pitch.low } else { pitch.high }
        })
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
            windows.counted(if k == 0 { 0.0 } else { period }, pulses - before, 0.0);
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
        for Window { lag, half, per_second } in
            windows.windows.into_iter().filter(|each| each.lag < windows.good)
        {
            let (now, then) =
                (windows.readings[windows.newest], windows.readings[(windows.newest + RING - lag) % RING]);
            let (back, forth) = (now.back - then.back, now.forth - then.forth);
            let (pulses, off) = (0.5 * (forth - back), 0.5 * (forth + back) + 1.0 + PITCH_ERROR);
            let shaken = pulses.abs() < SHAKEN;
            let fewest = if shaken { (pulses - off).min(0.0) } else { pulses - off };
            let most = if shaken { (pulses + off).max(0.0) } else { pulses + off };
            let slowest = fewest * if fewest < 0.0 { pitch.high } else { pitch.low } * per_second;
            let fastest = most * if most < 0.0 { pitch.low } else { pitch.high } * per_second;
            speed.low = speed.low.max(slowest + half * acceleration.low);
            speed.high = speed.high.min(fastest + half * acceleration.high);
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
            // From full speed through a trembling standstill to running backwards, with some uncertain counts.
            let tremor = (seed >> 60) as f64 - 7.5;
            let pulses = libm::round(40.0 - f64::from(reading) / 60.0 + 0.2 * tremor);
            let uncertainty = if seed >> 58 == 0 { 3.0 } else { 0.0 };
            windows.counted(0.05, pulses, uncertainty);
            if reading % 500 == 499 {
                windows.interrupt();
            }
            let (both, one_by_one) =
                (windows.speed(pitch, acceleration), asked_one_by_one(&windows, pitch, acceleration));
            let close = |one: f64, other: f64| one == other || (one - other).abs() < 1e-10;
            assert!(
                close(both.low, one_by_one.low) && close(both.high, one_by_one.high),
                "{reading}: {both:?} {one_by_one:?}"
            );
        }
    }
}
