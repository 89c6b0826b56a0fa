//! How records have behaved: which of them close where no train can be, and how often.

use alloc::collections::BTreeMap;

use crate::ids::SensorId;
use crate::time::{TimeSpan, Timestamp};

/// How often one contact closes by itself that never did so (1/s): on a layout of eighty that is once in twenty minutes
/// over all (well-kept course layouts: 0.05 a minute).
const SPURIOUS_RATE: f64 = 1e-5;
/// Strange closures are forgotten over this time (chosen: longer than a train's round).
const FORGETTING_TIME: TimeSpan = TimeSpan::from_s(120.0);
/// A contact with so many that are not forgotten is stuck: three within half a minute. By chance that happens to one
/// contact in a century of running.
const STUCK_FROM: f64 = 2.4;
/// Below so many it has behaved: two minutes without another one, or two closures just when a train was due.
const RESTORED_BELOW: f64 = 0.9;
/// What one detection at the right time leaves of the strange ones.
const EXPLAINED_FACTOR: f64 = 0.5;

/// The faults of all records.
#[derive(Debug, Clone, Default)]
pub(super) struct SensorFaults {
    records: BTreeMap<SensorId, Record>,
}

#[derive(Debug, Clone, Copy)]
struct Record {
    /// Strange closures, as of the last entry.
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
    /// ln of how often (1/s) a contact closes by itself, by what it did of late.
    pub(super) fn log_rate(&self, sensor: SensorId, now: Timestamp) -> f64 {
        let strange = self.records.get(&sensor).map_or(0.0, |record| record.unexplained_at(now));
        libm::log(SPURIOUS_RATE + strange / FORGETTING_TIME.as_s())
    }

    /// Whether it is not believed.
    pub(super) fn is_stuck(&self, sensor: SensorId) -> bool {
        self.records.get(&sensor).is_some_and(|record| record.is_stuck)
    }

    /// It closed where no train can have been. Returns whether it counts as stuck from now on.
    pub(super) fn note_unexplained(&mut self, sensor: SensorId, now: Timestamp) -> bool {
        let record =
            self.records.entry(sensor).or_insert(Record { unexplained: 0.0, at: now, is_stuck: false });
        record.unexplained = record.unexplained_at(now) + 1.0;
        record.at = now;
        let was_stuck = record.is_stuck;
        record.is_stuck |= record.unexplained >= STUCK_FROM;
        record.is_stuck && !was_stuck
    }

    /// It closed when a train came by, as it should.
    pub(super) fn note_explained(&mut self, sensor: SensorId, now: Timestamp) {
        if let Some(record) = self.records.get_mut(&sensor) {
            record.unexplained = record.unexplained_at(now) * EXPLAINED_FACTOR;
            record.at = now;
        }
    }

    /// A contact that was stuck and has behaved since; it is believed from now on. Until `None`.
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
    fn a_contact_that_closes_again_and_again_is_stuck_until_it_has_behaved() {
        let mut faults = SensorFaults::default();
        assert!(!faults.note_unexplained(SENSOR, at(1.0)));
        assert!(!faults.note_unexplained(SENSOR, at(9.0)));
        assert!(faults.note_unexplained(SENSOR, at(20.0)), "the third within half a minute");
        assert!(faults.is_stuck(SENSOR));
        assert!(!faults.note_unexplained(SENSOR, at(21.0)), "said once");
        assert_eq!(faults.next_restored(at(60.0)), None);
        assert_eq!(faults.next_restored(at(240.0)), Some(SENSOR));
        assert_eq!(faults.next_restored(at(240.0)), None);
        assert!(!faults.is_stuck(SENSOR));
    }

    #[test]
    fn closing_when_trains_come_by_makes_up_for_strange_closures() {
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
