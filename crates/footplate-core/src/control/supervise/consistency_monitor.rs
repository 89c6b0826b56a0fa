//! The tests of one train at every sensor.

use crate::time::{TimeSpan, Timestamp};
use crate::tracking::PassedContact;
use crate::tracking::{Drift, DriftTest};

use super::alarm::Alarm;

/// The innovation is normalised by its predicted standard deviation and by this part of the time since the last sensor:
/// wheels get warm, and runs differ.
const USUAL_PART: f64 = 0.02;
/// An innovation of this many standard deviations, ...
const WILD: f64 = 6.0;
/// ... and of this part of its time, is an outlier; ...
const WILD_PART: f64 = 0.08;
/// ... and this many in a row raise the alarm, whatever the drift test says.
const WILD_IN_A_ROW: u8 = 2;
/// A single innovation of this many standard deviations raises the alarm for a train that ran all the way, ...
const UNTIMELY: f64 = 8.0;
/// ... if it is also this part of its time, even if later ones fit: another engine under the number may be as fast, a lifted
/// train may come to the same sensor.
const UNTIMELY_PART: f64 = 0.2;
/// Missed sensors, less those that reported in between, that raise the alarm.
const MOST_MISSES: usize = 4;

/// The state of the tests between sensors.
#[derive(Debug, Clone, Default)]
pub(super) struct ConsistencyMonitor {
    /// It has started from rest and passed no sensor yet: a start is less predictable than a run.
    starts: bool,
    drift: DriftTest,
    wild: u8,
    misses: usize,
    last: Option<Timestamp>,
    is_located: bool,
}

impl ConsistencyMonitor {
    /// It is located.
    pub(super) fn place(&mut self) {
        *self = Self { starts: true, is_located: true, ..Self::default() };
    }

    /// It was commanded to stop: next comes a start.
    pub(super) const fn stand(&mut self) {
        self.starts = true;
    }

    /// Its place is unknown.
    pub(super) fn lose(&mut self) {
        *self = Self::default();
    }

    /// Tests a passage. Returns the alarm that it raises, if any.
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
        // A start deviates by more than its forecast says; that is no drift.
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
