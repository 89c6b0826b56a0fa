//! `footplate simulate pacing` scores trains that keep to a pace by a truth that they never see.

use serde_json::Value;

use crate::program::footplate;

const ARGUMENTS: [&str; 6] = ["simulate", "pacing", "--seed", "2", "--budget", "120"];

#[test]
fn a_held_speed_is_nearer_to_what_was_asked_than_any_step_and_stays_within_its_commands() {
    let run = footplate(&[&ARGUMENTS[..], &["--json"]].concat());
    assert_eq!(run.status, 0, "{}", run.errors);
    let scores: Value = serde_json::from_str(&run.output).unwrap();
    let held = scores["held"].as_array().unwrap();
    let of = |by: &'static str| held.iter().filter(move |run| run["by"] == by);
    // Three trains, two speeds each.
    assert_eq!((of("footplate").count(), of("nearest step").count()), (6, 6));
    // Never more than three commands in two seconds.
    assert!(of("footplate").all(|run| run["commands_per_s"].as_f64().unwrap() <= 1.5));
    let worst = |by| of(by).map(|run| run["place_off_mm_most"].as_f64().unwrap()).fold(0.0, f64::max);
    assert!(worst("footplate") < 0.2 * worst("nearest step"));

    let one_thread = footplate(&[&ARGUMENTS[..], &["--json", "--threads", "1"]].concat());
    assert_eq!(one_thread.output, run.output, "whoever does the work, the result is the same");
}
