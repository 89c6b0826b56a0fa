//! `footplate calibrate` of short moves: real ones measured with a tape, calibrated trains, and bad files.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{assert_not_calibrated, folder, footplate, testdata, written};

/// Moves that teams of the course measured with a tape (testdata/short-moves).
fn measured(name: &str) -> Value {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/short-moves");
    let path = folder.join(format!("cs452_2023_{name}.csv"));
    fitted(&path)
}

fn fitted(path: &Path) -> Value {
    let done = footplate(&["calibrate", "--from", &path.display().to_string(), "--json"]);
    assert_eq!(done.status, 0, "{}", done.errors);
    let report: Value = serde_json::from_str(&done.output).expect("JSON");
    report["short_moves"][0].clone()
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn moves_that_were_not_fitted_are_predicted() {
    // Measured by tape to a few millimetres, each predicted from the others of its train.
    for (name, law_mm, table_mm) in
        [("train58_step8", 9.0, 10.5), ("train47_step8", 27.0, 16.0), ("train54_step7", 31.0, 26.0)]
    {
        let fit = measured(name);
        let [law, table] = ["law_error_mm", "table_error_mm"].map(|error| number(&fit[error]));
        assert!(law < law_mm && table < table_mm, "{name}: {law} mm by law, {table} mm by table");
    }
}

#[test]
fn laws_are_found_again_and_more_so_by_many_moves() {
    // 0.25 m/s² to 200 mm/s, 0.3 s later than the stop takes effect, and 0.4 m/s² down.
    let mut text = "command_time_s,distance_mm\n".to_owned();
    for quarter in 2..=16 {
        let time = 0.25 * f64::from(quarter);
        let since = (time - 0.3_f64).clamp(0.0, 0.8);
        let (reached, ran) = (250.0 * since, 125.0 * since * since + 200.0 * (time - 1.1_f64).max(0.0));
        text += &format!("{time},{:.3}\n", ran + reached * reached / 800.0);
    }
    let fit = fitted(&written("short_moves-laws.csv", &text));
    for (name, truth) in [
        ("start_delay_s", 0.3),
        ("speed_mm_per_s", 200.0),
        ("acceleration_mm_per_s2", 250.0),
        ("deceleration_mm_per_s2", 400.0),
    ] {
        let [value, deviation] = ["value", "uncertainty"].map(|part| number(&fit[name][part]));
        assert!((value - truth).abs() < 2.0 * deviation.max(0.01 * truth), "{name}: {value} ± {deviation}");
    }
    assert!(number(&fit["law_error_mm"]) < 0.5, "{fit}");
}

#[test]
fn bad_files_are_refused_with_their_place_and_what_would_be_right() {
    const HEADER: &str = "command_time_s,distance_mm\n";
    let cases = [
        ("few", format!("{HEADER}0.5,20\n1,60\n"), "2 different times are too few"),
        ("none", HEADER.to_owned(), "no short move"),
        ("ms", format!("{HEADER}500,20\n"), "seconds between the two commands, 0 to 60"),
        ("words", format!("{HEADER}0.5,far\n"), "`far`"),
        ("behind", format!("{HEADER}0.5,-3\n"), "a distance in millimetres"),
        ("cut_off", format!("{HEADER}0.5,20\n0"), "line 3"),
        ("train", "train,command_time_s,distance_mm\nx,0.5,20\n".to_owned(), "the number of a train"),
    ];
    for (name, text, expected) in cases {
        assert_not_calibrated(&format!("short_moves-{name}.csv"), &text, expected);
    }
}

#[test]
fn moves_that_contradict_each_other_have_laws_and_no_table() {
    let text = "command_time_s,distance_mm\n0.5,20\n0.75,60\n1,110\n1.25,105\n1.5,200\n2,300\n2.5,400\n";
    let path = written("short_moves-contradicting.csv", text).display().to_string();
    let done = footplate(&["calibrate", "--from", &path]);
    assert_eq!(done.status, 0, "{}", done.errors);
    assert!(done.output.contains("no table: the move of 1250 ms got 105 mm"), "{}", done.output);
}

#[test]
fn a_calibrated_train_has_a_time_for_each_distance() {
    let log = testdata("sensor-logs/choochoos_2020_track_a_train24_stop.csv");
    let arguments = ["calibrate", "--from", &log, "--layout", "track-a", "--method", "short-moves", "--json"];
    let done = footplate(&arguments);
    assert_eq!(done.status, 0, "{}", done.errors);
    let report: Value = serde_json::from_str(&done.output).expect("JSON");
    let moves = report["trains"][0]["moves"].as_array().expect("moves").clone();
    let times: Vec<f64> = moves.iter().filter_map(|one| one["command_time_s"].as_f64()).collect();
    assert_eq!(times.len(), moves.len(), "{report}");
    assert!(moves.iter().all(|one| number(&one["uncertainty_mm"]) > 0.0), "{report}");
}

#[test]
fn models_of_several_trains_go_to_a_file_each() {
    let log = |train: u32| testdata(&format!("sensor-logs/choochoos_2020_track_a_train{train}_stop.csv"));
    let folder = folder("several_trains_move");
    let out = folder.join("model.toml").display().to_string();
    let done = footplate(&["calibrate", "--from", &log(24), &log(74), "--layout", "track-a", "--out", &out]);
    assert_eq!(done.status, 0, "{}", done.errors);
    for train in [24, 74] {
        let written = fs::read_to_string(folder.join(format!("model-{train}.toml"))).expect("a model");
        assert!(written.contains(&format!("train = {train}")), "{written}");
    }
}
