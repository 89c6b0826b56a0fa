//! What recordings of real trains teach when they are imported into a store: the speeds and the stops that were measured
//! beside the track, not what another fit makes of the same reports.

use footplate_core::{Approach, SpeedStep, TrainId};
use footplate_store::{MotionReplay, built_in};

use crate::stores::{Shelf, import_new, minute};

/// Train; its steady speeds at steps 8 and 11 from hop times (mm/s, README of the recordings); and its stop from step 14 (mm):
/// the mean of what the tape said past E12, less what the train ran on in the 0.287 s between the middle of the
/// poll interval in which E12 closed and the command to stop.
const TRUTH: [(u16, [f64; 2], f64); 4] = [
    (1, [208.0, 391.0], 1155.0),
    (24, [216.0, 405.0], 1197.0),
    (74, [379.0, 535.0], 673.0),
    (78, [174.0, 332.0], 809.0),
];
/// Hop times scatter by a poll, and their mean by this part.
const HOPS: f64 = 0.015;
/// A tape is read to the centimetre, two stops scatter, and their mean is good to this (mm).
const TAPE: f64 = 15.0;

#[test]
fn imported_logs_teach_speeds_and_stops_as_they_were_measured() {
    let layout = built_in("track-a").unwrap().layout;
    let step = |number| SpeedStep::new(number).unwrap();
    for (train, speeds, stop) in TRUTH {
        let shelf = Shelf::new();
        let mut store = shelf.store();
        for (number, kind) in [(1, "run"), (2, "stop")] {
            import_new(
                &mut store,
                &format!("choochoos_2020_track_a_train{train}_{kind}.csv"),
                minute(number),
            );
        }
        let replay =
            MotionReplay::of_store(&layout, &mut store, TrainId(train), step(14), minute(1_000)).unwrap();
        let model = replay.fit.model();
        for (number, truth) in [8, 11].into_iter().zip(speeds) {
            let speed = model.speed(step(number), Approach::Below);
            let off = speed.value.as_mm_per_s() - truth;
            assert!(off.abs() < HOPS * truth, "train {train}, step {number}: {speed:?}");
            assert!(
                speed.uncertainty.as_mm_per_s() < HOPS * truth,
                "train {train}, step {number}: {speed:?}"
            );
        }
        let forecast = model.stop(step(14), Approach::Below);
        let (distance, doubt) = (forecast.distance.as_mm(), forecast.doubt.as_mm());
        assert_eq!(forecast.count, 2, "train {train}");
        assert!((distance - stop).abs() < 2.0 * doubt.hypot(TAPE), "train {train}: {distance} ± {doubt}");
        assert!((distance - stop).abs() < 0.03 * stop, "train {train}: {distance} ± {doubt}");
        assert!(doubt < 40.0, "train {train}: {distance} ± {doubt}");
    }
}
