//! Runs in which several trains moved teach nothing: they are named, and what a session learnt in them is not replaced by less.

use std::path::Path;

use footplate_core::{Event, EventKind, SpeedStep, Timestamp, TrainId};
use footplate_store::{Journal, MotionFile, Store};

use crate::program::footplate;

const TRAIN: TrainId = TrainId(24);
/// A date after all that is stored.
const LATEST: Timestamp = Timestamp::from_ns(i64::MAX);

#[test]
fn runs_of_several_trains_are_named_and_replace_no_model_that_knows_more() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("several_trains");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("railway.db");
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
