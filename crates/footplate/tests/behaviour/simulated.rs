//! Simulated recordings of trains drawn from seeds that nothing was tuned on.

use footplate_core::track::Layout;
use footplate_core::{Event, RunId, TrainId};
use footplate_sim::{LawFamily, Railway, Scenario, SimulatedRecording, SimulatedRun};
use footplate_store::{Batch, Form, RawEvent, Recording, Run, TrainAtStart};

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

/// What recordings of one train teach.
pub(crate) fn batch_of(layout: &Layout, recording: &SimulatedRecording) -> Batch {
    let raw = |event: &Event| RawEvent { line: 0, event: *event };
    let run = |(number, run): (usize, &SimulatedRun)| Run {
        id: RunId(number as u32),
        began_at: None,
        trains: vec![TrainAtStart { train: TRAIN, step: run.running_at }],
        events: run.events.iter().map(raw).collect(),
        gates: Vec::new(),
    };
    let recording = Recording {
        name: "simulated".to_owned(),
        form: Form::SensorLog,
        runs: recording.runs.iter().enumerate().map(run).collect(),
        notes: Vec::new(),
    };
    Batch::of_recordings(layout, &[recording], None).expect("runs at a settled speed")
}
