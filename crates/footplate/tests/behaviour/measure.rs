//! `footplate measure stop` takes what a tape says as a measurement like any other, and nothing that cannot be.

use std::fs;
use std::path::{Path, PathBuf};

use crate::program::{Run, folder, footplate, testdata};

/// Four stops of train 24 of 2020, two from step 8, the last of them without what the tape said: `E12 + 260 mm`.
fn store(name: &str) -> PathBuf {
    let folder = folder(name);
    let whole = fs::read_to_string(testdata("sensor-logs/choochoos_2020_track_a_train24_stop.csv")).unwrap();
    let (without, last) = whole.trim_end().rsplit_once('\n').unwrap();
    assert!(last.starts_with("4,stopped,8,,260,"), "{last}");
    let stops = folder.join("train24_stop.csv");
    fs::write(&stops, format!("{without}\n")).unwrap();
    let store = folder.join("railway.db");
    let run = footplate(&[
        "calibrate",
        "--from",
        &testdata("sensor-logs/choochoos_2020_track_a_train24_run.csv"),
        stops.to_str().unwrap(),
        "--layout",
        "track-a",
        "--store",
        store.to_str().unwrap(),
    ]);
    assert_eq!(run.status, 0, "{run:?}");
    store
}

fn measure(store: &Path, arguments: &[&str]) -> Run {
    footplate(&[&["measure", "stop", "--store", store.to_str().unwrap()], arguments].concat())
}

#[test]
fn a_tape_counts_like_any_other_measurement_and_says_what_it_changed() {
    let store = store("measure-stop");
    // Given the other stop from step 8, of 198 mm (docs of the team: 260 mm past E12 both times),
    let run = measure(&store, &["--train", "24", "--at", "E12+270mm", "--json"]);
    assert_eq!(run.status, 0, "{run:?}");
    let told: serde_json::Value = serde_json::from_str(&run.output).unwrap();
    assert_eq!((&told["from_step"], &told["run"]), (&8.into(), &4.into()));
    let distance = |of: &str| told[of]["distance_mm"].as_f64().unwrap();
    // then 10 mm more on the tape are some more in what is believed of two now.
    let more = distance("after") - distance("before");
    assert!((0.5..10.0).contains(&more) && (distance("after") - 203.0).abs() < 10.0, "{told}");
    assert_eq!((&told["before"]["measurements"], &told["after"]["measurements"]), (&1.into(), &2.into()));
    // The time of reading a tape is not the time it took to stop.
    let table =
        footplate(&["calibrate", "--store", store.to_str().unwrap(), "--layout", "track-a", "--json"]);
    let table: serde_json::Value = serde_json::from_str(&table.output).unwrap();
    let stops = table["trains"][0]["stops"].as_array().unwrap();
    let timed: Vec<bool> = stops.iter().map(|stop| stop["time_s"].is_number()).collect();
    assert_eq!(timed, [true, true, true, false], "{stops:?}");
}

#[test]
fn a_second_reading_of_the_same_stop_replaces_the_first_and_a_misread_one_is_pointed_out() {
    let store = store("measure-again");
    let run = measure(&store, &["--train", "24", "--at", "E12+860mm"]);
    assert!(
        run.output.contains("standard deviations from what the model expected; if the tape was misread"),
        "{run:?}"
    );
    let run = measure(&store, &["--train", "24", "--at", "E12 + 260 mm", "--took", "1.33s"]);
    assert_eq!(run.status, 0);
    assert!(run.output.ends_with(" mm, 2 measured\n"), "{}", run.output);
    let (_, after) = run.output.rsplit_once(" -> ").unwrap();
    let stop: f64 = after.split_whitespace().next().unwrap().parse().unwrap();
    assert!((stop - 198.0).abs() < 8.0, "{stop}");
    let event = run.output.split_whitespace().nth(1).unwrap().trim_end_matches(':');
    let path = store.to_str().unwrap();
    let excluded = footplate(&["store", "exclude", event, "--reason", "the tape slipped", "--store", path]);
    assert_eq!(excluded.status, 0, "{excluded:?}");
}

#[test]
fn a_tape_is_right_although_all_trains_were_told_to_stand_again_at_the_end() {
    // Given a demonstration, at whose end trains that stand are told to, and the true place of its last stop,
    let store = folder("measure-demo").join("railway.db");
    let demo = footplate(&["demo", "--store", store.to_str().unwrap()]);
    let table = demo.output.lines().rev().find(|line| line.ends_with("inside")).unwrap();
    let columns: Vec<&str> = table.split_whitespace().collect();
    // then that place is what the model expected, from the step of the stop.
    for reading in 1..=2 {
        let run = measure(&store, &["--train", columns[0], "--at", columns[3]]);
        assert!(run.output.contains(&format!("stop from step {}: ", columns[2])), "{table}: {run:?}");
        assert!(!run.output.contains("standard deviations"), "{table}: reading {reading}: {run:?}");
    }
}

#[test]
fn what_cannot_be_is_refused_and_nothing_is_kept() {
    let store = store("measure-wrong");
    let path = store.to_str().unwrap();
    let events = || footplate(&["store", "show", "--store", path]).output;
    let before = events();
    for (arguments, complaint) in [
        (&["--train", "24", "--at", "C13+120mm"][..], "lay the tape from E12, the sensor it passed last"),
        (&["--train", "24", "--at", "E12+9000mm"], "lies beyond C6, the next sensor 1008 mm on"),
        (&["--train", "24", "--at", "E12-200mm"], "cannot stand 200 mm short of it"),
        (&["--train", "24", "--at", "Z9+1mm"], "track-a has no place `Z9`"),
        (&["--train", "24", "--at", "BR6+1mm"], "BR6 is not a sensor"),
        (&["--train", "24", "--at", "E12+26cm"], "is not an offset: write millimetres"),
        (&["--train", "25", "--at", "E12+260mm"], "train 25 was not commanded in any run"),
        (&["--train", "24", "--at", "E12+260mm", "--took", "4h"], "from 0.1s to 15s, such as 3.4s"),
        (&["--train", "24", "--at", "E12+260mm", "--recording", "9"], "there is no recording 9"),
        (
            &["--train", "24", "--at", "E12+260mm", "--recording", "1"],
            "measure a stop while the train is at rest",
        ),
        (
            &["--train", "24", "--at", "E12+260mm", "--layout", "track-b"],
            "is of the layout track-a, not of track-b",
        ),
    ] {
        let run = measure(&store, arguments);
        assert_eq!(run.status, 2, "{arguments:?}: {run:?}");
        assert!(run.errors.contains(complaint), "{arguments:?}: {}", run.errors);
    }
    assert_eq!(events(), before);
}

#[test]
fn a_picture_that_fails_does_not_invite_to_store_the_stop_twice() {
    let store = store("measure-plot");
    let plot = store.with_file_name("missing").join("stops.svg").display().to_string();
    let run = measure(&store, &["--train", "24", "--at", "E12+260mm", "--plot", &plot]);
    assert_eq!(run.status, 1, "{run:?}");
    assert!(run.output.contains(": train 24 at rest at E12+260mm"), "{run:?}");
    assert!(run.errors.contains("do not add it again; its picture failed"), "{run:?}");
}
