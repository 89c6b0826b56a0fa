//! `footplate predict` says what came, what had been forecast and how good that was, to people and machines.

use serde_json::Value;

use crate::program::{Run, folder, footplate};

const LOG: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/sensor-logs/eadanila_2020_track_a.csv");
const STOPS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../testdata/sensor-logs/choochoos_2020_track_a_train74_stop.csv"
);

/// The fields of every score, as docs/formats/prediction-score.md names them.
const FIELDS: [&str; 9] = [
    "hits",
    "scored",
    "median_abs_mm",
    "p90_abs_mm",
    "median_abs_ms",
    "bias_mm",
    "coverage_50",
    "coverage_90",
    "coverage_99",
];

fn predict(arguments: &[&str]) -> Run {
    footplate(&[&["predict", "--layout", "track-a"], arguments].concat())
}

fn json(arguments: &[&str]) -> Value {
    let run = predict(&[arguments, &["--json"]].concat());
    assert_eq!(run.status, 0, "{}", run.errors);
    serde_json::from_str(&run.output).unwrap()
}

#[test]
fn json_carries_the_fields_overall_by_train_and_by_step() {
    let score = json(&[LOG]);
    let trains = score["trains"].as_array().unwrap();
    let numbers: Vec<_> = trains.iter().map(|train| train["train"].as_u64().unwrap()).collect();
    assert_eq!(numbers, [1, 58, 74, 78, 79]);
    let steps = trains.iter().flat_map(|train| train["steps"].as_array().unwrap());
    for scored in [&score["overall"]].into_iter().chain(trains).chain(steps) {
        for field in FIELDS {
            assert!(scored[field].is_number(), "{field}");
        }
        assert!(scored["oracle_median_abs_mm"].is_number());
        for baseline in ["constant_table", "ewma_1_256", "ewma_0_1", "ewma_0_5", "last_lap"] {
            assert!(FIELDS[..6].iter().all(|field| scored["baselines"][baseline][*field].is_number()));
            assert!(scored["baselines"][baseline]["coverage_50"].is_null(), "it states no interval");
        }
    }
    // Trains and steps share out all hits.
    let hits = |scores: &Value| -> u64 {
        scores.as_array().unwrap().iter().map(|score| score["hits"].as_u64().unwrap()).sum()
    };
    assert_eq!(score["overall"]["hits"], hits(&score["trains"]));
    assert_eq!(score["trains"][0]["hits"], hits(&score["trains"][0]["steps"]));
    assert_eq!(score["gates"]["overall"]["pairs"], 58);
}

#[test]
fn rows_are_in_keeping_with_their_sum() {
    let score = json(&[STOPS]);
    let rows = score["logs"][0]["rows"].as_array().unwrap();
    let late: Vec<f64> = rows.iter().filter_map(|row| row["late_mm"].as_f64()).collect();
    assert_eq!(score["overall"]["hits"], rows.len());
    assert_eq!(score["overall"]["scored"], late.len());
    let bias = late.iter().sum::<f64>() / late.len() as f64;
    assert!((score["overall"]["bias_mm"].as_f64().unwrap() - bias).abs() < 1e-5);
    for row in rows.iter().filter(|row| !row["forecast_s"].is_null()) {
        let seconds = |field: &str| row[field].as_f64().unwrap();
        let late = 1e3 * (seconds("reported_s") - seconds("forecast_s"));
        assert!((late - seconds("late_ms")).abs() < 1e-2, "{row}");
        assert!((seconds("late_mm") - 1e-3 * late * seconds("speed_mm_per_s")).abs() < 1e-2, "{row}");
    }
    let inside = rows.iter().filter(|row| {
        let (low, high) = (row["interval_90_s"][0].as_f64(), row["interval_90_s"][1].as_f64());
        let reported = row["reported_s"].as_f64();
        low <= reported && reported <= high && low.is_some()
    });
    let coverage = inside.count() as f64 / late.len() as f64;
    assert!((score["overall"]["coverage_90"].as_f64().unwrap() - coverage).abs() < 1e-5);
}

#[test]
fn people_see_every_hit_and_the_summary_fits_a_terminal() {
    let run = predict(&[STOPS]);
    assert_eq!((run.status, run.errors.as_str()), (0, ""));
    assert!(run.output.contains(" run train step  sensor  phase "), "{}", run.output);
    assert!(run.output.contains("EWMA 1/256") && run.output.contains("inside 90 %"));
    let summary = predict(&[STOPS, LOG, "--summary"]);
    assert!(!summary.output.contains("forecast s"));
    let widest = summary.output.lines().map(|line| line.chars().count()).max();
    assert!(widest <= Some(100), "{widest:?}");
}

#[test]
fn what_one_log_taught_is_kept_if_asked_for() {
    let fresh = json(&[STOPS, STOPS, "--summary"]);
    assert_eq!(fresh["logs"][0], fresh["logs"][1]);
    let kept = json(&[STOPS, STOPS, "--summary", "--carry-on"]);
    assert_eq!(kept["logs"][0], fresh["logs"][0]);
    let scored = |log: usize| kept["logs"][log]["scored"].as_u64().unwrap();
    assert!(scored(1) > scored(0), "the second time no step is new");
}

#[test]
fn wrong_input_is_named_and_ends_with_status_2() {
    let wrong = |arguments: &[&str], says: &str| {
        let run = predict(arguments);
        assert_eq!((run.status, run.output.as_str()), (2, ""), "{arguments:?}");
        assert!(run.errors.contains(says), "{}", run.errors);
    };
    wrong(&["no-such.csv"], "no-such.csv");
    wrong(&[LOG, "--train", "24"], "eadanila_2020_track_a.csv: no run of train 24");
    wrong(&[LOG, "--turnout", "6"], "`6` should be the number of a turnout and its leg, such as 6=straight");
    wrong(&[LOG, "--turnout", "6=left"], "such as 6=straight or 7=curved");
    let elsewhere = footplate(&["predict", LOG, "--layout", "track-c"]);
    assert_eq!(elsewhere.status, 2);
    assert!(elsewhere.errors.contains("track-c"), "{}", elsewhere.errors);
}

#[test]
fn a_calibration_makes_the_first_lap_forecast_as_well_as_the_second() {
    // Given the calibration of a log,
    let folder = folder("predict-calibration");
    let calibration = folder.join("all.toml").display().to_string();
    let log = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/sensor-logs/eadanila_2020_track_a.csv");
    let made = footplate(&[
        "calibrate",
        "--from",
        log,
        "--layout",
        "track-a",
        "--train",
        "74",
        "--out",
        &calibration,
    ]);
    assert_eq!(made.status, 0, "{}", made.errors);
    // when the log is walked with it and without,
    let p90 = |more: &[&str]| {
        let done = footplate(
            &[&["predict", log, "--layout", "track-a", "--train", "74", "--summary", "--json"][..], more]
                .concat(),
        );
        assert_eq!(done.status, 0, "{}", done.errors);
        let score: serde_json::Value = serde_json::from_str(&done.output).expect("JSON");
        score["overall"]["p90_abs_mm"].as_f64().expect("a number")
    };
    // then forecasts miss by less, and a file that is none is refused with its place.
    let (cold, primed) = (p90(&[]), p90(&["--calibration", &calibration]));
    assert!(primed < cold, "{primed} against {cold}");
    let bad = folder.join("bad.toml");
    std::fs::write(&bad, "model_version = 7\n").expect("a test file");
    let refused = footplate(&["predict", log, "--calibration", &bad.display().to_string()]);
    assert_eq!(refused.status, 2);
    assert!(refused.errors.contains("line 1"), "{}", refused.errors);
}

#[test]
fn a_model_of_another_layout_and_a_turnout_that_is_not_there_are_refused() {
    let folder = folder("predict-other-layout");
    let model = folder.join("model.toml").display().to_string();
    let log = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/sensor-logs/eadanila_2020_track_a.csv");
    let made =
        footplate(&["calibrate", "--from", log, "--layout", "track-a", "--train", "74", "--out", &model]);
    assert_eq!(made.status, 0, "{}", made.errors);
    let text = std::fs::read_to_string(&model).expect("a model");
    let other = folder.join("other.toml");
    std::fs::write(&other, text.replace("track-a", "track-b")).expect("a test file");
    let refused = |more: &[&str], says: &str| {
        let run = footplate(&[&["predict", log, "--train", "74"], more].concat());
        assert_eq!(run.status, 2, "{}", run.output);
        assert!(run.errors.contains(says), "{}", run.errors);
    };
    refused(&["--calibration", &other.display().to_string()], "other.toml: a model made on track-b");
    let nan = folder.join("nan.toml");
    std::fs::write(&nan, text.replacen("scatter_scale = 1.0", "scatter_scale = nan", 1))
        .expect("a test file");
    refused(&["--calibration", &nan.display().to_string()], "nan.toml: ");
    refused(&["--turnout", "99=straight"], "--turnout: track-a has no turnout 99");
}
