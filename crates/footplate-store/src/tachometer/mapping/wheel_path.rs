//! A wheel speed, added up over time to the pulses that a tachometer would have counted.
//!
//! Between two rows the speed is taken for a line. The pulses of a period are the whole ones passed in it, so that nothing is
//! lost over a run: what is left of a pulse is counted in the next period.

use footplate_core::Timestamp;
use footplate_core::odometry::wheels::Direction;

use crate::tachometer::block::MISSING;

/// After a longer time nothing is known of the speed in between (s); the odometer begins anew after it, too.
const LONGEST_S: f64 = 2.0;

/// One wheelset of one run.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct WheelPath {
    /// The row before, and the pulses a second in it, if they were there.
    latest: Option<(Timestamp, Option<f64>)>,
    /// Pulses passed that make no whole one, 0 to 1.
    left: f64,
    /// It has turned backwards before, so that its sign means something.
    signed: bool,
}

impl WheelPath {
    /// Takes in a row with so many pulses a second; the pulses of its period and the direction. `period` is how long the period
    /// before the first row is taken to have lasted (s).
    pub(super) fn take(&mut self, time: Timestamp, rate: Option<f64>, period: f64) -> (i64, Direction) {
        let before = self.latest.replace((time, rate));
        let Some(rate) = rate else { return (MISSING, Direction::Unknown) };
        let t = before.map_or(period, |(before, _)| (time - before).as_s());
        if t <= 0.0 || t > LONGEST_S {
            return (MISSING, Direction::Unknown);
        }
        let mean = before.and_then(|(_, before)| before).map_or(rate, |before| 0.5 * (before + rate));
        self.signed |= mean < 0.0;
        let direction = match (self.signed, mean) {
            (true, mean) if mean < 0.0 => Direction::Backward,
            (true, mean) if mean > 0.0 => Direction::Forward,
            _ => Direction::Unknown,
        };
        let passed = self.left + mean.abs() * t;
        let whole = passed.floor();
        self.left = passed - whole;
        (whole as i64, direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_lost_over_a_run() {
        let mut path = WheelPath::default();
        // 7.3 pulses a second, ten rows a second, for 100 s.
        let counted: i64 =
            (0..1000).map(|n| path.take(Timestamp::from_ns(100_000_000 * n), Some(7.3), 0.1).0).sum();
        assert!((counted - 730).abs() <= 1, "{counted}");
    }

    #[test]
    fn gaps_are_missing_and_backwards_is_said() {
        let mut path = WheelPath::default();
        assert_eq!(path.take(Timestamp::from_s(0.0), Some(100.0), 0.1), (10, Direction::Unknown));
        assert_eq!(path.take(Timestamp::from_s(0.1), None, 0.1).0, MISSING);
        assert_eq!(path.take(Timestamp::from_s(0.2), Some(100.0), 0.1).0, 10);
        assert_eq!(path.take(Timestamp::from_s(9.0), Some(100.0), 0.1).0, MISSING);
        assert_eq!(path.take(Timestamp::from_s(9.1), Some(-100.0), 0.1), (0, Direction::Unknown));
        assert_eq!(path.take(Timestamp::from_s(9.2), Some(-100.0), 0.1), (10, Direction::Backward));
    }
}
