//! `--plot` draws what a command found, as SVG or PNG by the ending of the file, with units on its axes and a legend.

use std::fs;
use std::path::Path;

use crate::program::{Run, folder, footplate};

const VEHICLE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../footplate-store/vehicles/two-measured-wheelsets.toml");
const TESTDATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata");
/// What every file of pixels begins with (PNG specification, third edition, 5.2).
const PNG_SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'];

fn drawn(arguments: &[&str], picture: &Path) -> Run {
    footplate(&[arguments, &["--plot", picture.to_str().unwrap()]].concat())
}

/// All letters of a picture.
fn words(picture: &Path) -> String {
    let svg = fs::read_to_string(picture).unwrap();
    let texts =
        svg.split("<text ").skip(1).filter_map(|rest| Some(rest.split_once('>')?.1.split_once("</text>")?.0));
    texts.map(str::trim).collect::<Vec<_>>().join("\n")
}

fn says(picture: &Path, expected: &[&str]) {
    let words = words(picture);
    for word in expected {
        assert!(words.lines().any(|line| line.contains(word)), "`{word}` in {words}");
    }
}

#[test]
fn a_run_of_odometry_is_drawn_with_its_bounds_and_the_truth() {
    let folder = folder("plot/odometry");
    let recording = format!("{TESTDATA}/tachometer/plain.csv");
    let svg = folder.join("run.svg");
    assert_eq!(drawn(&["odometry", "--vehicle", VEHICLE, &recording], &svg).status, 0);
    let expected = [
        "Odometry of plain.csv",
        "speed (m/s)",
        "time since the first period (s)",
        "99.99 % interval",
        "truth",
        "wheelset 2",
    ];
    says(&svg, &expected);
    assert!(!words(&svg).contains("no vehicle file"));
    let of_an_example = folder.join("example.svg");
    assert_eq!(drawn(&["odometry", &recording], &of_an_example).status, 1);
    says(&of_an_example, &["no vehicle file: figures of an example train, preset recommended"]);
    let png = folder.join("run.png");
    assert_eq!(drawn(&["odometry", "--vehicle", VEHICLE, &recording], &png).status, 0);
    assert_eq!(fs::read(&png).unwrap()[..8], PNG_SIGNATURE);
    let run = drawn(&["odometry", "--vehicle", VEHICLE, &recording], &folder.join("run.gif"));
    assert_eq!(run.status, 2);
    assert!(run.errors.contains("should end with .svg or .png"), "{}", run.errors);
}

#[test]
fn speeds_and_stops_are_drawn_by_step() {
    let folder = folder("plot/calibrate");
    let log = |kind| format!("{TESTDATA}/sensor-logs/choochoos_2020_track_a_train24_{kind}.csv");
    let (run, stop) = (log("run"), log("stop"));
    let svg = folder.join("train.svg");
    let done = drawn(&["calibrate", "--from", &run, &stop, "--layout", "track-a"], &svg);
    assert_eq!(done.status, 0, "{}", done.errors);
    says(
        &svg,
        &[
            "Train 24 on track-a",
            "steady speed (mm/s)",
            "stopping distance (mm)",
            "throttle step",
            "from below",
        ],
    );
    // Two trains are two pictures.
    let other = format!("{TESTDATA}/sensor-logs/choochoos_2020_track_a_train74_run.csv");
    let done = drawn(&["calibrate", "--from", &run, &other, "--layout", "track-a"], &folder.join("two.svg"));
    assert_eq!(done.status, 2);
    assert!(done.errors.contains("choose one with --train"), "{}", done.errors);
    // A train that is driven is drawn with what its session reached.
    let svg = folder.join("session.svg");
    let session = [
        "calibrate",
        "--link",
        "sim:track-a?seed=7",
        "--layout",
        "track-a",
        "--train",
        "24",
        "--budget",
        "90s",
    ];
    let done = drawn(&session, &svg);
    assert_eq!(done.status, 0, "{}", done.errors);
    says(&svg, &["Train 24 on track-a", "and of single stops", "from above"]);
}

#[test]
fn stops_measured_by_hand_are_drawn_beside_the_model() {
    let folder = folder("plot/measure");
    let store = folder.join("railway.db");
    let log = |kind| format!("{TESTDATA}/sensor-logs/choochoos_2020_track_a_train24_{kind}.csv");
    let from = [
        "calibrate",
        "--from",
        &log("run"),
        &log("stop"),
        "--layout",
        "track-a",
        "--store",
        store.to_str().unwrap(),
    ];
    assert_eq!(footplate(&from).status, 0);
    let svg = folder.join("stops.svg");
    let measured =
        ["measure", "stop", "--store", store.to_str().unwrap(), "--train", "24", "--at", "E12+270mm"];
    let run = drawn(&measured, &svg);
    assert_eq!(run.status, 0, "{}", run.errors);
    says(
        &svg,
        &[
            "Stops of train 24",
            "speed at the command (mm/s)",
            "stopping distance (mm)",
            "from step 8",
            "motion model",
        ],
    );
}

#[test]
fn forecasts_are_drawn_phase_by_phase_beside_those_of_others() {
    let folder = folder("plot/predict");
    let log = format!("{TESTDATA}/sensor-logs/eadanila_2020_track_a.csv");
    let svg = folder.join("errors.svg");
    let run = drawn(&["predict", &log, "--layout", "track-a", "--summary", "--json"], &svg);
    assert_eq!(run.status, 0, "{}", run.errors);
    says(
        &svg,
        &["eadanila_2020_track_a on track-a", "steady: error at most (mm)", "first lap: error at most (mm)"],
    );
    says(&svg, &["reports (%)", "Footplate", "EWMA 0.1", "oracle"]);
    // The picture says of how many reports it is; the summary counts the same ones.
    let summary: serde_json::Value = serde_json::from_str(&run.output).unwrap();
    let forecast = &summary["overall"]["scored"];
    says(&svg, &[&format!("{forecast} reports that were forecast")]);
}

#[test]
fn a_store_is_drawn_as_the_calibration_of_all_that_it_holds() {
    let folder = folder("plot/store");
    let store = folder.join("railway.db");
    let store = store.to_str().unwrap();
    let log = |train| format!("{TESTDATA}/sensor-logs/choochoos_2020_track_a_train{train}_run.csv");
    let import = ["store", "import", &log(24), "--layout", "track-a", "--store", store];
    assert_eq!(footplate(&import).status, 0);
    let (shown, fitted) = (folder.join("shown.svg"), folder.join("fitted.svg"));
    assert_eq!(drawn(&["store", "show", "--store", store], &shown).status, 0);
    assert_eq!(drawn(&["calibrate", "--store", store, "--layout", "track-a"], &fitted).status, 0);
    assert_eq!(fs::read(&shown).unwrap(), fs::read(&fitted).unwrap());
    // Two trains are two pictures, and what is drawn is the whole store.
    assert_eq!(footplate(&["store", "import", &log(74), "--layout", "track-a", "--store", store]).status, 0);
    let run = drawn(&["store", "show", "--store", store], &folder.join("two.svg"));
    assert_eq!(run.status, 2);
    assert!(run.errors.contains("choose one with --train"), "{}", run.errors);
    assert_eq!(drawn(&["store", "show", "--store", store, "--train", "74"], &shown).status, 0);
    says(&shown, &["Train 74 on track-a"]);
    assert_eq!(drawn(&["store", "show", "--store", store, "--recording", "1"], &shown).status, 2);
}

#[test]
fn the_latencies_of_a_line_are_drawn() {
    let svg = folder("plot/doctor").join("line.svg");
    let run = drawn(&["doctor", "--link", "sim:track-a?seed=7"], &svg);
    assert_eq!(run.status, 0, "{}", run.errors);
    says(&svg, &["How fast the line is", "poll period", "first byte", "at most (ms)"]);
}

#[test]
fn ours_are_drawn_beside_what_others_published() {
    let svg = folder("plot/compare").join("train24.svg");
    let log = format!("{TESTDATA}/sensor-logs/choochoos_2020_track_a_train24_run.csv");
    let speeds = format!("{TESTDATA}/published-tables/speeds.csv");
    let run = drawn(&["compare", &log, "--layout", "track-a", "--with", &speeds, "--train", "24"], &svg);
    assert_eq!(run.status, 0, "{}", run.errors);
    says(&svg, &["Train 24 beside what others published", "steady speed (mm/s)", "ours", "theirs, agrees"]);
}
