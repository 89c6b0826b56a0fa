//! What courses and clubs use to expect the next report, on the same hits: a constant table, running averages
//! of the speed of a step, and the last lap.
//!
//! Each expects the report at `last report + length / speed`, with the length of the survey, whatever the train
//! does on the way; the last lap expects it after the time that the same hop took last. They learn from the
//! hops that our estimator takes for run at a settled speed and does not reject, and their speeds begin with
//! the mean of the first lap: all to their advantage.

use std::collections::BTreeMap;

use super::shift_average::ShiftAverage;
use footplate_core::track::{HopId, Reach};
use footplate_core::tracking::{Hit, Phase, Verdict};
use footplate_core::{Length, NodeId, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::rival::BASELINES;

/// α = 2⁻⁸ = 1/256 of the slow average.
const SLOW_SHIFT: u32 = 8;
/// α of the plain averages.
const MIDDLE_ALPHA: f64 = 0.1;
const FAST_ALPHA: f64 = 0.5;
/// The slow average counts in whole micrometres a second: 3 ppm of a crawl.
const UNITS_PER_MM_PER_S: f64 = 1e3;

/// Everything that the baselines know, of all trains.
#[derive(Debug, Clone, Default)]
pub struct Baselines {
    steps: BTreeMap<(TrainId, SpeedStep), StepSpeed>,
    hops: BTreeMap<(TrainId, SpeedStep, HopId, NodeId), TimeSpan>,
    /// When the passage before was reported, in the run under way.
    last_report: Option<Timestamp>,
}

/// The speed of a step of a train.
#[derive(Debug, Clone)]
enum StepSpeed {
    /// The first lap is being run: the way so far, the time it took, and the hops met.
    FirstLap { way: Length, time: TimeSpan, met: Vec<(HopId, NodeId)> },
    /// It is over.
    Known { table: Speed, slow: ShiftAverage, middle: Speed, fast: Speed },
}

impl Baselines {
    /// A run begins.
    pub fn begin_run(&mut self) {
        self.last_report = None;
    }

    /// A run of a train is over: laps that it did not finish count as they are.
    pub fn end_run(&mut self, train: TrainId) {
        for (_, speed) in
            self.steps.range_mut((train, SpeedStep::STAND)..).take_while(|(key, _)| key.0 == train)
        {
            speed.end_lap();
        }
    }

    /// A passage: when each baseline expected its report, in the order of [`BASELINES`]; then they learn.
    pub fn take(&mut self, train: TrainId, hit: &Hit) -> [Option<Timestamp>; BASELINES.len()] {
        let passage = &hit.passage;
        let now = passage.window.until;
        let last = self.last_report.replace(now);
        let (Some(last), Some(way)) = (last, passage.way) else { return [None; BASELINES.len()] };
        let Some(hop) = way.hops().first().map(|first| (*first, way.to)) else {
            return [None; BASELINES.len()];
        };
        let step = passage.drive.step;
        let lap_key = (train, step, hop.0, hop.1);
        let step_speed = self.steps.entry((train, step)).or_insert(StepSpeed::FirstLap {
            way: Length::ZERO,
            time: TimeSpan::ZERO,
            met: Vec::new(),
        });
        step_speed.end_lap_if_met(hop);
        let [table, slow, middle, fast] = step_speed.speeds().map(|speed| arrival(last, &way, speed?));
        let lap = self.hops.get(&lap_key).map(|took| last + *took);
        if is_settled(hit) {
            step_speed.learn(hop, way.length, now - last);
            self.hops.insert(lap_key, now - last);
        }
        [table, slow, middle, fast, lap]
    }
}

/// Whether a hop was run at a settled speed, as our estimator saw it.
fn is_settled(hit: &Hit) -> bool {
    let learnt = matches!(hit.verdict, Verdict::Learnt | Verdict::Reopened);
    learnt && hit.forecast.is_none_or(|forecast| forecast.phase != Phase::Change)
}

fn arrival(last: Timestamp, way: &Reach, speed: Speed) -> Option<Timestamp> {
    (speed.as_mm_per_s() > 0.0).then(|| last + way.length / speed)
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
            Self::FirstLap { way, time, met } => {
                *way += length;
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

    /// A hop that was met before begins the second lap.
    fn end_lap_if_met(&mut self, hop: (HopId, NodeId)) {
        if let Self::FirstLap { met, .. } = self
            && met.contains(&hop)
        {
            self.end_lap();
        }
    }

    fn end_lap(&mut self) {
        if let Self::FirstLap { way, time, .. } = self
            && *time > TimeSpan::ZERO
        {
            // Average the times, then divide.
            let table = *way / *time;
            let mut slow = ShiftAverage::new(SLOW_SHIFT);
            slow.take(units(table));
            *self = Self::Known { table, slow, middle: table, fast: table };
        }
    }
}

fn units(speed: Speed) -> i64 {
    (speed.as_mm_per_s() * UNITS_PER_MM_PER_S).round() as i64
}
