//! Two forecasters that know the whole recording beforehand: what is left to gain by learning faster.
//!
//! The recording is walked once to learn section lengths, laws of speed change, the scatter of contacts and the
//! rhythm of the polls; its end, and the first and the last report of every stretch at a settled speed, give the
//! mean speed of that stretch. What was found is then taken for certain:
//! - the *oracle* is our own estimator, walking the recording again with all of that. What it still misses is
//!   the poll, the scatter of contacts and what one speed a run does not explain;
//! - the *hindsight table* expects the report at `last report + length / speed`, as tables do, but with the
//!   length of the section and the speed of the run itself.
//!
//! Both are fitted to the very hits that they forecast, so short recordings flatter them: a run of ten hits has
//! one speed and a part of ten lengths of its own.

use footplate_core::calibration::{Direction, Drive, LengthTable, SectionIndex};
use footplate_core::estimation::{Hit, Phase, Predictor, TrainModel};
use footplate_core::{Estimate, Length, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::replay::{ReplayContext, ReplayError, replay_run};
use crate::recording::Run;

/// How many runs the certainty is worth that a run has exactly its speed: more than there ever are.
const CERTAIN: f64 = 1e9;
/// The least uncertainty of a mean speed, as a part of it: far below the wander of any run.
const LEAST_PART: f64 = 1e-4;

/// When a report was to be expected, in hindsight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Hindsight {
    /// By the oracle.
    pub(super) oracle: Option<Timestamp>,
    /// By the hindsight table.
    pub(super) table: Option<Timestamp>,
}

/// What each passage of each run was to be expected at, in order. `before` is the estimator as it was.
pub(super) fn hindsight(
    context: ReplayContext<'_>,
    runs: &[&Run],
    before: &Predictor,
) -> Result<Vec<Vec<Hindsight>>, ReplayError> {
    let mut predictor = before.clone();
    let mut walks = Vec::new();
    for run in runs {
        let mut hits = Vec::new();
        replay_run(context, run, &mut predictor, |_, hit, _| hits.push(hit))?;
        walks.push(hits);
    }
    let trains: Vec<TrainId> = predictor.trains().map(TrainModel::train).collect();
    trains.into_iter().for_each(|train| make_certain(&mut predictor, train));
    let mut expected = Vec::new();
    for (run, hits) in runs.iter().zip(&walks) {
        let mut times =
            run.only_train().map_or_else(Vec::new, |ran| tell_speeds(&mut predictor, ran.train, hits));
        let mut place = times.iter_mut();
        replay_run(context, run, &mut predictor, |_, hit, _| {
            if let Some(time) = place.next() {
                time.oracle = hit.forecast.map(|forecast| forecast.time);
            }
        })?;
        expected.push(times);
    }
    Ok(expected)
}

/// Lengths and laws are as the first walk left them.
fn make_certain(predictor: &mut Predictor, train: TrainId) {
    let sections = predictor.sections().len();
    let Some(model) = predictor.train_mut(train) else { return };
    let lengths = model.lengths_mut();
    for section in 0..sections {
        if let Some((by, _)) = lengths.get(section) {
            lengths.set(section, by, 0.0);
        }
    }
    for direction in [Direction::Up, Direction::Down] {
        for law in model.laws_mut().laws_mut(direction) {
            law.covariance = [[0.0; 2]; 2];
        }
    }
    model.speeds_mut().set_run_deviation(0.0, CERTAIN);
}

/// Tells the train the speeds of one run, and says what a table with them expects.
fn tell_speeds(predictor: &mut Predictor, train: TrainId, hits: &[Hit]) -> Vec<Hindsight> {
    let sections = predictor.sections().clone();
    let Some(model) = predictor.train_mut(train) else { return Vec::new() };
    let lengths = model.lengths().clone();
    let mut times = Vec::new();
    for stretch in stretches(hits) {
        times.push(Hindsight::default());
        let mean = mean_speed(stretch, &sections, &lengths);
        if let Some((drive, speed)) = mean {
            model.speeds_mut().set(drive.step, drive.approach(), speed);
        }
        times.extend(stretch.windows(2).map(|pair| {
            let [from, to] = pair else { return Hindsight::default() };
            let arrival = |speed: Speed| from.passage.window.until + length(to, &sections, &lengths) / speed;
            Hindsight { oracle: None, table: mean.map(|(_, speed)| arrival(speed.value)) }
        }));
    }
    times
}

/// The passages that follow one another at a settled speed under one command; every passage is in one stretch.
fn stretches(hits: &[Hit]) -> impl Iterator<Item = &[Hit]> {
    hits.chunk_by(|one, next| one.passage.drive == next.passage.drive && runs_on(next))
}

/// Whether the train came to a contact from the one before at a settled speed.
fn runs_on(hit: &Hit) -> bool {
    let settled = hit.forecast.is_none_or(|forecast| forecast.phase != Phase::Change);
    settled && hit.passage.way.is_some()
}

/// Way over time from the first to the last passage of a stretch.
fn mean_speed(
    stretch: &[Hit],
    sections: &SectionIndex,
    lengths: &LengthTable,
) -> Option<(Drive, Estimate<Speed>)> {
    let [first, rest @ ..] = stretch else { return None };
    let last = rest.last()?;
    let drive = last.passage.drive;
    let way: Length = rest.iter().map(|hit| length(hit, sections, lengths)).sum();
    let (from, to) = (first.passage.window, last.passage.window);
    let time = to.middle() - from.middle();
    if drive.step == SpeedStep::STAND || time <= TimeSpan::ZERO || way <= Length::ZERO {
        return None;
    }
    let value = way / time;
    let part = (from.variance_s2() + to.variance_s2()).sqrt() / time.as_s();
    let uncertainty = value * part.max(LEAST_PART);
    Some((drive, Estimate { value, uncertainty, count: rest.len() as u32, date: to.until }))
}

/// The way that led to a passage as the train knows it in the end.
fn length(hit: &Hit, sections: &SectionIndex, lengths: &LengthTable) -> Length {
    let Some(way) = hit.passage.way else { return Length::ZERO };
    let corrections = way.hops().iter().filter_map(|hop| lengths.get(sections.section(*hop)?));
    way.length + Length::from_m(corrections.map(|(by, _)| by).sum())
}
