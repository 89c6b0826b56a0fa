//! A train with 126 steps is calibrated in the time of one with 14 and stops as precisely where the step is free; from steps that
//! no calibration measured it stops where it says. Stations refuse what they cannot command, with a reason.

use crate::board::{SCRIPT, calibrated_over, driven, errors};
use crate::program::footplate;

const LINK: &str = "sim:track-a?faults=none&trains=24&steps=126&station=dcc-ex&seed=";

/// True errors (mm, rising) of the stops of a train of 126 steps that was calibrated in the same world, and promises broken.
fn stopped(seed: u64, script: &str) -> (Vec<f64>, usize) {
    let folder = calibrated_over(LINK, &format!("steps-{seed}"), seed);
    let (mut stops, broken) = errors(&driven(&folder, &format!("{LINK}{seed}"), script).1);
    stops.sort_by(f64::total_cmp);
    println!("seed {seed}: errors in mm: {stops:.1?}, {broken} promises of 95 % broken");
    (stops, broken)
}

#[test]
fn a_train_of_126_steps_stops_precisely_and_from_any_step_where_it_promises() {
    // Step 81 is step 9 of 14.
    let script = SCRIPT.replace("speed 24 9", "speed 24 81");
    let (mut free, mut broken) = stopped(7, &script);
    let (others, outside) = stopped(12, &script);
    free.extend(others);
    broken += outside;
    free.sort_by(f64::total_cmp);
    assert!(free.len() >= 10 && free[free.len() / 2] < 12.0 && free[free.len() - 1] < 40.0, "{free:?}");
    // None of these was measured, so they are less certain.
    let between =
        script.replace("C13+120mm", "C13+120mm at step 85").replace("E7+200mm", "E7+200mm at step 68");
    for seed in [10, 11] {
        let (stops, outside) = stopped(seed, &between);
        assert!(stops.len() >= 5, "{stops:?}");
        broken += outside;
    }
    assert!(broken <= 3, "{broken} promises of 95 % broken");
}

#[test]
fn what_a_station_cannot_command_is_refused_with_the_reason() {
    let refused = |link: &str, train: &str| {
        let run = footplate(&["drive", "--link", link, "--layout", "track-a", "--train", train]);
        assert_eq!(run.status, 2, "{}{}", run.output, run.errors);
        run.errors
    };
    for (link, train, reason) in [
        ("marklin-serial:/dev/null", "24:126", "train 24 has 126 speed steps, and a 6051 commands 14"),
        ("marklin-serial:/dev/null", "3850", "train 3850 has no address on a 6051; addresses are 1 to 80"),
        ("z21:127.0.0.1", "10000", "train 10000 has no address on a Z21; addresses are 1 to 9999"),
        ("dcc-ex:/dev/null", "24:27", "`27` is no number of decoder steps; decoders have 14, 28 or 126"),
        ("dcc-ex:/dev/null", "0", "`0` is no train: write its address"),
        (
            "sim:track-a?steps=126&station=dcc-ex",
            "24:14",
            "train 24 has 126 speed steps on this simulated layout",
        ),
        ("sim:track-a?steps=126", "24", "a 6051 commands 14: choose another station"),
    ] {
        let errors = refused(link, train);
        assert!(errors.contains(reason), "{link} {train}: {errors}");
    }
}
