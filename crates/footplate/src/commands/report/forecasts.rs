//! The forecasts of one train along its recordings, each walked from nothing known and never looking ahead.

use footplate_core::TrainId;
use footplate_core::model::Passage;
use footplate_core::track::Layout;
use footplate_core::tracking::{ForecastPhase, Predictor};
use footplate_store::Run;
use footplate_store::score::{ReplayContext, replay_run};

use super::Session;
use super::data::ForecastPoint;

/// The level of the interval that is shown.
const LEVEL: f64 = 0.9;

pub(super) fn of_train(
    layout: &Layout,
    sessions: &[Session],
    train: TrainId,
) -> anyhow::Result<Vec<ForecastPoint>> {
    let context = ReplayContext { layout, turnouts: &[] };
    let mut points = Vec::new();
    for session in sessions {
        let mut predictor = Predictor::new(layout);
        let is_own = |run: &&Run| run.reported_train().is_some_and(|reported| reported.train == train);
        let own = session.runs.iter().filter(is_own);
        for run in own {
            replay_run(context, run, &mut predictor, |raw, hit, _| {
                let Passage { sensor, drive, path, window, .. } = &hit.passage;
                let late = hit.forecast.map(|forecast| forecast.detection_error(window.until));
                let half = hit.forecast.map(|forecast| forecast.spread.half_width(LEVEL));
                let speed = hit.forecast.map(|forecast| forecast.speed.as_mm_per_s());
                let phase = hit.forecast.map(|forecast| match forecast.phase {
                    ForecastPhase::Steady => "steady",
                    ForecastPhase::FirstLap => "first_lap",
                    ForecastPhase::Change => "change",
                });
                points.push(ForecastPoint {
                    recording: session.name.clone(),
                    run: run.id.0,
                    line: raw.line,
                    sensor: layout.sensor_name(*sensor).to_owned(),
                    step: drive.step.get(),
                    phase,
                    missed: path.as_ref().map_or(0, footplate_core::track::Reach::missed),
                    drift: hit.drift.is_some(),
                    late_ms: late.map(footplate_core::TimeSpan::as_ms),
                    half_90_ms: half.map(|half| 1e3 * half),
                    late_mm: late.zip(speed).map(|(late, speed)| late.as_s() * speed),
                    half_90_mm: half.zip(speed).map(|(half, speed)| half * speed),
                });
            })?;
        }
    }
    Ok(points)
}
