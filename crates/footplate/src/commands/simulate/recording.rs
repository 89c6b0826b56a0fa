//! A simulated recording as a sensor log has it: what a program at a real railway would have written down, no more.

use footplate_core::RunId;
use footplate_sim::{SimulatedRecording, SimulatedRun};
use footplate_store::{Form, GatePass, RawEvent, Recording, Run, TrainAtStart};

/// The recording without its truth. There is no file yet, so that no event has a line.
pub(super) fn of(simulated: &SimulatedRecording, name: &str) -> Recording {
    let runs = (1..).zip(&simulated.runs).map(|(number, simulated)| run(RunId(number), simulated)).collect();
    Recording { name: name.to_owned(), form: Form::SensorLog, runs, notes: Vec::new() }
}

fn run(id: RunId, simulated: &SimulatedRun) -> Run {
    let line = 0;
    Run {
        id,
        began_at: None,
        trains: vec![TrainAtStart { train: simulated.train, step: simulated.running_at }],
        events: simulated.events.iter().map(|event| RawEvent { line, event: *event }).collect(),
        gates: simulated
            .gates
            .iter()
            .map(|pass| GatePass { line, gate: pass.gate, time: pass.time })
            .collect(),
    }
}
