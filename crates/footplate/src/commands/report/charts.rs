//! Curves for charts: changes of speed under their law, and stopping distance by speed.

use footplate_core::model::report::Transient;
use footplate_core::{Approach, SpeedStep, TimeSpan};
use footplate_store::{Batch, BatchTrain, TrainFindings};

use super::data::{ChangeChart, DetectionPoint};

/// Changes shown for each direction, spread over the steps there are.
const SHOWN: usize = 4;
/// Points of a curve (chosen: one every few pixels).
const SAMPLES: usize = 160;

pub(super) fn changes(batch: &Batch, train: &BatchTrain) -> Vec<ChangeChart> {
    let mut own: Vec<&Transient> = train.review.changes.iter().collect();
    own.sort_by_key(|change| (change.direction(), change.steps, change.run));
    let directions = own.chunk_by(|one, next| one.direction() == next.direction());
    directions.flat_map(spread_out).filter_map(|change| chart(batch, train, change)).collect()
}

/// The first, the last, and some between them at equal distances.
fn spread_out<'a>(changes: &[&'a Transient]) -> Vec<&'a Transient> {
    let shown = changes.len().min(SHOWN);
    let place = |number: usize| number * (changes.len() - 1) / shown.saturating_sub(1).max(1);
    (0..shown).filter_map(|number| changes.get(place(number)).copied()).collect()
}

fn chart(batch: &Batch, train: &BatchTrain, change: &Transient) -> Option<ChangeChart> {
    let ends = change.points.iter().map(|point| point.since_command).fold(0.0, f64::max);
    let begins = change.points.iter().map(|point| point.since_command).fold(0.0, f64::min);
    let times: Vec<TimeSpan> = (0..=SAMPLES)
        .map(|number| TimeSpan::from_s(begins + (ends - begins) * number as f64 / SAMPLES as f64))
        .collect();
    let fit = |times: &[TimeSpan]| train.review.fitted_change(train.replay.fit.model(), change, times);
    let fitted = fit(&times)?;
    let at_sensors: Vec<TimeSpan> =
        change.points.iter().map(|point| TimeSpan::from_s(point.since_command)).collect();
    let there = fit(&at_sensors)?;
    let run = batch.runs.get(change.run)?;
    let mut before: Option<(f64, f64)> = None;
    let mut contacts = Vec::with_capacity(change.points.len());
    for ((point, residual), state) in change.points.iter().zip(&fitted.residuals).zip(&there.states) {
        let way_mm = 1e3 * point.distance;
        let mean_speed = before.and_then(|(time, distance_mm)| {
            let took = point.since_command - time;
            (took > 0.0).then(|| [f64::midpoint(time, point.since_command), (way_mm - distance_mm) / took])
        });
        before = Some((point.since_command, way_mm));
        let speed = state.speed.as_m_per_s();
        contacts.push(DetectionPoint {
            time_s: point.since_command,
            doubt_s: point.variance.sqrt(),
            way_mm,
            residual_mm: residual.as_mm(),
            doubt_mm: 1e3
                * (speed * speed * point.variance + change.distance_deviation * change.distance_deviation)
                    .sqrt(),
            mean_speed,
            told_by: batch
                .event(change.run, point.entry)
                .map_or_else(String::new, |event| format!("{}:{}", run.recording, event.line)),
        });
    }
    Some(ChangeChart {
        steps: change.steps.map(SpeedStep::get),
        recording: run.recording.clone(),
        run: run.id.0,
        time_s: times.iter().map(|time| time.as_s()).collect(),
        way_mm: fitted.states.iter().map(|state| state.distance.as_mm()).collect(),
        speed_mm_s: fitted.states.iter().map(|state| state.speed.as_mm_per_s()).collect(),
        acceleration_mm_s2: fitted.states.iter().map(|state| state.acceleration.as_mm_per_s2()).collect(),
        contacts,
    })
}

/// Speed and stopping distance of the motion model at every step that was measured, from standstill on.
pub(super) fn stop_curve(train: &TrainFindings) -> Vec<[f64; 2]> {
    let steps = train.steps.iter().filter(|step| step.is_measured() && step.approach == Approach::Below);
    let mut curve: Vec<[f64; 2]> = steps.map(|step| [step.speed.value, step.stop.value]).collect();
    curve.push([0.0, 0.0]);
    curve.sort_by(|one, other| one[0].total_cmp(&other[0]));
    curve
}
