//! How contacts have behaved: which of them close where no train can be, and how often.

use alloc::collections::BTreeMap;

use crate::ids::SensorId;
use crate::time::{TimeSpan, Timestamp};

/// How often one contact closes by itself that never did so (1/s): on a layout of eighty that is once in twenty minutes
/// over all (well-kept course layouts: 0.05 a minute).
const USUAL_RATE: f64 = 1e-5;
/// Strange closures are forgotten over this time (chosen: longer than a train's round).
const FORGOTTEN_IN: TimeSpan = TimeSpan::from_s(120.0);
/// A contact with so many that are not forgotten is stuck: three within half a minute. By chance that happens to one
/// contact in a century of running.
const STUCK_FROM: f64 = 2.4;
/// Below so many it has behaved: two minutes without another one, or two closures just when a train was due.
const BEHAVES_BELOW: f64 = 0.9;
/// What one closure at the right time leaves of the strange ones.
const PARDON: f64 = 0.5;

/// The conduct of all contacts.
#[derive(Debug, Clone, Default)]
pub(super) struct ContactConduct {
    contacts: BTreeMap<SensorId, Record>,
}

#[derive(Debug, Clone, Copy)]
struct Record {
    /// Strange closures, as of the last entry.
    strange: f64,
    at: Timestamp,
    is_stuck: bool,
}

impl Record {
    fn strange_at(&self, now: Timestamp) -> f64 {
        let since = (now - self.at).as_s().max(0.0);
        self.strange * libm::exp(-since / FORGOTTEN_IN.as_s())
    }
}

impl ContactConduct {
    /// ln of how often (1/s) a contact closes by itself, by what it did of late.
    pub(super) fn log_rate(&self, sensor: SensorId, now: Timestamp) -> f64 {
        let strange = self.contacts.get(&sensor).map_or(0.0, |record| record.strange_at(now));
        libm::log(USUAL_RATE + strange / FORGOTTEN_IN.as_s())
    }

    /// Whether it is not believed.
    pub(super) fn is_stuck(&self, sensor: SensorId) -> bool {
        self.contacts.get(&sensor).is_some_and(|record| record.is_stuck)
    }

    /// It closed where no train can have been. Returns whether it counts as stuck from now on.
    pub(super) fn note_strange(&mut self, sensor: SensorId, now: Timestamp) -> bool {
        let record = self.contacts.entry(sensor).or_insert(Record { strange: 0.0, at: now, is_stuck: false });
        record.strange = record.strange_at(now) + 1.0;
        record.at = now;
        let was_stuck = record.is_stuck;
        record.is_stuck |= record.strange >= STUCK_FROM;
        record.is_stuck && !was_stuck
    }

    /// It closed when a train came by, as it should.
    pub(super) fn note_good(&mut self, sensor: SensorId, now: Timestamp) {
        if let Some(record) = self.contacts.get_mut(&sensor) {
            record.strange = record.strange_at(now) * PARDON;
            record.at = now;
        }
    }

    /// A contact that was stuck and has behaved since; it is believed from now on. Until `None`.
    pub(super) fn next_reformed(&mut self, now: Timestamp) -> Option<SensorId> {
        let reformed = |record: &Record| record.is_stuck && record.strange_at(now) < BEHAVES_BELOW;
        let (sensor, record) = self.contacts.iter_mut().find(|(_, record)| reformed(record))?;
        record.is_stuck = false;
        Some(*sensor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONTACT: SensorId = SensorId(7);

    fn at(seconds: f64) -> Timestamp {
        Timestamp::from_s(seconds)
    }

    #[test]
    fn a_contact_that_closes_again_and_again_is_stuck_until_it_has_behaved() {
        let mut conduct = ContactConduct::default();
        assert!(!conduct.note_strange(CONTACT, at(1.0)));
        assert!(!conduct.note_strange(CONTACT, at(9.0)));
        assert!(conduct.note_strange(CONTACT, at(20.0)), "the third within half a minute");
        assert!(conduct.is_stuck(CONTACT));
        assert!(!conduct.note_strange(CONTACT, at(21.0)), "said once");
        assert_eq!(conduct.next_reformed(at(60.0)), None);
        assert_eq!(conduct.next_reformed(at(240.0)), Some(CONTACT));
        assert_eq!(conduct.next_reformed(at(240.0)), None);
        assert!(!conduct.is_stuck(CONTACT));
    }

    #[test]
    fn closing_when_trains_come_by_makes_up_for_strange_closures() {
        let mut conduct = ContactConduct::default();
        let usual = conduct.log_rate(CONTACT, at(0.0));
        for seconds in [1.0, 2.0, 3.0] {
            conduct.note_strange(CONTACT, at(seconds));
        }
        assert!(conduct.log_rate(CONTACT, at(4.0)) > usual + 5.0);
        conduct.note_good(CONTACT, at(9.0));
        conduct.note_good(CONTACT, at(18.0));
        assert_eq!(conduct.next_reformed(at(19.0)), Some(CONTACT));
    }
}
