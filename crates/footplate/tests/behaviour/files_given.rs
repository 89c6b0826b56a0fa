//! Files that are given to the program: each counts once, none is destroyed, and readers that go away end no session.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::program::{Run, folder, footplate, testdata};

fn train_24(kind: &str) -> String {
    testdata(&format!("sensor-logs/choochoos_2020_track_a_train24_{kind}.csv"))
}

fn copied(from: &str, folder: &Path, name: &str) -> String {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().expect("a folder")).expect("a test folder");
    fs::copy(from, &path).expect("a test file");
    path.display().to_string()
}

fn calibrate(more: &[&str]) -> Run {
    footplate(&[&["calibrate", "--layout", "track-a"], more].concat())
}

fn json(run: &Run) -> Value {
    assert_eq!(run.status, 0, "{}", run.errors);
    serde_json::from_str(&run.output).expect("JSON")
}

#[test]
fn a_question_changes_no_model_that_trains_are_driven_by() {
    let folder = folder("files-given/questions");
    let store = folder.join("railway.db").display().to_string();
    let (run, stop) = (train_24("run"), train_24("stop"));
    json(&calibrate(&["--from", &run, &stop, "--store", &store, "--json"]));
    for (question, status) in [
        (&["--explain", "SPEED:14"][..], 0),
        // These logs hold no change of speed between two sensors.
        (&["--method", "two-sensor"], 2),
        (&["--method", "short-moves"], 0),
        (&["--as-of", "2100-01-01"], 0),
    ] {
        let asked = calibrate(&[&["--store", &store], question].concat());
        assert_eq!(asked.status, status, "{question:?}: {}", asked.errors);
    }
    let changes = footplate(&["store", "--store", &store, "changes"]);
    let kept = changes.output.lines().filter(|line| line.contains("was calibrated")).count();
    assert_eq!(kept, 1, "{}{}", changes.output, changes.errors);
}

#[test]
fn two_recordings_of_one_name_are_two_recordings() {
    let folder = folder("files-given/same-name");
    let one = copied(&train_24("run"), &folder, "a/train24.csv");
    let same = copied(&train_24("stop"), &folder, "b/train24.csv");
    let other = copied(&train_24("stop"), &folder, "b/train24_other.csv");
    let steps = |report: &Value| report["trains"][0]["steps"].clone();
    let apart = json(&calibrate(&["--from", &one, &other, "--json"]));
    let alike = json(&calibrate(&["--from", &one, &same, "--json"]));
    assert_eq!(steps(&alike), steps(&apart));
    let names: Vec<&str> = alike["polling"]
        .as_array()
        .expect("links")
        .iter()
        .filter_map(|of| of["recording"].as_str())
        .collect();
    assert_eq!(names, ["train24", "train24 (2)"]);
    // The same through a store.
    let store = folder.join("railway.db").display().to_string();
    let kept = json(&calibrate(&["--from", &one, &same, "--store", &store, "--json"]));
    assert_eq!(steps(&kept), steps(&apart));
}

#[test]
fn a_log_that_is_given_twice_counts_once() {
    let folder = folder("files-given/twice");
    let (log, copy) = (train_24("run"), copied(&train_24("run"), &folder, "train24_copy.csv"));
    let once = json(&calibrate(&["--from", &log, "--json"]));
    let twice = calibrate(&["--from", &log, &copy, &log, "--json"]);
    assert_eq!(json(&twice), once);
    assert_eq!(twice.errors.matches("so it is counted once").count(), 2, "{}", twice.errors);
}

#[test]
fn a_log_of_another_train_does_not_become_the_one_asked_for() {
    let log = train_24("run");
    let refused = calibrate(&["--from", &log, "--train", "58"]);
    assert_eq!(refused.status, 2, "{}", refused.output);
    assert!(
        refused.errors.contains("no run of train 58: the recordings are of train 24"),
        "{}",
        refused.errors
    );
    // Other logs are left out of a forecast.
    let laps = testdata("sensor-logs/eadanila_2020_track_a.csv");
    let predicted = footplate(&["predict", &log, &laps, "--layout", "track-a", "--train", "24", "--summary"]);
    assert_eq!(predicted.status, 0, "{}", predicted.errors);
    assert!(predicted.errors.contains("no run of train 24, so it is left out"), "{}", predicted.errors);
}

#[test]
fn a_log_may_come_through_a_pipe() {
    let file = File::open(train_24("run")).expect("a log");
    let mut cat = Command::new("cat").stdin(file).stdout(Stdio::piped()).spawn().expect("a pipe");
    let piped = cat.stdout.take().expect("a pipe");
    let run = Command::new(env!("CARGO_BIN_EXE_footplate"))
        .args(["calibrate", "--from", "/dev/stdin", "--layout", "track-a", "--train", "24", "--json"])
        .stdin(piped)
        .output()
        .expect("the program starts");
    assert_eq!(cat.wait().expect("cat ends").code(), Some(0));
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
}

#[cfg(unix)]
#[test]
fn a_script_and_a_model_without_an_end_are_refused() {
    let folder = folder("files-given/endless");
    let model = folder.join("endless.toml");
    std::os::unix::fs::symlink("/dev/zero", &model).expect("a link to a device");
    let model = model.display().to_string();
    for (given, says) in [
        (["--script", "/dev/zero"], "/dev/zero: too long for a script: the limit is 1048576 bytes"),
        (["--model", &model], "endless.toml: too large for a motion model, which has at most 16777216 bytes"),
    ] {
        let run = footplate(&[&["drive", "--link", "sim:track-a?seed=7&trains=24"], &given[..]].concat());
        assert_eq!(run.status, 2, "{}", run.errors);
        assert!(run.errors.contains(says), "{}", run.errors);
    }
}

#[test]
fn files_of_several_kinds_are_named_by_their_kinds() {
    let positions = testdata("position-series/cs452_2015_stop_1.csv");
    let moves = testdata("short-moves/cs452_2023_train58_step8.csv");
    for (first, second, says) in [
        (&moves, &positions, "series of positions and short moves cannot be calibrated together"),
        (&positions, &moves, "short moves and series of positions cannot be calibrated together"),
        (&positions, &train_24("run"), "sensor logs and series of positions cannot be calibrated together"),
    ] {
        let refused = footplate(&["calibrate", "--from", first, second]);
        assert_eq!(refused.status, 2);
        assert!(refused.errors.contains(says), "{}", refused.errors);
    }
}

#[test]
fn a_mistyped_store_is_not_made() {
    let path = folder("files-given/mistyped").join("typo.db");
    let refused = calibrate(&["--store", &path.display().to_string()]);
    assert_eq!(refused.status, 2);
    assert!(refused.errors.contains("typo.db") && !path.exists(), "{}", refused.errors);
    let refused = calibrate(&["--from", &train_24("run"), "--budget", "3m"]);
    assert_eq!(refused.status, 2);
    assert!(refused.errors.contains("--link"), "{}", refused.errors);
}

#[test]
fn a_store_says_how_it_keeps_a_log_that_is_given_otherwise() {
    let store = folder("files-given/otherwise").join("railway.db").display().to_string();
    let import = |layout: &str| {
        footplate(&["store", "--store", &store, "import", &train_24("run"), "--layout", layout])
    };
    assert_eq!(import("track-a").status, 0);
    let other = footplate(&["calibrate", "--store", &store, "--layout", "track-a", "--train", "58"]);
    assert_eq!(other.status, 2);
    assert!(other.errors.contains("no run of train 58: the recordings are of train 24"), "{}", other.errors);
    let again = import("track-b");
    assert_eq!(again.status, 1, "{}{}", again.output, again.errors);
    assert!(again.errors.contains("keeps it as recording 1 of layout track-a, train 24"), "{}", again.errors);
    let nothing = footplate(&["calibrate", "--store", &store, "--layout", "track-b"]);
    assert_eq!(nothing.status, 2);
    assert!(
        nothing
            .errors
            .contains("nothing to calibrate on the layout track-b: the store has recordings of track-a"),
        "{}",
        nothing.errors
    );
}

#[test]
fn no_output_replaces_an_input_or_another_output() {
    let folder = folder("files-given/outputs");
    let log = copied(&train_24("run"), &folder, "train24.csv");
    let before = fs::read(&log).expect("a log");
    let refused = |arguments: &[&str], says: &str| {
        let run = footplate(arguments);
        assert_eq!(run.status, 2, "{arguments:?}: {}", run.output);
        assert!(run.errors.contains(says), "{arguments:?}: {}", run.errors);
        assert_eq!(fs::read(&log).expect("a log"), before, "{arguments:?}");
    };
    refused(&["convert", &log, "--out", &log], "it would replace a file that is read");
    refused(&["report", &log, "--layout", "track-a", "--out", &log], "it would replace a file that is read");
    refused(
        &["calibrate", "--from", &log, "--layout", "track-a", "--out", &log],
        "it would replace a file that is read",
    );
    refused(&["odometry", &log, "--out", &log], "it would replace a file that is read");
    let page = folder.join("page.html").display().to_string();
    refused(&["odometry", &log, "--out", &page, "--report", &page], "--out writes this file, too");
    refused(&["convert", &log, "--out", &page], "a sensor log is written as CSV");
}

#[cfg(unix)]
#[test]
fn an_output_may_be_the_standard_one() {
    let run = footplate(&["convert", &train_24("run"), "--out", "/dev/stdout"]);
    assert_eq!(run.status, 0, "{}", run.errors);
    assert!(run.output.starts_with("run,t_s,kind"), "{}", &run.output[..run.output.len().min(100)]);
}

#[test]
fn a_session_goes_on_when_its_readers_have_gone() {
    // Given a calibration whose standard error is a pipe without a reader,
    let folder = folder("files-given/unread");
    let store = folder.join("railway.db").display().to_string();
    let link = "sim:track-a?seed=7&faults=none&trains=24";
    let spawn = |arguments: &[&str]| {
        let program = Command::new(env!("CARGO_BIN_EXE_footplate"))
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        program.expect("the program starts")
    };
    let mut calibration = spawn(&[
        "calibrate",
        "--link",
        link,
        "--layout",
        "track-a",
        "--train",
        "24",
        "--store",
        &store,
        "--budget",
        "90s",
    ]);
    drop(calibration.stderr.take());
    let done = calibration.wait_with_output().expect("the program ends");
    assert!(matches!(done.status.code(), Some(0 | 1)), "{:?}", done.status);
    let kept = || {
        let changes = footplate(&["store", "--store", &store, "changes"]);
        changes.output.lines().filter(|line| line.contains("was calibrated")).count()
    };
    assert_eq!(kept(), 1);
    // and a drive whose results have no reader: what it learnt is kept, too.
    let script = folder.join("script.txt");
    fs::write(&script, "speed 24 9\nwait 24 located\nstop 24\nwait 24 at rest\n").expect("a test file");
    let script = script.display().to_string();
    let mut drive = spawn(&["drive", "--link", link, "--store", &store, "--script", &script, "--json"]);
    drop(drive.stdout.take());
    let done = drive.wait_with_output().expect("the program ends");
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(kept(), 2);
}
