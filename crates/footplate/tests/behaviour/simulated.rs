//! Simulated recordings of trains drawn from seeds that nothing was tuned on.

use footplate_core::calibration::{Calibration, RunPassages, SectionIndex};
use footplate_core::estimation::Predictor;
use footplate_core::track::Layout;
use footplate_core::{Timestamp, TrainId};
use footplate_sim::{LawFamily, Railway, Scenario, SimulatedRecording};

pub(crate) const TRAIN: TrainId = TrainId(9);
/// Seeds of the tests; tuning used those around 1000.
const FIRST_SEED: u64 = 7100;

/// A recording of a train of each law and seed in a scenario, with the railway it ran on.
pub(crate) fn for_each(
    layout: &Layout,
    scenario: &str,
    seeds: u64,
    mut test: impl FnMut(&Railway<'_>, &SimulatedRecording),
) {
    let scenario = Scenario::named(scenario).expect("a scenario of that name");
    for seed in FIRST_SEED..FIRST_SEED + seeds {
        let railway = Railway::draw(layout, seed).expect("trains can run round on track A");
        for law in LawFamily::ALL {
            test(&railway, &SimulatedRecording::draw(&railway, scenario, TRAIN, law, seed));
        }
    }
}

/// A predictor that has walked all runs, event by event.
pub(crate) fn walked(layout: &Layout, recording: &SimulatedRecording) -> Predictor {
    let mut predictor = Predictor::new(layout);
    for run in &recording.runs {
        predictor.begin_run(TRAIN, run.running_at);
        for event in &run.events {
            predictor.take(layout, event);
        }
    }
    predictor.end_run();
    predictor
}

/// The batch fit of all runs.
pub(crate) fn fitted(
    layout: &Layout,
    sections: &SectionIndex,
    recording: &SimulatedRecording,
    walked: &Predictor,
) -> Calibration {
    let mut timing = walked.timing().clone();
    timing.fit(Timestamp::ZERO);
    let passages: Vec<RunPassages> = recording
        .runs
        .iter()
        .enumerate()
        .map(|(place, run)| {
            let events = run.events.iter().map(|event| (event, false));
            RunPassages::read(layout, TRAIN, run.running_at, place, events, &timing)
        })
        .collect();
    Calibration::of(layout, sections, &passages).expect("runs at a settled speed")
}
