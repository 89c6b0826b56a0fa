//! The truth of a run, for scorers only.

use footplate_core::{Approach, EdgeId, Length, SensorId, Speed, SpeedStep, TimeSpan, Timestamp};

use crate::path::{Path, Point};
use crate::sensors::Cause;

/// Integration steps per motion sample; a cubic through places and speeds interpolates, accurate to micrometres.
pub(crate) const SAMPLE_STEPS: usize = 10;

/// The truth of one run, on the clock of its events.
#[derive(Debug, Clone, PartialEq)]
pub struct RunTruth {
    /// One entry for each sensor report among the events, in their order.
    pub reports: Vec<ReportTruth>,
    /// One entry for each speed command among the events, in their order.
    pub commands: Vec<CommandTruth>,
    /// One entry for each manual measurement among the events, in their order.
    pub stops: Vec<StopTruth>,
    /// Position and speed of the train.
    pub motion: Motion,
    /// The side from which a train that runs from the start reached its speed.
    pub approach_at_start: Approach,
    /// The speed of this run relative to an average one.
    pub run_factor: f64,
    /// Whether the train was at rest at a step other than 0 when the run ended.
    pub stalled: bool,
}

/// The truth behind a sensor report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReportTruth {
    /// The index of its event.
    pub event: usize,
    /// The sensor.
    pub sensor: SensorId,
    /// Why it was closed.
    pub cause: Cause,
    /// Whether this is the first report of that actuation.
    pub first: bool,
    /// When it closed.
    pub closed: Timestamp,
    /// When it was read.
    pub reading: Timestamp,
    /// When the previous reading took place.
    pub reading_before: Timestamp,
}

/// The truth behind a speed command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandTruth {
    /// The index of its event.
    pub event: usize,
    /// The step commanded.
    pub step: SpeedStep,
    /// When the decoder received it.
    pub heard: Timestamp,
}

/// The truth behind a manual measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopTruth {
    /// The index of its event.
    pub event: usize,
    /// When the train came to rest.
    pub rested: Timestamp,
    /// How far past the landmark's node it came to rest.
    pub offset: Length,
}

/// The leading end of the train's shoe over time, from the start of the run to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    pub(crate) begins: Timestamp,
    pub(crate) spacing: TimeSpan,
    /// Distance in mm and speed in mm/s, evenly spaced.
    pub(crate) samples: Vec<[f64; 2]>,
    pub(crate) path: Path,
}

impl Motion {
    /// The start of the run.
    pub const fn begins(&self) -> Timestamp {
        self.begins
    }

    /// The end of the run.
    pub fn ends(&self) -> Timestamp {
        let spans = self.samples.len().saturating_sub(1) as i64;
        self.begins + TimeSpan::from_ns(self.spacing.as_ns() * spans)
    }

    /// Distance from the start of the run; before it and after its end, the distance there.
    pub fn distance(&self, at: Timestamp) -> Length {
        let Some(([x0, v0], [x1, v1], part)) = self.around(at) else { return Length::ZERO };
        let h = self.spacing.as_s();
        let (rest, all) = (1.0 - part, part);
        // The cubic through both places with both speeds (Hermite).
        let mm = x0 * rest * rest * (1.0 + 2.0 * all)
            + x1 * all * all * (1.0 + 2.0 * rest)
            + h * v0 * all * rest * rest
            - h * v1 * rest * all * all;
        Length::from_mm(mm)
    }

    /// Speed; before the start and after the end of the run, the speed there.
    pub fn speed(&self, at: Timestamp) -> Speed {
        let Some(([_, v0], [_, v1], part)) = self.around(at) else { return Speed::ZERO };
        Speed::from_mm_per_s(v0 + (v1 - v0) * part)
    }

    /// The edge and the offset on it, by true lengths.
    pub fn place(&self, at: Timestamp) -> Option<(EdgeId, Length)> {
        self.path.place(self.distance(at).as_mm())
    }

    /// Every sensor on the path, passed or ahead, with its distance from the start of the run.
    pub fn sensors(&self) -> impl ExactSizeIterator<Item = (SensorId, Length)> + '_ {
        self.path.sensors.iter().map(|Point { at_mm, what }| (*what, Length::from_mm(*at_mm)))
    }

    /// When the train had run a distance; `None` if it never did.
    pub fn time_at(&self, distance: Length) -> Option<Timestamp> {
        let mm = distance.as_mm();
        let after = self.samples.partition_point(|[x, _]| *x < mm);
        let (before, [reached, _]) = (after.checked_sub(1)?, self.samples.get(after)?);
        let [x, _] = self.samples.get(before)?;
        let (mut low, mut high) = (self.time_of(before), self.time_of(after));
        debug_assert!(*x < mm && *reached >= mm);
        // Bisection on the cubic, to the nanosecond.
        while (high - low).as_ns() > 1 {
            let middle = low + TimeSpan::from_ns((high - low).as_ns() / 2);
            if self.distance(middle).as_mm() < mm { low = middle } else { high = middle }
        }
        Some(high)
    }

    fn time_of(&self, sample: usize) -> Timestamp {
        self.begins + TimeSpan::from_ns(self.spacing.as_ns() * sample as i64)
    }

    fn around(&self, at: Timestamp) -> Option<([f64; 2], [f64; 2], f64)> {
        let last = self.samples.len().checked_sub(1)?;
        let spans = (at - self.begins).as_ns() as f64 / self.spacing.as_ns() as f64;
        let spans = spans.clamp(0.0, last as f64);
        let lower = (spans as usize).min(last.saturating_sub(1));
        let upper = (lower + 1).min(last);
        Some((*self.samples.get(lower)?, *self.samples.get(upper)?, (spans - lower as f64).min(1.0)))
    }
}
