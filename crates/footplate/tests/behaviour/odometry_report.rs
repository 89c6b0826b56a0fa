//! `footplate odometry --report` draws what the odometer said: the same numbers as the result, and bounds never narrower.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{folder, footplate};

const PLAIN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/tachometer/plain.csv");
const RUNS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/tachometer/runs.csv");

const VEHICLE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../footplate-store/vehicles/two-measured-wheelsets.toml");

/// Half of the last digit that a page has, and a little for the rounding of decimals.
const HALF_DIGIT: f64 = 0.000_501;

/// The page of a recording, and the data in it.
fn page(recording: &str, out: &Path) -> (String, Value) {
    let run = footplate(&["odometry", "--vehicle", VEHICLE, recording, "--report", out.to_str().unwrap()]);
    assert_eq!(run.status, 0, "{}", run.errors);
    assert!(!run.output.contains("against the truth"), "a score is printed only if it is asked for");
    let html = fs::read_to_string(out).unwrap();
    let (_, rest) = html.split_once("id=\"report\">").unwrap();
    let data = serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap();
    (html, data)
}

fn numbers(values: &Value) -> Vec<f64> {
    values.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
}

/// A column of a CSV file by its name.
fn column(csv: &str, name: &str) -> Vec<f64> {
    let place = csv.lines().next().unwrap().split(',').position(|column| column == name).unwrap();
    csv.lines().skip(1).map(|row| row.split(',').nth(place).unwrap().parse().unwrap()).collect()
}

#[test]
fn a_page_is_read_in_german_where_that_is_asked_for() {
    let out = folder("odometry-report/german").join("page.html");
    let out = out.to_str().unwrap();
    let run = footplate(&["odometry", "--vehicle", VEHICLE, PLAIN, "--report", out, "--language", "de"]);
    assert_eq!(run.status, 0, "{}", run.errors);
    let html = fs::read_to_string(out).unwrap();
    for word in ["lang=\"de\"", "Odometrie von plain.csv", "die Wahrheit blieb in den Grenzen"] {
        assert!(html.contains(word), "{word}");
    }
    assert_eq!(
        footplate(&["odometry", "--vehicle", VEHICLE, PLAIN, "--report", out, "--language", "fr"]).status,
        2
    );
}

#[test]
fn lines_are_the_result_and_bounds_are_no_narrower() {
    let folder = folder("odometry-report/lines");
    let (_, data) = page(PLAIN, &folder.join("page.html"));
    let result = footplate(&["odometry", "--vehicle", VEHICLE, PLAIN, "--out", "-"]).output;
    let recording = fs::read_to_string(PLAIN).unwrap();
    let shown = |name: &str| numbers(&data["runs"][0]["lines"][name]);
    let gone = column(&recording, "true_distance_m");
    assert_eq!(numbers(&data["runs"][0]["time_s"]), column(&recording, "t_s"));
    let near = |shown: Vec<f64>, said: Vec<f64>, what: &str| {
        assert_eq!((shown.len(), said.len()), (40, 40), "{what}");
        for (row, (shown, said)) in shown.iter().zip(&said).enumerate() {
            assert!((shown - said).abs() <= HALF_DIGIT, "{what}, row {row}: {shown} for {said}");
        }
    };
    for (line, of_result) in
        [("speed_m_s", "speed_m_s"), ("accel_m_s2", "accel_m_s2"), ("share_1", "share_1")]
    {
        near(shown(line), column(&result, of_result), line);
    }
    near(shown("true_speed_m_s"), column(&recording, "true_speed_m_s"), "true speed");
    let less_gone = |way: &str| -> Vec<f64> {
        column(&result, way).iter().zip(&gone).map(|(way, gone)| way - gone).collect()
    };
    near(shown("error_m"), less_gone("distance_m"), "error");
    for (line, said, outwards) in [
        ("confidence_speed_low_m_s", column(&result, "confidence_speed_low_m_s"), -1.0),
        ("confidence_speed_high_m_s", column(&result, "confidence_speed_high_m_s"), 1.0),
        ("guaranteed_error_low_m", less_gone("guaranteed_distance_low_m"), -1.0),
        ("guaranteed_error_high_m", less_gone("guaranteed_distance_high_m"), 1.0),
    ] {
        for (row, (shown, said)) in shown(line).iter().zip(&said).enumerate() {
            let beyond = outwards * (shown - said);
            assert!((-1e-9..=2.0 * HALF_DIGIT).contains(&beyond), "{line}, row {row}: {shown} for {said}");
        }
    }
    // 15 pulses of 33.77 mm in a period, or 14: never more than a fifth of a pulse a period off 10 m/s.
    for wheel in ["wheel_1_m_s", "wheel_2_m_s"] {
        let values = data["runs"][0]["lines"][wheel].as_array().unwrap();
        assert!(values[0].is_null(), "the first row has no period");
        let settled = values[5..].iter().map(|value| value.as_f64().unwrap());
        assert!(settled.into_iter().all(|speed| (speed - 10.0).abs() < 0.033_77 / 0.25), "{values:?}");
    }
}

#[test]
fn runs_have_their_names_and_without_truth_widths_instead_of_errors() {
    let folder = folder("odometry-report/runs");
    let (html, data) = page(RUNS, &folder.join("page.html"));
    let runs = data["runs"].as_array().unwrap();
    assert_eq!(runs.iter().map(|run| run["name"].as_str().unwrap()).collect::<Vec<_>>(), ["a", "b"]);
    assert_eq!(runs[1]["begin_s"], 1.0);
    for run in runs {
        let lines = run["lines"].as_object().unwrap();
        assert!(lines.contains_key("width_m") && lines.contains_key("under_m"));
        assert!(!lines.contains_key("error_m") && !lines.contains_key("true_speed_m_s"));
        assert!(!lines.contains_key("effort") && !lines.contains_key("measured_accel_m_s2"));
    }
    assert!(!html.contains("Against the truth"));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside the page");
    assert_eq!(page(RUNS, &folder.join("again.html")).0, html, "the same input makes the same bytes");
}

#[test]
fn a_long_recording_has_few_points_and_all_its_peaks() {
    let folder = folder("odometry-report/long");
    let recording = folder.join("long.csv");
    // Four minutes at 10 m/s; in one period the first wheel counts three times as much as in any other.
    let mut rows = String::from("t_s,pulses_1,pulses_2\n");
    for row in 0..4801_u32 {
        let pulses = if row == 3001 { 45 } else { 15 };
        rows.push_str(&format!("{:.2},{pulses},15\n", f64::from(row) * 0.05));
    }
    fs::write(&recording, rows).unwrap();
    let (_, data) = page(recording.to_str().unwrap(), &folder.join("page.html"));
    let run = &data["runs"][0];
    let times = numbers(&run["time_s"]);
    assert!(times.len() <= 4000, "{} points", times.len());
    assert_eq!((times.first(), times.last()), (Some(&0.0), Some(&240.0)));
    let wheel = run["lines"]["wheel_1_m_s"].as_array().unwrap();
    let top = wheel.iter().filter_map(Value::as_f64).fold(0.0, f64::max);
    // 105 pulses in five periods.
    let peak = 105.0 * std::f64::consts::PI * 0.86 / 80.0 / 0.25;
    assert!((top - peak).abs() < HALF_DIGIT, "{top} for {peak}");
}

#[test]
fn a_page_that_cannot_be_written_is_an_error() {
    let folder = folder("odometry-report/missing");
    let run = footplate(&[
        "odometry",
        "--vehicle",
        VEHICLE,
        PLAIN,
        "--report",
        folder.join("none/page.html").to_str().unwrap(),
    ]);
    assert_eq!(run.status, 2);
    assert!(run.errors.contains("page.html"), "{}", run.errors);
}
