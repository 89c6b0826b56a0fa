//! The tests that one train has to stand at every contact.

use crate::time::{TimeSpan, Timestamp};
use crate::tracking::PassedContact;
use crate::tracking::{Drift, DriftTest};

use super::alarm::Alarm;

/// Lateness is standardised by what was expected of it and by this part of the time since the contact before: wheels
/// get warm, a run differs from the next, and none of that is a disaster.
const USUAL_PART: f64 = 0.02;
/// A contact that comes this many standard deviations off, ...
const WILD: f64 = 6.0;
/// ... and by this part of its time, is a wild one; ...
const WILD_PART: f64 = 0.08;
/// ... and so many in a row are a disaster, whatever sums may say.
const WILD_IN_A_ROW: u8 = 2;
/// A train that ran all the way is as surely not as it was if one contact is off by so many standard deviations ...
const UNTIMELY: f64 = 8.0;
/// ... and this part of its time, even if it runs on as before: another engine under the number may be as fast, a train
/// that was lifted may come to the same contact.
const UNTIMELY_PART: f64 = 0.2;
/// Misses less what was seen in between, from which on a train is not followed any more.
const MOST_MISSES: usize = 4;

/// What is remembered of a train from contact to contact.
#[derive(Debug, Clone, Default)]
pub(super) struct ConsistencyMonitor {
    /// It was commanded to run since it stood, and has come to no contact yet: from rest, trains are late that are as they were.
    starts: bool,
    drift: DriftTest,
    wild: u8,
    misses: usize,
    last: Option<Timestamp>,
    is_located: bool,
}

impl ConsistencyMonitor {
    /// Somebody knows where it is.
    pub(super) fn place(&mut self) {
        *self = Self { starts: true, is_located: true, ..Self::default() };
    }

    /// It was commanded to stop: what comes next is a start.
    pub(super) const fn stand(&mut self) {
        self.starts = true;
    }

    /// Nobody does.
    pub(super) fn lose(&mut self) {
        *self = Self::default();
    }

    /// A contact that it passed. What is unusual about it, if anything.
    pub(super) fn pass(&mut self, passed: &PassedContact) -> Option<Alarm> {
        let before = self.last.replace(passed.window.until);
        let started = core::mem::take(&mut self.starts);
        let was_located = core::mem::replace(&mut self.is_located, true);
        let Some([late, deviation]) = passed.late else {
            self.wild = 0;
            return was_located.then_some(Alarm::Elsewhere(passed.sensor));
        };
        self.misses = (self.misses + passed.missed).saturating_sub(usize::from(passed.missed == 0));
        if self.misses >= MOST_MISSES {
            self.misses = 0;
            return Some(Alarm::Misses);
        }
        // From rest a start is late or early by more than its forecast knows; that is no drift.
        let took = before.map(|before| passed.window.until - before).unwrap_or(TimeSpan::ZERO).as_s();
        let standardised = late.as_s() / libm::hypot(deviation.as_s(), USUAL_PART * took);
        let is_wild = standardised.abs() >= WILD && late.as_s().abs() >= WILD_PART * took;
        self.wild = if is_wild { self.wild + 1 } else { 0 };
        let drift = self.drift.take(standardised);
        if self.wild >= WILD_IN_A_ROW {
            self.wild = 0;
            let drift = if standardised > 0.0 { Drift::Slower } else { Drift::Faster };
            return Some(Alarm::Drift(drift));
        }
        let is_untimely = standardised.abs() >= UNTIMELY && late.as_s().abs() >= UNTIMELY_PART * took;
        if is_untimely && !started {
            return Some(Alarm::Untimely(passed.sensor));
        }
        drift.map(Alarm::Drift)
    }
}
