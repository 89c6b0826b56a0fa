//! The last minutes of each train, for charts over time.

use std::collections::VecDeque;

use footplate_core::tracking::Located;
use footplate_core::{HALF_95, Length, SpeedStep};
use serde::Serialize;

use super::picture::{millis, tenths};

/// Five minutes at 10 Hz; older samples are dropped.
const MAX_SAMPLES: usize = 3_000;

/// One sample of a train. Intervals are 95 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    t_s: f64,
    step: u8,
    at: Option<MotionAt>,
}

/// The motion of a located train (mm/s, mm).
#[derive(Debug, Clone, Copy, PartialEq)]
struct MotionAt {
    speed: f64,
    speed_half: f64,
    distance: f64,
    half: f64,
}

impl Sample {
    /// A sample at a time; without a position only the commanded step is kept.
    pub(super) fn of(
        t_s: f64,
        commanded: SpeedStep,
        located: Option<&Located>,
        travelled: Option<Length>,
    ) -> Self {
        let at = located.zip(travelled).map(|(located, distance)| MotionAt {
            speed: tenths(located.speed.as_mm_per_s()),
            speed_half: tenths(HALF_95 * located.speed_uncertainty.as_mm_per_s()),
            distance: tenths(distance.as_mm()),
            half: tenths(HALF_95 * located.uncertainty.as_mm()),
        });
        Self { t_s: millis(t_s), step: commanded.get(), at }
    }
}

/// The samples of the last minutes, oldest first.
#[derive(Debug, Clone, Default)]
pub(super) struct History(VecDeque<Sample>);

/// The samples, column by column.
#[derive(Debug, Default, Serialize)]
pub(super) struct Columns {
    t_s: Vec<f64>,
    step: Vec<u8>,
    speed_mm_per_s: Vec<Option<f64>>,
    speed_half_mm_per_s: Vec<Option<f64>>,
    #[serde(rename = "way_mm")]
    distance_mm: Vec<Option<f64>>,
    half_mm: Vec<Option<f64>>,
}

impl History {
    pub(super) fn add(&mut self, sample: Sample) {
        if self.0.len() == MAX_SAMPLES {
            self.0.pop_front();
        }
        self.0.push_back(sample);
    }

    pub(super) fn columns(&self) -> Columns {
        let mut columns = Columns::default();
        for Sample { t_s, step, at } in &self.0 {
            columns.t_s.push(*t_s);
            columns.step.push(*step);
            columns.speed_mm_per_s.push(at.map(|at| at.speed));
            columns.speed_half_mm_per_s.push(at.map(|at| at.speed_half));
            columns.distance_mm.push(at.map(|at| at.distance));
            columns.half_mm.push(at.map(|at| at.half));
        }
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_moments_are_dropped_and_the_newest_kept() {
        let mut history = History::default();
        for number in 0..MAX_SAMPLES + 10 {
            history.add(Sample::of(number as f64, SpeedStep::STAND, None, None));
        }
        let columns = history.columns();
        assert_eq!((columns.t_s.len(), columns.t_s[0]), (MAX_SAMPLES, 10.0));
        assert_eq!(columns.t_s.last(), Some(&(MAX_SAMPLES as f64 + 9.0)));
    }
}
