//! `footplate simulate` writes logs that read back as what happened, and a truth for every line of them.

use std::fs;
use std::path::{Path, PathBuf};

use footplate_core::{EventKind, SensorId};
use footplate_store::{LogContext, Recording, built_in, read_sensor_log};

use crate::program::{Run, footplate};

/// A folder of this test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    folder
}

fn simulate(folder: &Path, more: &[&str]) -> Run {
    let out = folder.to_str().expect("a folder with a plain name");
    footplate(&[&["simulate", "layout", "--out", out], more].concat())
}

fn read(path: &Path) -> Recording {
    let layout = built_in("track-a").unwrap().layout;
    read_sensor_log(path, LogContext { sensors: &layout, train: None }).unwrap()
}

#[test]
fn the_same_seed_writes_the_same_bytes_and_another_seed_another_world() {
    let folders = ["simulate-once", "simulate-again", "simulate-other"].map(folder);
    for (folder, seed) in folders.iter().zip(["7", "7", "8"]) {
        let run = simulate(folder, &["--scenario", "short-moves", "--seed", seed]);
        assert_eq!((run.status, run.errors.as_str()), (0, ""));
    }
    for name in ["train-1.csv", "train-1-truth.csv", "train-1-truth.json"] {
        let [once, again, other] = folders.each_ref().map(|folder| fs::read(folder.join(name)).unwrap());
        assert!(once == again, "{name} differs");
        assert!(once != other, "{name} does not depend on the seed");
    }
}

#[test]
fn every_line_of_the_log_that_needs_one_has_a_truth() {
    let folder = folder("simulate-truth");
    let run = simulate(&folder, &["--scenario", "stops", "--trains", "2", "--law", "lag"]);
    assert_eq!((run.status, run.errors.as_str()), (0, ""));
    assert_eq!(run.output.matches("law lag").count(), 2, "{}", run.output);
    for train in ["train-1", "train-2"] {
        let recording = read(&folder.join(format!("{train}.csv")));
        assert!(recording.notes.is_empty(), "{:?}", recording.notes);
        let layout = built_in("track-a").unwrap().layout;
        let name = |sensor: SensorId| layout.sensor_name(sensor).to_owned();
        let mut wanted = Vec::new();
        for run in &recording.runs {
            for raw in &run.events {
                wanted.extend(match raw.event.kind {
                    EventKind::Sensor(report) => Some(("report", name(report.sensor))),
                    EventKind::Speed { step, .. } => Some(("command", step.to_string())),
                    EventKind::Stopped { landmark, .. } => Some(("stopped", name(landmark))),
                    EventKind::Freed(_) | EventKind::Turnout { .. } | EventKind::Reverse { .. } => None,
                });
            }
        }
        let truth = fs::read_to_string(folder.join(format!("{train}-truth.csv"))).unwrap();
        let rows = truth.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
        let found: Vec<(&str, String)> =
            rows.filter(|row| row[2] != "motion").map(|row| (row[2], row[3].to_owned())).collect();
        assert_eq!(found, wanted);
    }
}

#[test]
fn light_gates_and_a_train_that_is_already_running_are_in_the_log() {
    let folder = folder("simulate-gates");
    simulate(&folder, &["--scenario", "gates", "--json"]);
    let recording = read(&folder.join("train-1.csv"));
    assert!(recording.runs.iter().all(|run| run.gates.len() >= 2));
    let steps: Vec<u8> = recording.runs.iter().map(|run| run.only_train().unwrap().step.get()).collect();
    assert_eq!(steps, [14, 11, 8, 14, 11, 8, 14, 11, 8]);
}

#[test]
fn the_list_names_every_scenario_and_a_wrong_name_is_told_them() {
    let list = footplate(&["simulate", "--list"]);
    assert_eq!(list.status, 0);
    let wrong = simulate(&folder("simulate-wrong"), &["--scenario", "departure"]);
    assert_eq!(wrong.status, 2);
    for name in ["starts", "stops", "driving"] {
        assert!(list.output.contains(name) && wrong.errors.contains(name), "{name} is not named");
    }
}
