//! Two forecasters that know the whole recording beforehand: what is left to gain by learning faster.
//!
//! The recording is walked once to learn the motion model of each train with the lengths of its sections, the scatter of
//! sensors and the rhythm of the polls; its end, and the first and the last report of every stretch at a settled speed, give
//! the mean speed of that stretch. What was found is then taken for certain:
//! - the *oracle* is our own estimator, walking the recording again with all of that. What it still misses is
//!   the poll, the scatter of contacts and what one speed a run does not explain;
//! - the *hindsight table* expects the report at `last report + length / speed`, as tables do, but with the
//!   length of the section and the speed of the run itself.
//!
//! Both are fitted to the very hits that they forecast, so short recordings flatter them: a run of ten hits has
//! one speed and a part of ten lengths of its own.

use footplate_core::model::Drive;
use footplate_core::model::MotionModel;
use footplate_core::model::survey::SectionIndex;
use footplate_core::track::Layout;
use footplate_core::tracking::{Hit, Phase, Predictor, TrainForecaster};
use footplate_core::{Length, Speed, SpeedStep, TimeSpan, Timestamp};

use super::replay::{ReplayContext, ReplayError, replay_run};
use crate::recording::Run;

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
    let models: Vec<MotionModel> =
        predictor.trains().map(TrainForecaster::model).map(MotionModel::taken_for_certain).collect();
    let mut expected = Vec::new();
    for (run, hits) in runs.iter().zip(&walks) {
        let model = run.only_train().and_then(|ran| models.iter().find(|model| model.train() == ran.train));
        let mut times = model
            .map_or_else(Vec::new, |model| tell_speeds(context.layout, &mut predictor, model.clone(), hits));
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

/// Tells a train the speeds of one run, and says what a table with them expects.
fn tell_speeds(
    layout: &Layout,
    predictor: &mut Predictor,
    mut model: MotionModel,
    hits: &[Hit],
) -> Vec<Hindsight> {
    let sections = predictor.sections().clone();
    let lengths = model.clone();
    let length = |hit: &Hit| length(layout, hit, &sections, &lengths);
    let mut times = Vec::new();
    for stretch in stretches(hits) {
        times.push(Hindsight::default());
        let mean = mean_speed(stretch, length);
        if let Some((drive, speed)) = mean {
            model.tell_speed(drive.step, drive.approach(), speed);
        }
        times.extend(stretch.windows(2).map(|pair| {
            let [from, to] = pair else { return Hindsight::default() };
            let table = mean.map(|(_, speed)| from.passage.window.until + length(to) / speed);
            Hindsight { oracle: None, table }
        }));
    }
    predictor.know(model);
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

/// Distance over time from the first to the last passage of a stretch.
fn mean_speed(stretch: &[Hit], length: impl Fn(&Hit) -> Length) -> Option<(Drive, Speed)> {
    let [first, rest @ ..] = stretch else { return None };
    let last = rest.last()?;
    let drive = last.passage.drive;
    let distance: Length = rest.iter().map(length).sum();
    let time = last.passage.window.middle() - first.passage.window.middle();
    let is_running = drive.step != SpeedStep::STAND && time > TimeSpan::ZERO && distance > Length::ZERO;
    is_running.then(|| (drive, distance / time))
}

/// The length of the path that led to a passage as the train knows it in the end.
fn length(layout: &Layout, hit: &Hit, sections: &SectionIndex, model: &MotionModel) -> Length {
    let Some(way) = hit.passage.way else { return Length::ZERO };
    let hops = way.hops().iter().filter_map(|hop| layout.hop(*hop));
    hops.map(|hop| model.length(sections, &hop)[0]).sum()
}
