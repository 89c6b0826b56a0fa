//! `footplate simulate zones` scores how well trains keep to speed restrictions by a truth that they never see.

use serde_json::Value;

use crate::program::footplate;

const ARGUMENTS: [&str; 6] = ["simulate", "zones", "--seeds", "3..5", "--budget", "120"];

#[test]
fn trains_keep_to_zones_whatever_they_are_told_and_do_not_where_nobody_said_that_there_are_any() {
    let run = footplate(&[&ARGUMENTS[..], &["--json"]].concat());
    assert_eq!(run.status, 0, "{}", run.errors);
    let scores: Value = serde_json::from_str(&run.output).unwrap();
    let rides = scores["rides"].as_array().unwrap();
    // Three railways, three trains, six things to do.
    assert_eq!(rides.len(), 54);
    let too_fast = |heeding: bool| {
        let rides = rides.iter().filter(move |ride| (ride["order"] != "speed, without zones") == heeding);
        let passages: Vec<f64> = rides
            .flat_map(|ride| ride["passages"].as_array().unwrap())
            .map(|passage| {
                passage["fastest_mm_s"].as_f64().unwrap() / passage["limit_mm_s"].as_f64().unwrap()
            })
            .collect();
        assert!(passages.len() > 90, "{} passages", passages.len());
        passages.iter().filter(|part| **part > 1.0).count() as f64 / passages.len() as f64
    };
    // One in a hundred may be for its place, one for its speed; of some hundred passages a few more are no surprise.
    assert!(too_fast(true) < 0.05, "{}", too_fast(true));
    assert!(too_fast(false) > 0.9, "{}", too_fast(false));
}
