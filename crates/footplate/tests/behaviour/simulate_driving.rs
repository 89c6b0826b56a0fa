//! `footplate simulate driving` scores drivers by a truth that none of them sees.

use serde_json::Value;

use crate::program::footplate;

/// Six trains, calibrated within a minute.
const ARGUMENTS: [&str; 7] = ["simulate", "driving", "--seeds", "3", "--budget", "60", "--json"];

fn percentile(scores: &Value, by: &str, what: &str) -> f64 {
    let rows = scores["rows"].as_array().unwrap();
    let all = rows.iter().find(|row| row["law"].is_null() && row["by"] == by).unwrap();
    all["figures"][what][1].as_f64().unwrap()
}

#[test]
fn the_same_worlds_are_driven_by_calibration_by_the_truth_and_as_courses_do() {
    let run = footplate(&ARGUMENTS);
    assert_eq!(run.status, 0, "{}", run.errors);
    let scores: Value = serde_json::from_str(&run.output).unwrap();
    let trains = scores["trains"].as_array().unwrap();
    assert_eq!(trains.len(), 6, "one for each law");
    // The budget, and what a train needs to come to rest.
    assert!(trains.iter().all(|train| train["calibration_s"].as_f64().unwrap() < 75.0));
    // Nobody beats the scatter of stops by knowing more, and knowing nothing costs.
    assert!(percentile(&scores, "oracle", "mid_stop_mm") < 30.0);
    assert!(
        percentile(&scores, "course project", "mid_stop_mm") > percentile(&scores, "oracle", "mid_stop_mm")
    );

    let one_thread = footplate(&[&ARGUMENTS[..], &["--threads", "1"]].concat());
    assert_eq!(one_thread.output, run.output, "whoever does the work, the result is the same");
}
