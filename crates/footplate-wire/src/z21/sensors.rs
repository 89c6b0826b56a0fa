//! Sensor states on a line that may lose, double or reorder messages.

use alloc::vec::Vec;

use footplate_core::{TimeSpan, Timestamp};

/// A sensor that is occupied again within this time after it was free is no second train: it bounced, or an old datagram arrived
/// late. Longer than the interval of polls, which correct such an error.
const BOUNCES: TimeSpan = TimeSpan::from_ms(400);

/// One sensor.
#[derive(Debug, Clone, Copy)]
struct Sensor {
    number: u16,
    is_occupied: bool,
    /// When it last became free.
    freed: Option<Timestamp>,
    /// When it was last reported free.
    free_at: Option<Timestamp>,
}

/// The sensors that the station has reported, in the order of their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Sensors(Vec<Sensor>);

/// What a message means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Change {
    /// It became occupied; when it was last reported free.
    Occupied { free_at: Option<Timestamp> },
    /// It was occupied before it was first read.
    HeldFromStart,
    /// It became free.
    Freed,
    /// No change.
    None,
}

impl Sensors {
    /// Notes a sensor's state. `listing`: all states are being read, so the first message about a sensor is no change.
    pub(super) fn heard(&mut self, now: Timestamp, number: u16, is_occupied: bool, listing: bool) -> Change {
        let sensor = match self.0.binary_search_by_key(&number, |sensor| sensor.number) {
            Ok(at) => self.0.get_mut(at),
            Err(at) => {
                let free_at = (!is_occupied).then_some(now);
                self.0.insert(at, Sensor { number, is_occupied, freed: None, free_at });
                return match (is_occupied, listing) {
                    (true, true) => Change::HeldFromStart,
                    (true, false) => Change::Occupied { free_at: None },
                    (false, _) => Change::None,
                };
            }
        };
        let Some(sensor) = sensor else { return Change::None };
        let was_occupied = core::mem::replace(&mut sensor.is_occupied, is_occupied);
        let bounces = sensor.freed.is_some_and(|freed| now - freed < BOUNCES);
        let free_at = sensor.free_at;
        if !is_occupied {
            sensor.free_at = Some(now);
            if was_occupied {
                sensor.freed = Some(now);
                return Change::Freed;
            }
        }
        if is_occupied && !was_occupied && !bounces { Change::Occupied { free_at } } else { Change::None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: i64) -> Timestamp {
        Timestamp::ZERO + TimeSpan::from_ms(ms)
    }

    #[test]
    fn a_sensor_is_reported_once_each_time_it_becomes_occupied() {
        let mut sensors = Sensors::default();
        assert_eq!(sensors.heard(at(0), 5, false, true), Change::None);
        assert_eq!(sensors.heard(at(0), 3, true, true), Change::HeldFromStart);
        assert_eq!(sensors.heard(at(100), 5, false, false), Change::None);
        assert_eq!(sensors.heard(at(900), 5, true, false), Change::Occupied { free_at: Some(at(100)) });
        assert_eq!(sensors.heard(at(910), 5, true, false), Change::None, "it came twice");
        assert_eq!(sensors.heard(at(1_300), 5, false, false), Change::Freed);
        assert_eq!(sensors.heard(at(2_000), 5, true, false), Change::Occupied { free_at: Some(at(1_300)) });
        assert_eq!(sensors.heard(at(2_000), 9, true, false), Change::Occupied { free_at: None });
    }

    #[test]
    fn an_older_datagram_behind_a_newer_one_is_no_second_train() {
        let mut sensors = Sensors::default();
        sensors.heard(at(0), 5, false, true);
        assert!(matches!(sensors.heard(at(1_000), 5, true, false), Change::Occupied { .. }));
        // The answer from before it was occupied comes late, and the next puts it right.
        assert_eq!(sensors.heard(at(1_004), 5, false, false), Change::Freed);
        assert_eq!(sensors.heard(at(1_200), 5, true, false), Change::None);
        // It is free, and the message of before comes late.
        assert_eq!(sensors.heard(at(1_500), 5, false, false), Change::Freed);
        assert_eq!(sensors.heard(at(1_520), 5, true, false), Change::None);
        assert_eq!(sensors.heard(at(1_700), 5, false, false), Change::Freed);
    }
}
