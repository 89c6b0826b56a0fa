//! `footplate calibrate --method two-sensor`: accelerations against simulated trains whose truth only the test reads, and bad
//! input.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::program::footplate;

/// Seeds of trains that nothing was tuned on.
const SEEDS: std::ops::Range<u32> = 7200..7212;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("two_sensor").join(name);
    fs::create_dir_all(&folder).expect("the test folder can be made");
    folder
}

/// A recording of a simulated train, and what is true of it.
fn simulated(scenario: &str, law: &str, seed: u32) -> (String, Value) {
    let folder = folder(&format!("{scenario}{seed}"));
    let (out, seed) = (folder.display().to_string(), seed.to_string());
    let simulate =
        ["simulate", "layout", "--scenario", scenario, "--law", law, "--seed", &seed, "--out", &out];
    let done = footplate(&simulate);
    assert_eq!(done.status, 0, "{}", done.errors);
    let truth =
        fs::read_to_string(folder.join("train-1-truth.json")).expect("the truth beside the recording");
    (folder.join("train-1.csv").display().to_string(), serde_json::from_str(&truth).expect("JSON"))
}

fn calibrated(recording: &str, more: &[&str]) -> crate::program::Run {
    let basic = ["calibrate", "--from", recording, "--layout", "track-a", "--method", "two-sensor"];
    footplate(&[&basic, more].concat())
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn accelerations_of_even_changes_are_true_within_their_uncertainty() {
    let (mut inside, mut all, mut scenarios) = (0.0, 0.0, [0; 2]);
    for seed in SEEDS {
        let (recording, truth) = simulated("changes", "constant", seed);
        let done = calibrated(&recording, &["--json"]);
        assert_eq!(done.status, 0, "{}", done.errors);
        let report: Value = serde_json::from_str(&done.output).expect("JSON");
        let changes = report["trains"][0]["changes"].as_array().expect("changes");
        for change in changes.iter().filter(|change| change["used"] == true) {
            let is_faster = number(&change["to_step"]) > number(&change["from_step"]);
            let rate = number(&truth["law"][if is_faster { "up_mm_s2" } else { "down_mm_s2" }]);
            let found = &change["acceleration_mm_per_s2"];
            let off = number(&found["value"]) - if is_faster { rate } else { -rate };
            // 95 % of normal errors.
            inside += f64::from(off.abs() <= 1.96 * number(&found["uncertainty"]));
            all += 1.0;
            let is_reached = change["reached_target_speed"].as_bool().expect("a used change is decided");
            scenarios[usize::from(is_reached)] += 1;
        }
    }
    assert!(all > 200.0, "{all} changes");
    assert!(scenarios.iter().all(|count| *count > 0), "{scenarios:?} of each scenario");
    assert!(inside / all >= 0.90, "{inside} of {all} inside their 95 % interval");
}

#[test]
fn the_table_has_the_verdicts_and_the_motion_model_beside_the_means() {
    let (recording, _) = simulated("changes", "constant", 7200);
    let done = calibrated(&recording, &[]);
    assert_eq!(done.status, 0, "{}", done.errors);
    for expected in ["Train 1:", "scenario 1", "scenario 2", "cannot tell", "motion model mm/s²"] {
        assert!(done.output.contains(expected), "{expected}: {}", done.output);
    }
}

#[test]
fn a_recording_without_a_change_is_refused_with_what_it_needs() {
    let (recording, _) = simulated("warm-up", "constant", 7200);
    let done = calibrated(&recording, &[]);
    assert_eq!(done.status, 2, "{}", done.output);
    assert!(done.errors.contains("no change of speed between two sensors"), "{}", done.errors);
    assert!(done.errors.contains("commanded to another step"), "{}", done.errors);
}

#[test]
fn a_train_that_is_not_there_is_refused() {
    let (recording, _) = simulated("changes", "constant", 7201);
    let done = calibrated(&recording, &["--train", "77"]);
    assert_eq!(done.status, 2, "{}", done.output);
    assert!(!done.errors.is_empty());
}

#[test]
fn a_method_that_does_not_exist_is_refused_with_those_that_do() {
    let done = footplate(&["calibrate", "--from", "x.csv", "--layout", "track-a", "--method", "tape"]);
    assert_eq!(done.status, 2);
    for method in ["motion", "two-sensor"] {
        assert!(done.errors.contains(method), "{}", done.errors);
    }
}
