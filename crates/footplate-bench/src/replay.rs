//! Replaying recorded sensor logs through the full estimator, intervals scored at every hit.
//!
//! One run is one event. The recordings are the real ones of `testdata/sensor-logs`, over and over: seven events
//! in ten are repeats of a contact, one in twenty a hit while the speed changes, which costs most.

use std::path::{Path, PathBuf};

use footplate_core::estimation::Predictor;
use footplate_core::track::Layout;
use footplate_core::{Event, SpeedStep, TrainId};
use footplate_store::{LogContext, layout_named, read_sensor_log};

use crate::operation::Operation;

struct Run {
    train: TrainId,
    step: SpeedStep,
    events: Vec<Event>,
}

/// The operations of this subject; none where the recordings are not to be found.
#[must_use]
pub fn operations() -> Vec<Operation> {
    let Ok(layout) = layout_named("track-a") else { return Vec::new() };
    let layout = layout.layout;
    let runs = recorded(&layout);
    if runs.is_empty() {
        return Vec::new();
    }
    let mut predictor = Predictor::new(&layout);
    let mut walked = 0;
    vec![Operation::with_body(
        "replay a sensor log, an event",
        "full estimator, intervals scored",
        move |count| {
            let (mut left, mut sum) = (count, 0.0);
            while left > 0 {
                let run = &runs[walked % runs.len()];
                walked += 1;
                predictor.begin_run(run.train, run.step);
                for event in run.events.iter().take(left) {
                    if let Some(hit) = predictor.take(&layout, event) {
                        let report = hit.passage.window.until;
                        sum += hit.forecast.map_or(0.0, |forecast| forecast.probability_by(report));
                    }
                }
                left -= run.events.len().min(left);
            }
            sum
        },
    )]
}

fn recorded(layout: &Layout) -> Vec<Run> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/sensor-logs");
    let Ok(found) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut logs: Vec<PathBuf> = found.filter_map(|entry| Some(entry.ok()?.path())).collect();
    logs.retain(|path| path.extension().is_some_and(|ending| ending == "csv"));
    logs.sort();
    let context = LogContext { sensors: layout, train: None };
    let recordings = logs.iter().filter_map(|path| read_sensor_log(path, context).ok());
    recordings
        .flat_map(|recording| recording.runs)
        .filter(|run| !run.events.is_empty())
        .filter_map(|run| {
            let only = run.only_train()?;
            let events = run.events.iter().map(|raw| raw.event).collect();
            Some(Run { train: only.train, step: only.step, events })
        })
        .collect()
}
