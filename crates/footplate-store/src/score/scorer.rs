//! Walks a recording once with everybody side by side.

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

/// What is known before a recording, and after it.
#[derive(Debug, Clone)]
pub struct Knowledge {
    /// By our estimator.
    pub predictor: Predictor,
    /// By the baselines.
    pub baselines: Baselines,
}

impl Knowledge {
    /// Of trains nothing, of the railway its layout.
    #[must_use]
    pub fn of_layout(layout: &Layout) -> Self {
        Self { predictor: Predictor::new(layout), baselines: Baselines::default() }
    }
}

/// A recording with its scores.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoredRecording {
    /// What the recording is called.
    pub name: String,
    /// Runs that were walked.
    pub runs: usize,
    /// Every passage of a contact, in order.
    pub hits: Vec<ScoredHit>,
    /// Every pair of gate passes that an estimate stands beside.
    pub gates: Vec<GateCheck>,
}

impl ScoredRecording {
    /// The trains that ran, in the order of their numbers.
    #[must_use]
    pub fn trains(&self) -> Vec<TrainId> {
        let mut trains: Vec<TrainId> = self.hits.iter().map(|hit| hit.train).collect();
        trains.sort_unstable();
        trains.dedup();
        trains
    }

    /// The figures over all of it.
    #[must_use]
    pub fn comparison(&self) -> Comparison {
        Comparison::of(self.hits.iter())
    }
}

/// Scores a recording, or the runs of one train in it, and leaves `knowledge` with what it taught.
///
/// # Errors
/// [`ReplayError`] for the first run that cannot be walked; `knowledge` is then as it was after the run before.
pub fn score_recording(
    context: ReplayContext<'_>,
    recording: &Recording,
    only: Option<TrainId>,
    knowledge: &mut Knowledge,
) -> Result<ScoredRecording, ReplayError> {
    let wanted = |run: &&Run| only.is_none() || run.only_train().is_none_or(|run| Some(run.train) == only);
    let runs: Vec<&Run> = recording.runs.iter().filter(wanted).collect();
    let expected = hindsight(context, &runs, &knowledge.predictor)?;
    let mut scored = ScoredRecording {
        name: recording.name.clone(),
        runs: runs.len(),
        hits: Vec::new(),
        gates: Vec::new(),
    };
    for (run, hindsight) in runs.into_iter().zip(expected) {
        score_run(context, run, &hindsight, knowledge, &mut scored)?;
    }
    Ok(scored)
}

fn score_run(
    context: ReplayContext<'_>,
    run: &Run,
    hindsight: &[Hindsight],
    knowledge: &mut Knowledge,
    scored: &mut ScoredRecording,
) -> Result<(), ReplayError> {
    let Knowledge { predictor, baselines } = knowledge;
    let Some(at_start) = run.only_train() else { return Ok(()) };
    let train = at_start.train;
    let (mut laps, mut hindsight) = (LapSpeeds::default(), hindsight.iter());
    baselines.begin_run();
    replay_run(context, run, predictor, |raw, hit, predictor| {
        let [table, slow, middle, fast, lap] = baselines.take(train, &hit);
        let Hindsight { oracle, table: hindsight_table } = hindsight.next().copied().unwrap_or_default();
        let at_poll = hit.forecast.map(|forecast| forecast.report);
        let rivals = [at_poll, oracle, hindsight_table, table, slow, middle, fast, lap];
        scored.hits.push(ScoredHit { run: run.id, line: raw.line, train, hit, rivals });
        let speed = predictor.train(train).and_then(TrainForecaster::running_speed);
        laps.take(hit.passage.node, speed);
    })?;
    baselines.end_run(train);
    scored.gates.extend(laps.checks(run, train, at_start.step));
    Ok(())
}
