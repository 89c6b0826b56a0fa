//! The forecasting methods of courses and clubs, on the same detections: a constant table, running averages of the
//! speed of a step, and the last lap.
//!
//! Each forecasts the report at `last report + length / speed` with the surveyed length, whatever the train does on the
//! hop; the last lap uses the time that the same hop took before. They learn only from hops that our estimator
//! considers steady and does not reject, and their speeds start with the mean of the first lap: both are to their
//! advantage.

use std::collections::BTreeMap;

use super::shift_average::ShiftAverage;
use footplate_core::track::{HopId, Reach};
use footplate_core::tracking::{ForecastPhase, Hit, Verdict};
use footplate_core::{Length, NodeId, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::reference_forecaster::BASELINES;

/// α = 2⁻⁸ = 1/256 of the slow average.
const SLOW_SHIFT: u32 = 8;
/// α of the floating-point averages.
const MIDDLE_ALPHA: f64 = 0.1;
const FAST_ALPHA: f64 = 0.5;
/// Units of the slow average: µm/s, 3 ppm of creep speed.
const UNITS_PER_MM_PER_S: f64 = 1e3;

/// The state of all baselines, for all trains.
#[derive(Debug, Clone, Default)]
pub struct Baselines {
    steps: BTreeMap<(TrainId, SpeedStep), StepSpeed>,
    hops: BTreeMap<(TrainId, SpeedStep, HopId, NodeId), TimeSpan>,
    /// The time of the last report in the current run.
    last_report: Option<Timestamp>,
}

/// The speed of a step of a train.
#[derive(Debug, Clone)]
enum StepSpeed {
    /// During the first lap: distance and time so far, and the hops run over.
    FirstLap { distance: Length, time: TimeSpan, met: Vec<(HopId, NodeId)> },
    /// After the first lap.
    Known { table: Speed, slow: ShiftAverage, middle: Speed, fast: Speed },
}

impl Baselines {
    /// Begins a run.
    pub fn begin_run(&mut self) {
        self.last_report = None;
    }

    /// Ends a run of a train: an incomplete first lap counts as it is.
    pub fn end_run(&mut self, train: TrainId) {
        for (_, speed) in
            self.steps.range_mut((train, SpeedStep::STAND)..).take_while(|(key, _)| key.0 == train)
        {
            speed.end_lap();
        }
    }

    /// Returns the forecasts of all baselines for a passage, in the order of [`BASELINES`], and then learns from it.
    pub fn take(&mut self, train: TrainId, hit: &Hit) -> [Option<Timestamp>; BASELINES.len()] {
        let passage = &hit.passage;
        let now = passage.window.until;
        let last = self.last_report.replace(now);
        let (Some(last), Some(path)) = (last, passage.path) else { return [None; BASELINES.len()] };
        let Some(hop) = path.hops().first().map(|first| (*first, path.to)) else {
            return [None; BASELINES.len()];
        };
        let step = passage.drive.step;
        let lap_key = (train, step, hop.0, hop.1);
        let step_speed = self.steps.entry((train, step)).or_insert(StepSpeed::FirstLap {
            distance: Length::ZERO,
            time: TimeSpan::ZERO,
            met: Vec::new(),
        });
        step_speed.end_lap_if_met(hop);
        let [table, slow, middle, fast] = step_speed.speeds().map(|speed| arrival(last, &path, speed?));
        let lap = self.hops.get(&lap_key).map(|took| last + *took);
        if is_settled(hit) {
            step_speed.learn(hop, path.length, now - last);
            self.hops.insert(lap_key, now - last);
        }
        [table, slow, middle, fast, lap]
    }
}

/// Whether our estimator considers the hop as run at a steady speed.
fn is_settled(hit: &Hit) -> bool {
    let learnt = matches!(hit.verdict, Verdict::Learnt | Verdict::Reopened);
    learnt && hit.forecast.is_none_or(|forecast| forecast.phase != ForecastPhase::Change)
}

fn arrival(last: Timestamp, path: &Reach, speed: Speed) -> Option<Timestamp> {
    (speed.as_mm_per_s() > 0.0).then(|| last + path.length / speed)
}

impl StepSpeed {
    /// Table, slow, middle and fast average.
    fn speeds(&self) -> [Option<Speed>; 4] {
        match self {
            Self::FirstLap { .. } => [None; 4],
            Self::Known { table, slow, middle, fast } => {
                let slow = slow.mean().map(|units| Speed::from_mm_per_s(units as f64 / UNITS_PER_MM_PER_S));
                [Some(*table), slow, Some(*middle), Some(*fast)]
            }
        }
    }

    fn learn(&mut self, hop: (HopId, NodeId), length: Length, took: TimeSpan) {
        if took <= TimeSpan::ZERO {
            return;
        }
        let speed = length / took;
        match self {
            Self::FirstLap { distance, time, met } => {
                *distance += length;
                *time += took;
                met.push(hop);
            }
            Self::Known { slow, middle, fast, .. } => {
                slow.take(units(speed));
                *middle += (speed - *middle) * MIDDLE_ALPHA;
                *fast += (speed - *fast) * FAST_ALPHA;
            }
        }
    }

    /// Ends the first lap when a hop repeats.
    fn end_lap_if_met(&mut self, hop: (HopId, NodeId)) {
        if let Self::FirstLap { met, .. } = self
            && met.contains(&hop)
        {
            self.end_lap();
        }
    }

    fn end_lap(&mut self) {
        if let Self::FirstLap { distance, time, .. } = self
            && *time > TimeSpan::ZERO
        {
            // The mean speed follows from the total time, not from the mean of speeds.
            let table = *distance / *time;
            let mut slow = ShiftAverage::new(SLOW_SHIFT);
            slow.take(units(table));
            *self = Self::Known { table, slow, middle: table, fast: table };
        }
    }
}

fn units(speed: Speed) -> i64 {
    (speed.as_mm_per_s() * UNITS_PER_MM_PER_S).round() as i64
}
