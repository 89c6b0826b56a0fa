//! Alarms, and the tests of a train at every sensor that raise them.

use core::fmt;

use crate::ids::SensorId;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{Drift, DriftTest, PassedSensor};

/// The innovation is normalised by its predicted standard deviation and by this fraction of the time since the last
/// sensor: trains warm up, and runs differ.
const USUAL_PART: f64 = 0.02;
/// An innovation of this many standard deviations, ...
const OUTLIER: f64 = 6.0;
/// ... and of this fraction of its time, is an outlier; ...
const OUTLIER_PART: f64 = 0.08;
/// ... and this many in a row raise the alarm without the drift test.
const OUTLIERS_IN_A_ROW: u8 = 2;
/// A single innovation of this many standard deviations raises the alarm for a train that did not start from rest,
/// ...
const UNTIMELY: f64 = 8.0;
/// ... if it is also this fraction of its time, even if later ones fit: another locomotive with the same address may
/// be as fast, and a lifted train may reach the same sensor.
const UNTIMELY_PART: f64 = 0.2;
/// Missed detections, minus those that came in between, that raise the alarm: the fourth, where nearly none are usual.
const MAX_MISSES: f64 = 3.5;
/// Twice as many as are usual at a speed do not count.
const USUAL_TWICE: f64 = 2.0;

/// Why a train is no longer trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Alarm {
    /// Detections come later and later than predicted, or earlier and earlier.
    Drift(Drift),
    /// The position of the train is unknown.
    Lost,
    /// A sensor reported the train where it cannot have run.
    Elsewhere(SensorId),
    /// A sensor reported the train so early or so late that an operator or a fault must have moved or stopped it.
    Untimely(SensorId),
    /// Its decoder reports that it stands, and it should be running.
    Stalled,
    /// Several sensors in a row did not report the train.
    Misses,
    /// The station does not answer.
    LinkSilent,
    /// Sensors report at random.
    Noise,
    /// A stop command was not sent in time.
    StopUnconfirmed,
    /// The train was commanded to stop, and sensors still report it.
    DoesNotStop(SensorId),
    /// The caller does not trust the train.
    Distrusted,
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Drift(Drift::Slower) => "it runs slower than calibrated",
            Self::Drift(Drift::Faster) => "it runs faster than calibrated",
            Self::Lost => "its position is lost",
            Self::Elsewhere(_) => "a sensor reported it where it cannot have run to",
            Self::Untimely(_) => "a sensor reported it at a time when it cannot have been there",
            Self::Stalled => "its decoder reports that it stands still",
            Self::Misses => "several sensors in a row did not report it",
            Self::LinkSilent => "the station does not answer",
            Self::Noise => "sensors report at random",
            Self::StopUnconfirmed => "the stop command could not be sent",
            Self::DoesNotStop(_) => "it was commanded to stop and sensors still report it",
            Self::Distrusted => "its model no longer fits",
        })
    }
}

/// The state of the tests between sensors.
#[derive(Debug, Clone, Default)]
pub(super) struct ConsistencyMonitor {
    /// The train has started from rest and passed no sensor yet: a start is less predictable than a run.
    starts: bool,
    drift: DriftTest,
    outliers: u8,
    /// Missed detections beyond what is usual.
    misses: f64,
    last: Option<Timestamp>,
    is_located: bool,
}

impl ConsistencyMonitor {
    /// The train was located.
    pub(super) fn place(&mut self) {
        *self = Self { starts: true, is_located: true, ..Self::default() };
    }

    /// The train was commanded to stop: a start follows.
    pub(super) const fn stop(&mut self) {
        self.starts = true;
    }

    /// The position of the train is unknown.
    pub(super) fn lose(&mut self) {
        *self = Self::default();
    }

    /// When a sensor last reported the train since it was located.
    pub(super) const fn last(&self) -> Option<Timestamp> {
        self.last
    }

    /// Tests a passage at a speed at which sensors miss a share of detections. Returns the alarm that it raises, if any.
    pub(super) fn pass(&mut self, passed: &PassedSensor, missed_share: f64) -> Option<Alarm> {
        let before = self.last.replace(passed.window.until);
        let started = core::mem::take(&mut self.starts);
        let was_located = core::mem::replace(&mut self.is_located, true);
        let Some([late, deviation]) = passed.late else {
            self.outliers = 0;
            return was_located.then_some(Alarm::Elsewhere(passed.sensor));
        };
        // Missed before each detection, where each sensor misses a share of all.
        let usual = missed_share / (1.0 - missed_share);
        let counts = if passed.missed == 0 { -1.0 } else { passed.missed as f64 };
        self.misses = (self.misses + counts - USUAL_TWICE * usual).max(0.0);
        if self.misses >= MAX_MISSES {
            self.misses = 0.0;
            return Some(Alarm::Misses);
        }
        // A start deviates by more than predicted; that is no drift.
        let took = before.map(|before| passed.window.until - before).unwrap_or(TimeSpan::ZERO).as_s();
        let standardised = late.as_s() / libm::hypot(deviation.as_s(), USUAL_PART * took);
        let is_outlier = standardised.abs() >= OUTLIER && late.as_s().abs() >= OUTLIER_PART * took;
        self.outliers = if is_outlier { self.outliers + 1 } else { 0 };
        let drift = self.drift.take(standardised);
        if self.outliers >= OUTLIERS_IN_A_ROW {
            self.outliers = 0;
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
