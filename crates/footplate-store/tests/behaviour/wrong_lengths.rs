//! A layout whose lengths are wrong makes speeds as uncertain as they are wrong, from files and from a store.

use footplate_core::track::Layout;
use footplate_core::{Approach, SpeedStep, Timestamp, TrainId};
use footplate_store::{Batch, ContentHash, LayoutFile, MotionReplay, Store, built_in, parse_layout};

use crate::recordings::{bytes_of, real};
use crate::stores::{Shelf, minute};

const TRAIN: TrainId = TrainId(24);
const LOGS: [&str; 2] = ["choochoos_2020_track_a_train24_run.csv", "choochoos_2020_track_a_train24_stop.csv"];
/// Steps and steady speeds (mm/s) of the train: the time over the taped distance of a lap (README of the recordings).
const TRUTH: [(u8, f64); 3] = [(8, 216.0), (11, 405.0), (14, 544.0)];
/// Of a normal distribution, 95 % are within so many standard deviations.
const HALF_95: f64 = 1.96;

/// Track A with edges off by these (mm), in turn: −51 ± 82.
fn wrong_track_a() -> LayoutFile {
    const OFF: [i32; 5] = [-153, 20, -51, -130, 59];
    /// The shortest edge that is left.
    const SHORTEST: i32 = 20;
    let text = include_str!("../../layouts/track-a.toml");
    let mut nth = 0;
    let line = |line: &str| -> String {
        let Some((edge, mm)) = line.split_once(", mm = ") else { return line.to_owned() };
        let (mm, rest) = mm.split_once(' ').unwrap();
        let mm: i32 = mm.parse().unwrap();
        nth += 1;
        let wrong = if mm == 0 { 0 } else { (mm + OFF[nth % OFF.len()]).max(SHORTEST) };
        format!("{edge}, mm = {wrong} {rest}")
    };
    let wrong: Vec<String> = text.lines().map(line).collect();
    let wrong = wrong.join("\n").replacen("name = \"track-a\"", "name = \"wrong-a\"", 1);
    parse_layout("wrong-a.toml", wrong.as_bytes()).unwrap()
}

fn imported(store: &mut Store, layout: &Layout) {
    for (log, at) in LOGS.into_iter().zip(1..) {
        store.import(&real(log), ContentHash::of(&bytes_of(log)), layout.name(), minute(at)).unwrap();
    }
}

#[test]
fn speeds_of_a_layout_with_wrong_lengths_are_as_uncertain_as_they_are_wrong() {
    let wrong = wrong_track_a().layout;
    let recordings = LOGS.map(real);
    let late: Timestamp = minute(1_000);
    let shelf = Shelf::new();
    let mut store = shelf.store();
    imported(&mut store, &wrong);
    let highest = SpeedStep::new(14).unwrap();
    let of_store = MotionReplay::of_store(&wrong, &mut store, TRAIN, highest, late).unwrap();
    let of_files = Batch::of_recordings(&wrong, &recordings, Some(TRAIN)).unwrap();
    let batch_of_store = Batch::of_store(&wrong, &store, late, Some(TRAIN)).unwrap();
    for (source, replay) in [
        ("files", &of_files.trains[0].replay),
        ("a store", &of_store),
        ("all of a store", &batch_of_store.trains[0].replay),
    ] {
        assert!(!replay.fit.survey_test().is_passed(), "{source}");
        for (step, truth) in TRUTH {
            let speed = replay.fit.model().speed(SpeedStep::new(step).unwrap(), Approach::Below);
            let (found, sigma) = (speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s());
            assert!((found - truth).abs() < HALF_95 * sigma, "{source}, step {step}: {found} ± {sigma}");
        }
    }
    // Right lengths keep their stated uncertainty.
    let right = built_in("track-a").unwrap().layout;
    let batch = Batch::of_recordings(&right, &recordings, Some(TRAIN)).unwrap();
    assert!(batch.survey_test().is_passed());
    let speed = batch.trains[0].replay.fit.model().speed(highest, Approach::Below);
    assert!(speed.uncertainty.as_mm_per_s() < 6.0, "{speed:?}");
}

#[test]
fn logs_of_track_a_are_doubted_on_track_b_each_by_itself() {
    // On track B, two distances of the lap are 87 and 95 mm shorter: C13 to E7 and D9 to E12.
    let layout = built_in("track-b").unwrap().layout;
    for (log, odd) in [
        ("choochoos_2020_track_a_train1_run.csv", 1),
        ("choochoos_2020_track_a_train1_stop.csv", 2),
        ("choochoos_2020_track_a_train24_run.csv", 1),
        // Too few laps for the times alone: the path lengths of the fitted train show it.
        ("choochoos_2020_track_a_train24_stop.csv", 2),
        ("choochoos_2020_track_a_train74_stop.csv", 0),
    ] {
        let batch = Batch::of_recordings(&layout, &[real(log)], None).unwrap();
        let test = batch.survey_test();
        assert!(!test.is_passed(), "{log}");
        assert_eq!(test.odd.len(), odd, "{log}: {test:?}");
        let replay = &batch.trains[0].replay;
        if replay.fit.model().train() == TRAIN {
            let (step, truth) = TRUTH[2];
            let speed = replay.fit.model().speed(SpeedStep::new(step).unwrap(), Approach::Below);
            let (found, sigma) = (speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s());
            assert!((found - truth).abs() < HALF_95 * sigma, "{log}: {found} ± {sigma}");
        }
    }
}
