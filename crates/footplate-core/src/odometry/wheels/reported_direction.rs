//! Which way a sensor lately said that its wheel turned.

use super::period::{Count, Direction, WheelReading};

/// How long it counts what a sensor said (s): two wheels that start together say so within half of it.
const COUNTS_FOR_S: f64 = 1.0;
/// Fewer pulses are a tooth that is shaken to and fro, not a train that turned round.
const CONVINCING_PULSES: f64 = 3.0;

/// Minds what one sensor says.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReportedDirection {
    /// 1 the way in which distance grows, −1 the other, 0 if it says nothing.
    way: f64,
    age: f64,
    pulses: f64,
}

impl ReportedDirection {
    /// Takes in a reading, `t` seconds after the last one, of a sensor whose sense of direction is `wiring` (1 or −1) and
    /// that counted so many signed pulses before.
    pub fn hear(&mut self, reading: &WheelReading, wiring: f64, counted: f64, t: f64) {
        self.age += t;
        if self.age > COUNTS_FOR_S {
            *self = Self::default();
        }
        let (way, pulses) = match (reading.count, reading.direction) {
            (Count::Pulses(pulses), Direction::Forward) if pulses > 0 => (wiring, pulses as f64),
            (Count::Pulses(pulses), Direction::Backward) if pulses > 0 => (-wiring, pulses as f64),
            (Count::Counter(_), _) if counted != 0.0 => (counted.signum(), counted.abs()),
            _ => return,
        };
        let before = if way == self.way { self.pulses } else { 0.0 };
        *self = Self { way, age: 0.0, pulses: before + pulses };
    }

    /// The way it says, 0 if it says nothing.
    #[must_use]
    pub fn way(&self) -> f64 {
        self.way
    }

    /// Whether it says so with more than a shaken tooth.
    #[must_use]
    pub fn convincing(&self) -> bool {
        self.pulses >= CONVINCING_PULSES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shaken_tooth_says_a_way_and_does_not_convince() {
        let mut told = ReportedDirection::default();
        let reading = |direction| WheelReading { direction, ..WheelReading::pulses(1) };
        for direction in [Direction::Forward, Direction::Backward, Direction::Forward] {
            told.hear(&reading(direction), 1.0, 0.0, 0.05);
            assert!(!told.convincing());
        }
        assert_eq!(told.way(), 1.0);
        for _ in 0..3 {
            told.hear(&reading(Direction::Backward), 1.0, 0.0, 0.05);
        }
        assert!(told.convincing() && told.way() == -1.0);
        told.hear(&WheelReading::pulses(0), 1.0, 0.0, 1.1);
        assert_eq!(told.way(), 0.0, "forgotten after a second");
    }
}
