//! `footplate calibrate` on the real recordings, its store, and what it says to bad input.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{folder, footplate};

fn log(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/sensor-logs");
    folder.join(name).display().to_string()
}

fn train_24() -> [String; 2] {
    ["run", "stop"].map(|kind| log(&format!("choochoos_2020_track_a_train24_{kind}.csv")))
}

fn speed(calibration: &Value, step: u64, approach: &str) -> [f64; 2] {
    let steps = calibration["trains"][0]["steps"].as_array().expect("steps");
    let found = steps.iter().find(|speed| speed["step"] == step && speed["approach"] == approach);
    let speed = &found.unwrap_or_else(|| panic!("step {step} from {approach}"))["speed"];
    ["value", "uncertainty"].map(|name| speed[name].as_f64().expect("a number"))
}

#[test]
fn the_real_logs_of_train_24_give_the_speeds_their_readers_found_by_hand() {
    let [run, stop] = train_24();
    let done = footplate(&["calibrate", "--from", &run, &stop, "--layout", "track-a", "--json"]);
    assert_eq!(done.status, 0, "{}", done.errors);
    let calibration: Value = serde_json::from_str(&done.output).expect("JSON");
    // Published with the logs: 405 and 216 mm/s at steps 11 and 8, worked out from hop times by hand.
    for (step, published) in [(11, 405.0), (8, 216.0)] {
        let [value, uncertainty] = speed(&calibration, step, "below");
        assert!((value - published).abs() < 2.0 * uncertainty, "step {step}: {value} ± {uncertainty}");
        assert!(uncertainty < 0.02 * value, "step {step}: {value} ± {uncertainty}");
    }
    // Polled every 61.4 ms; the 65.35 ms between repeats, which the logs' README calls the period, are the
    // longer interval after a report.
    let period = calibration["polling"][0]["period"]["value"].as_f64().expect("a number");
    let after_report = calibration["polling"][0]["after_report_ms"].as_f64().expect("a number");
    assert!((period - 61.40).abs() < 0.02 && (after_report - 65.35).abs() < 0.1, "{period} {after_report}");
    let law = &calibration["trains"][0]["laws"][0];
    assert_eq!(law["direction"], "up");
    assert_eq!(law["best"]["law"]["family"]["law"], "constant_acceleration");
}

#[test]
fn every_number_can_be_traced_to_its_lines() {
    let [run, stop] = train_24();
    let logs = ["calibrate", "--from", &run, &stop, "--layout", "track-a", "--explain"];
    let ask = |number: &str| footplate(&[&logs[..], &[number]].concat());
    let speed = ask("SPEED:8");
    assert_eq!(speed.status, 0, "{}", speed.errors);
    // The hop E8 to C14 of run 7 took 62 idle polls and one after a report, told by line 189 of the log.
    assert!(speed.output.contains("choochoos_2020_track_a_train24_run:189"), "{}", speed.output);
    assert!(
        ask("STOP:14").output.contains("choochoos_2020_track_a_train24_stop:22"),
        "{}",
        ask("STOP:14").output
    );
    assert!(ask("LAW:up").output.contains("since_command_s"));
    assert!(ask("LENGTH:D9-E12").output.contains("mm to add to 369 mm"));
    for (number, advice) in [("SPEED:99999", "SPEED:14"), ("LENGTH:A1-E16", "no path leads from A1 to E16")] {
        let refused = ask(number);
        assert_eq!(refused.status, 2);
        assert!(refused.errors.contains(advice), "{}", refused.errors);
    }
}

#[test]
fn a_store_keeps_the_logs_once_and_calibrates_again_from_itself() {
    let folder = folder("calibrate-store");
    let store = folder.join("railway.db").display().to_string();
    let [run, stop] = train_24();
    let from = ["calibrate", "--from", &run, &stop, "--layout", "track-a", "--store", &store, "--json"];
    let first = footplate(&from);
    assert_eq!(first.status, 0, "{}", first.errors);
    let again = footplate(&from);
    assert!(again.errors.contains("in the store already"), "{}", again.errors);
    let from_store = footplate(&["calibrate", "--store", &store, "--layout", "track-a", "--json"]);
    let [one, two, three] = [&first, &again, &from_store]
        .map(|run| speed(&serde_json::from_str(&run.output).expect("JSON"), 14, "below"));
    assert_eq!(one, two);
    assert_eq!(one, three);
    // Before anything was stored there was nothing to calibrate from.
    let before = footplate(&["calibrate", "--store", &store, "--layout", "track-a", "--as-of", "2001-01-01"]);
    assert_eq!(before.status, 2);
    assert!(before.errors.contains("nothing to calibrate"), "{}", before.errors);
}

#[test]
fn a_calibration_is_written_whole_as_toml_and_json() {
    let folder = folder("calibrate-out");
    let [run, _] = train_24();
    for ending in ["toml", "json"] {
        let out = folder.join(format!("train24.{ending}"));
        let path = out.display().to_string();
        let done = footplate(&["calibrate", "--from", &run, "--layout", "track-a", "--out", &path]);
        assert_eq!(done.status, 0, "{}", done.errors);
        let text = fs::read_to_string(&out).expect("it was written");
        assert!(text.contains("model_version") && text.contains("mm/s"), "{text}");
    }
    let odd = folder.join("train24.xls").display().to_string();
    let refused = footplate(&["calibrate", "--from", &run, "--layout", "track-a", "--out", &odd]);
    assert_eq!(refused.status, 2);
    assert!(refused.errors.contains(".toml or .json"), "{}", refused.errors);
    assert!(!Path::new(&odd).exists());
}

#[test]
fn bad_input_is_answered_with_its_place_and_what_would_be_right() {
    let folder = folder("calibrate-bad");
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).expect("a test file");
        path.display().to_string()
    };
    let backwards = "t_s,kind,name,train,step\n1.0,speed,,24,8\n2.0,sensor,C13,,\n1.5,sensor,E7,,\n";
    // 437 to 875 mm in 1400 to 3100 s.
    let in_ms = "t_s,kind,name,train,step\n0,speed,,24,8\n2000,sensor,C13,,\n5100,sensor,E7,,\n6500,sensor,D7,,\n\
                 8100,sensor,D9,,\n9300,sensor,E12,,\n";
    let cases = [
        ("empty.csv", "", "empty"),
        ("columns.csv", "when,what\n1,2\n", "missing columns"),
        ("backwards.csv", backwards, "line 4"),
        ("sensor.csv", "t_s,kind,name,train,step\n1.0,speed,,24,8\n2.0,sensor,Z99,,\n", "Z99"),
        ("nan.csv", "t_s,kind,name,train,step\n1.0,speed,,24,8\nNaN,sensor,C13,,\n", "NaN"),
        ("milliseconds.csv", in_ms, "not in seconds"),
        ("standing.csv", "t_s,kind,name,train,step\n1.0,speed,,24,8\n", "nothing to calibrate"),
    ];
    for (name, text, says) in cases {
        let path = write(name, text);
        let refused = footplate(&["calibrate", "--from", &path, "--layout", "track-a"]);
        assert_eq!(refused.status, 2, "{name}: {}", refused.errors);
        assert!(refused.errors.contains(says), "{name}: {}", refused.errors);
    }
    let nothing = footplate(&["calibrate"]);
    assert_eq!(nothing.status, 2);
    for option in ["--link", "--from", "--store"] {
        assert!(nothing.errors.contains(option), "{option}: {}", nothing.errors);
    }
    let absent = footplate(&["calibrate", "--from", "absent.csv", "--layout", "track-a"]);
    assert_eq!(absent.errors.matches("(os error 2)").count(), 1, "said once: {}", absent.errors);
    let [run, _] = train_24();
    let missing = footplate(&["calibrate", "--from", &run, "--layout", "track-z"]);
    assert_eq!(missing.status, 2);
    assert!(missing.errors.contains("track-a"), "{}", missing.errors);
}
