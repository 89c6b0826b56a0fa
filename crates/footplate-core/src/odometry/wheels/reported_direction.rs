//! The direction that a sensor reported lately.

use super::period::{Count, Direction, WheelReading};

/// How long a report counts (s). Two wheels that start together report it within half of that.
const COUNTS_FOR_S: f64 = 1.0;
/// Fewer pulses are a tooth that is shaken to and fro, not a train that turned round.
const CONVINCING_PULSES: f64 = 3.0;

/// The direction reported by one sensor.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReportedDirection {
    /// 1 where distance grows, −1 where it falls, 0 without a report.
    direction: f64,
    age: f64,
    pulses: f64,
}

impl ReportedDirection {
    /// Takes in a reading, `t` seconds after the last one, of a sensor whose sense of direction is `wiring` (1 or −1) and
    /// that counted so many signed pulses before.
    pub fn read(&mut self, reading: &WheelReading, wiring: f64, counted: f64, t: f64) {
        self.age += t;
        if self.age > COUNTS_FOR_S {
            *self = Self::default();
        }
        let (direction, pulses) = match (reading.count, reading.direction) {
            (Count::Pulses(pulses), Direction::Forward) if pulses > 0 => (wiring, pulses as f64),
            (Count::Pulses(pulses), Direction::Backward) if pulses > 0 => (-wiring, pulses as f64),
            (Count::Counter(_), _) if counted != 0.0 => (counted.signum(), counted.abs()),
            _ => return,
        };
        let before = if direction == self.direction { self.pulses } else { 0.0 };
        *self = Self { direction, age: 0.0, pulses: before + pulses };
    }

    /// 1 where distance grows, −1 where it falls, 0 without a report.
    #[must_use]
    pub fn direction(&self) -> f64 {
        self.direction
    }

    /// Whether more pulses report it than a shaken tooth gives.
    #[must_use]
    pub fn convincing(&self) -> bool {
        self.pulses >= CONVINCING_PULSES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shaken_tooth_reports_a_direction_that_is_not_accepted() {
        let mut reported = ReportedDirection::default();
        let reading = |direction| WheelReading { direction, ..WheelReading::pulses(1) };
        for direction in [Direction::Forward, Direction::Backward, Direction::Forward] {
            reported.read(&reading(direction), 1.0, 0.0, 0.05);
            assert!(!reported.convincing());
        }
        assert_eq!(reported.direction(), 1.0);
        for _ in 0..3 {
            reported.read(&reading(Direction::Backward), 1.0, 0.0, 0.05);
        }
        assert!(reported.convincing() && reported.direction() == -1.0);
        reported.read(&WheelReading::pulses(0), 1.0, 0.0, 1.1);
        assert_eq!(reported.direction(), 0.0, "forgotten after a second");
    }
    #[test]
    fn a_reading_without_a_pulse_says_nothing_of_the_direction() {
        let mut reported = ReportedDirection::default();
        let reading = |direction, pulses| WheelReading { direction, ..WheelReading::pulses(pulses) };
        reported.read(&reading(Direction::Backward, 3), -1.0, 0.0, 0.05);
        for direction in [Direction::Forward, Direction::Backward, Direction::Unknown] {
            reported.read(&reading(direction, 0), -1.0, 0.0, 0.3);
            assert!(reported.convincing() && reported.direction() == 1.0, "wired in reverse");
        }
        reported.read(&reading(Direction::Forward, 0), -1.0, 0.0, 0.3);
        assert!(!reported.convincing() && reported.direction() == 0.0, "1.2 s old");
        // A counter shows its direction by itself, however its lines are wired.
        let counter = WheelReading { count: Count::Counter(5), ..WheelReading::pulses(0) };
        reported.read(&counter, -1.0, 0.0, 0.05);
        assert_eq!(reported.direction(), 0.0);
        reported.read(&counter, -1.0, -2.0, 0.05);
        assert!(reported.direction() == -1.0 && !reported.convincing());
        reported.read(&counter, -1.0, -1.0, 0.05);
        assert!(reported.convincing());
    }
}
