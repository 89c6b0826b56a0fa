//! Two forecasters that know the whole recording in advance: the gain that faster learning could still bring.
//!
//! The recording is walked once to learn the motion model of each train with path lengths, the scatter of sensors and
//! the polling. The first and the last report of every stretch at steady speed give the mean speed of that stretch.
//! These values are then treated as exact:
//! - the *oracle* is our own estimator, which walks the recording again with all of them. Its remaining errors are the
//!   poll, the scatter of detections and speed changes within a run;
//! - the *hindsight table* forecasts the report at `last report + length / speed`, as tables do, but with the path
//!   length of the section and the speed of the run itself.
//!
//! Both are fitted to the detections that they forecast, so that short recordings flatter them: a run of ten detections
//! has one speed and a part of ten lengths of its own.

use footplate_core::model::Drive;
use footplate_core::model::MotionModel;
use footplate_core::model::survey::SectionIndex;
use footplate_core::track::Layout;
use footplate_core::tracking::{ForecastPhase, Hit, Predictor, TrainForecaster};
use footplate_core::{Length, Speed, SpeedStep, TimeSpan, Timestamp};

use super::replay::{ReplayContext, ReplayError, replay_run};
use crate::recording::Run;

/// The forecasts of a report in hindsight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Hindsight {
    /// By the oracle.
    pub(super) oracle: Option<Timestamp>,
    /// By the hindsight table.
    pub(super) table: Option<Timestamp>,
}

/// The forecasts in hindsight for each passage of each run, in order. `before` is the estimator before the recording.
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
        let model =
            run.reported_train().and_then(|ran| models.iter().find(|model| model.train() == ran.train));
        let mut times = model
            .map_or_else(Vec::new, |model| give_speeds(context.layout, &mut predictor, model.clone(), hits));
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

/// Gives a train the true mean speeds of one run; returns the forecasts of a table with them.
fn give_speeds(
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

/// Groups consecutive passages at a steady speed under one command; every passage is in one group.
fn stretches(hits: &[Hit]) -> impl Iterator<Item = &[Hit]> {
    hits.chunk_by(|one, next| one.passage.drive == next.passage.drive && is_steady(next))
}

/// Whether the train ran at a steady speed from the sensor before.
fn is_steady(hit: &Hit) -> bool {
    let is_steady = hit.forecast.is_none_or(|forecast| forecast.phase != ForecastPhase::Change);
    is_steady && hit.passage.path.is_some()
}

/// Distance over time from the first to the last passage of a group.
fn mean_speed(stretch: &[Hit], length: impl Fn(&Hit) -> Length) -> Option<(Drive, Speed)> {
    let [first, rest @ ..] = stretch else { return None };
    let last = rest.last()?;
    let drive = last.passage.drive;
    let distance: Length = rest.iter().map(length).sum();
    let time = last.passage.window.middle() - first.passage.window.middle();
    let is_running = drive.step != SpeedStep::STAND && time > TimeSpan::ZERO && distance > Length::ZERO;
    is_running.then(|| (drive, distance / time))
}

/// The path length before a passage, as learnt from the whole recording.
fn length(layout: &Layout, hit: &Hit, sections: &SectionIndex, model: &MotionModel) -> Length {
    let Some(path) = hit.passage.path else { return Length::ZERO };
    let hops = path.hops().iter().filter_map(|hop| layout.hop(*hop));
    hops.map(|hop| model.length(sections, &hop)[0]).sum()
}
