//! A session says which train it took each report to be of, and later ones learn from that. Runs of which no session says so teach
//! nothing: they are named, and what is known is not replaced by less.

use std::path::Path;

use footplate_core::{Event, EventKind, SpeedStep, Timestamp, TrainId};
use footplate_store::{Journal, MotionFile, Store};

use crate::program::{folder, footplate};

const TRAIN: TrainId = TrainId(24);
/// A date after all that is stored.
const LATEST: Timestamp = Timestamp::from_ns(i64::MAX);

#[test]
fn runs_of_several_trains_are_named_and_replace_no_model_that_knows_more() {
    let path = folder("several_trains").join("railway.db");
    let file = path.to_str().unwrap();
    let logs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/sensor-logs");
    let log =
        |kind: &str| logs.join(format!("choochoos_2020_track_a_train24_{kind}.csv")).display().to_string();
    let calibrate = |more: &[&str]| {
        let run = footplate(&[&["calibrate", "--layout", "track-a", "--store", file], more].concat());
        assert_eq!(run.status, 0, "{}", run.errors);
        run
    };
    let alone = calibrate(&["--from", &log("run"), &log("stop")]);
    assert!(alone.output.contains("Train 24: 18 runs, 121 sensor reports"), "{}", alone.output);
    assert!(!alone.output.contains("left out"), "{}", alone.output);
    let stored = || MotionFile::of_store(&Store::open(&path).unwrap(), TRAIN, LATEST).unwrap().unwrap();
    let kept = stored();

    let store = Store::open(&path).unwrap();
    let date = Timestamp::from_s(1_795_248_000.0);
    let mut journal = Journal::begin(store, "evening", "track-a", None, &[], date).unwrap();
    let starts = |second, train| {
        let kind = EventKind::Speed { train: TrainId(train), step: SpeedStep::new(8).unwrap() };
        Event { time: Timestamp::from_s(second), kind }
    };
    journal.append(&[starts(1.0, 24), starts(2.0, 58)], date).unwrap();
    drop(journal.end());
    // Events of the first runs are excluded: what is left knows less than the stored model.
    let excluded = footplate(&["store", "exclude", "20-120", "--reason", "dirt", "--store", file]);
    assert_eq!(excluded.status, 0, "{}", excluded.errors);

    let beside = calibrate(&["--train", "24"]);
    let named =
        "left out, because several trains moved and their reports cannot be assigned: 1 run (evening, run 1)";
    assert!(beside.output.contains(named), "{}", beside.output);
    assert!(beside.errors.contains("the stored model of train 24 knows"), "{}", beside.errors);
    assert_eq!(stored(), kept);
    let json: serde_json::Value =
        serde_json::from_str(&calibrate(&["--train", "24", "--json"]).output).unwrap();
    assert_eq!(json["warnings"], serde_json::json!([named]));
}

#[test]
fn a_session_of_two_trains_teaches_what_each_of_them_did() {
    let folder = folder("two_trains_teach");
    let (store, script) = (folder.join("railway.db"), folder.join("evening.txt"));
    let (store, script) = (store.to_str().unwrap(), script.to_str().unwrap());
    let orders = "turnout all straight\nfind 24\nfind 58\ngo 24 to B5+100mm\ngo 58 to C13+120mm\ngo 24 to C11+100mm\n\
                  go 58 to B5+100mm\nwait 24 at rest\nwait 58 at rest\n";
    std::fs::write(script, orders).unwrap();
    let link = "sim:track-a?seed=61001&trains=24,58";
    let run = |arguments: &[&str]| {
        let run = footplate(arguments);
        assert_eq!(run.status, 0, "{}", run.errors);
        run
    };
    for train in ["24", "58"] {
        let calibrated = ["calibrate", "--link", link, "--layout", "track-a", "--train", train];
        run(&[&calibrated[..], &["--budget", "150s", "--store", store]].concat());
    }
    // "Train 24: 2 runs, 161 sensor reports"
    let reports = |train: &str| -> usize {
        let calibrated =
            run(&["calibrate", "--layout", "track-a", "--store", store, "--train", train]).output;
        assert!(!calibrated.contains("left out"), "{calibrated}");
        let (before, _) = calibrated.split_once(" sensor reports").expect("a count");
        before.rsplit(' ').next().and_then(|count| count.parse().ok()).expect("a count")
    };
    let before = ["24", "58"].map(reports);
    let driven = run(&["drive", "--link", link, "--store", store, "--script", script]);
    for (train, before) in ["24", "58"].into_iter().zip(before) {
        // As the session tells it: "train 24 at E11, 150 ms late"; but "train 24 at D12+132mm" of one that has come to rest.
        let says = format!("  train {train} at ");
        let behind = driven.output.lines().filter_map(|line| Some(line.split_once(&says)?.1));
        let ends = behind.map(|at| at.trim_start_matches(|letter: char| letter.is_alphanumeric()));
        let passed = ends.filter(|end| end.is_empty() || end.starts_with(',')).count();
        assert!(passed >= 5, "{}", driven.output);
        assert_eq!(reports(train), before + passed, "train {train}: {}", driven.output);
    }
}
