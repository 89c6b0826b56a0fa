//! Sensor faults: how often each sensor reports where no train can be.

use alloc::collections::BTreeMap;

use crate::ids::SensorId;
use crate::time::{TimeSpan, Timestamp};

/// Rate of spurious detections (1/s) of a sensor that had none so far: once in twenty minutes over the eighty sensors
/// of a layout (well-kept course layouts: 0.05 per minute).
const SPURIOUS_RATE: f64 = 1e-5;
/// Time constant with which unexplained detections are forgotten (chosen: longer than a train's lap).
const FORGETTING_TIME: TimeSpan = TimeSpan::from_s(120.0);
/// A sensor with this many unexplained detections is stuck: three within half a minute. By chance that happens to one
/// sensor in a century of running.
const STUCK_FROM: f64 = 2.4;
/// A stuck sensor is used again below this: after two minutes without an unexplained detection, or two detections
/// when a train was due.
const RESTORED_BELOW: f64 = 0.9;
/// The factor by which one explained detection reduces the unexplained ones.
const EXPLAINED_FACTOR: f64 = 0.5;

/// The fault records of all sensors.
#[derive(Debug, Clone, Default)]
pub(super) struct SensorFaults {
    records: BTreeMap<SensorId, Record>,
}

#[derive(Debug, Clone, Copy)]
struct Record {
    /// Unexplained detections with forgetting, as of `at`.
    unexplained: f64,
    at: Timestamp,
    is_stuck: bool,
}

impl Record {
    fn unexplained_at(&self, now: Timestamp) -> f64 {
        let since = (now - self.at).as_s().max(0.0);
        self.unexplained * libm::exp(-since / FORGETTING_TIME.as_s())
    }
}

impl SensorFaults {
    /// ln of the recent rate (1/s) of spurious detections of a sensor.
    pub(super) fn log_rate(&self, sensor: SensorId, now: Timestamp) -> f64 {
        let strange = self.records.get(&sensor).map_or(0.0, |record| record.unexplained_at(now));
        libm::log(SPURIOUS_RATE + strange / FORGETTING_TIME.as_s())
    }

    /// The same without the last one.
    pub(super) fn log_rate_before(&self, sensor: SensorId, now: Timestamp) -> f64 {
        let strange = self.records.get(&sensor).map_or(0.0, |record| record.unexplained_at(now) - 1.0);
        libm::log(SPURIOUS_RATE + strange.max(0.0) / FORGETTING_TIME.as_s())
    }

    /// Whether its reports are ignored.
    pub(super) fn is_stuck(&self, sensor: SensorId) -> bool {
        self.records.get(&sensor).is_some_and(|record| record.is_stuck)
    }

    /// Records an unexplained detection. Returns whether the sensor counts as stuck from now on.
    pub(super) fn note_unexplained(&mut self, sensor: SensorId, now: Timestamp) -> bool {
        let record =
            self.records.entry(sensor).or_insert(Record { unexplained: 0.0, at: now, is_stuck: false });
        record.unexplained = record.unexplained_at(now) + 1.0;
        record.at = now;
        let was_stuck = record.is_stuck;
        record.is_stuck |= record.unexplained >= STUCK_FROM;
        record.is_stuck && !was_stuck
    }

    /// Records a detection that a train caused.
    pub(super) fn note_explained(&mut self, sensor: SensorId, now: Timestamp) {
        if let Some(record) = self.records.get_mut(&sensor) {
            record.unexplained = record.unexplained_at(now) * EXPLAINED_FACTOR;
            record.at = now;
        }
    }

    /// A stuck sensor that is used again from now on; call until `None`.
    pub(super) fn next_restored(&mut self, now: Timestamp) -> Option<SensorId> {
        let restored = |record: &Record| record.is_stuck && record.unexplained_at(now) < RESTORED_BELOW;
        let (sensor, record) = self.records.iter_mut().find(|(_, record)| restored(record))?;
        record.is_stuck = false;
        Some(*sensor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSOR: SensorId = SensorId(7);

    fn at(seconds: f64) -> Timestamp {
        Timestamp::from_s(seconds)
    }

    #[test]
    fn a_sensor_with_repeated_unexplained_detections_is_stuck_for_a_while() {
        let mut faults = SensorFaults::default();
        assert!(!faults.note_unexplained(SENSOR, at(1.0)));
        assert!(!faults.note_unexplained(SENSOR, at(9.0)));
        assert!(faults.note_unexplained(SENSOR, at(20.0)), "the third within half a minute");
        assert!(faults.is_stuck(SENSOR));
        assert!(!faults.note_unexplained(SENSOR, at(21.0)), "reported once");
        assert_eq!(faults.next_restored(at(60.0)), None);
        assert_eq!(faults.next_restored(at(240.0)), Some(SENSOR));
        assert_eq!(faults.next_restored(at(240.0)), None);
        assert!(!faults.is_stuck(SENSOR));
    }

    #[test]
    fn the_rate_before_a_detection_is_the_rate_without_it() {
        let mut faults = SensorFaults::default();
        let rates = |faults: &SensorFaults| {
            [faults.log_rate_before(SENSOR, at(5.0)), faults.log_rate(SENSOR, at(5.0))]
        };
        let [usual, none] = rates(&faults);
        assert_eq!(usual, none);
        faults.note_unexplained(SENSOR, at(5.0));
        let [before, one] = rates(&faults);
        assert_eq!(before, usual);
        assert!(one > usual + 1.0, "{one} {usual}");
        faults.note_unexplained(SENSOR, at(5.0));
        assert_eq!(rates(&faults)[0], one);
    }

    #[test]
    fn explained_detections_restore_a_stuck_sensor() {
        let mut faults = SensorFaults::default();
        let usual = faults.log_rate(SENSOR, at(0.0));
        for seconds in [1.0, 2.0, 3.0] {
            faults.note_unexplained(SENSOR, at(seconds));
        }
        assert!(faults.log_rate(SENSOR, at(4.0)) > usual + 5.0);
        faults.note_explained(SENSOR, at(9.0));
        faults.note_explained(SENSOR, at(18.0));
        assert_eq!(faults.next_restored(at(19.0)), Some(SENSOR));
    }
}
