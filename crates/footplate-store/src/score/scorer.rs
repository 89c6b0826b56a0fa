//! Scores a recording with all forecasters side by side.

use footplate_core::TrainId;
use footplate_core::track::Layout;
use footplate_core::tracking::{Predictor, TrainForecaster};

use super::baselines::Baselines;
use super::comparison::Comparison;
use super::gate_check::{GateCheck, LapSpeeds};
use super::oracle::{Hindsight, hindsight};
use super::replay::{ReplayContext, ReplayError, replay_run};
use super::scored_hit::ScoredHit;
use crate::recording::{Recording, Run};

/// The state of all forecasters before a recording, and after it.
#[derive(Debug, Clone)]
pub struct Forecasters {
    /// Our estimator.
    pub predictor: Predictor,
    /// The baselines.
    pub baselines: Baselines,
}

impl Forecasters {
    /// Forecasters that know the layout, but no train.
    pub fn of_layout(layout: &Layout) -> Self {
        Self { predictor: Predictor::new(layout), baselines: Baselines::default() }
    }
}

/// A recording with its scores.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoredRecording {
    /// The name of the recording.
    pub name: String,
    /// Runs that were scored.
    pub runs: usize,
    /// Every passage of a sensor, in order.
    pub hits: Vec<ScoredHit>,
    /// Every pair of gate passes with an estimate.
    pub gates: Vec<GateCheck>,
}

impl ScoredRecording {
    /// The trains that ran, by number.
    pub fn trains(&self) -> Vec<TrainId> {
        let mut trains: Vec<TrainId> = self.hits.iter().map(|hit| hit.train).collect();
        trains.sort_unstable();
        trains.dedup();
        trains
    }

    /// The comparison over all of it.
    pub fn comparison(&self) -> Comparison {
        Comparison::of(self.hits.iter())
    }
}

/// Scores a recording, or the runs of one train in it; afterwards `forecasters` have learnt from it.
///
/// # Errors
/// [`ReplayError`] for the first run that cannot be replayed; `forecasters` are then as after the run before.
pub fn score_recording(
    context: ReplayContext<'_>,
    recording: &Recording,
    only: Option<TrainId>,
    forecasters: &mut Forecasters,
) -> Result<ScoredRecording, ReplayError> {
    let wanted =
        |run: &&Run| only.is_none() || run.reported_train().is_none_or(|run| Some(run.train) == only);
    let runs: Vec<&Run> = recording.runs.iter().filter(wanted).collect();
    let expected = hindsight(context, &runs, &forecasters.predictor)?;
    let mut scored = ScoredRecording {
        name: recording.name.clone(),
        runs: runs.len(),
        hits: Vec::new(),
        gates: Vec::new(),
    };
    for (run, hindsight) in runs.into_iter().zip(expected) {
        score_run(context, run, &hindsight, forecasters, &mut scored)?;
    }
    Ok(scored)
}

fn score_run(
    context: ReplayContext<'_>,
    run: &Run,
    hindsight: &[Hindsight],
    forecasters: &mut Forecasters,
    scored: &mut ScoredRecording,
) -> Result<(), ReplayError> {
    let Forecasters { predictor, baselines } = forecasters;
    let Some(at_start) = run.reported_train() else { return Ok(()) };
    let train = at_start.train;
    let (mut laps, mut hindsight) = (LapSpeeds::default(), hindsight.iter());
    baselines.begin_run();
    replay_run(context, run, predictor, |raw, hit, predictor| {
        let [table, slow, middle, fast, lap] = baselines.take(train, &hit);
        let Hindsight { oracle, table: hindsight_table } = hindsight.next().copied().unwrap_or_default();
        let at_poll = hit.forecast.map(|forecast| forecast.report);
        let references = [at_poll, oracle, hindsight_table, table, slow, middle, fast, lap];
        scored.hits.push(ScoredHit { run: run.id, line: raw.line, train, hit, references });
        let speed = predictor.train(train).and_then(TrainForecaster::running_speed);
        laps.take(hit.passage.node, speed);
    })?;
    baselines.end_run(train);
    scored.gates.extend(laps.checks(run, train, at_start.step));
    Ok(())
}
