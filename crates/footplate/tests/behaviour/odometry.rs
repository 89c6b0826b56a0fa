//! `footplate odometry` turns recordings into estimates, scores them, and answers a live input line by line.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use parquet::file::reader::{FileReader as _, SerializedFileReader};
use serde_json::Value;

use crate::program::{Run, folder, footplate};

const PLAIN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/tachometer/plain.csv");
const RUNS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/tachometer/runs.csv");

/// The fields of every score, as docs/formats/odometry-result.md names them.
const FIELDS: [&str; 15] = [
    "speed_rms_m_s",
    "speed_max_m_s",
    "distance_end_m",
    "distance_end_pct",
    "guaranteed_speed_inside_pct",
    "guaranteed_distance_inside_pct",
    "guaranteed_speed_width_m_s",
    "guaranteed_distance_width_m",
    "confidence_speed_inside_pct",
    "confidence_distance_inside_pct",
    "confidence_speed_width_m_s",
    "confidence_distance_width_m",
    "etcs_speed_violation_pct",
    "etcs_distance_violation_pct",
    "scored",
];

const HEADER: &str = "t_s,speed_m_s,confidence_speed_low_m_s,confidence_speed_high_m_s,guaranteed_speed_low_m_s,\
                      guaranteed_speed_high_m_s,accel_m_s2,distance_m,confidence_distance_low_m,confidence_distance_high_m,\
                      guaranteed_distance_low_m,guaranteed_distance_high_m,over_m,under_m,wheel_1,wheel_2,mode,share_1,share_2,share_3";

const VEHICLE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../footplate-store/vehicles/two-measured-wheelsets.toml");

fn odometry(arguments: &[&str]) -> Run {
    footplate(&[&["odometry", "--vehicle", VEHICLE], arguments].concat())
}

#[test]
fn without_a_vehicle_file_every_output_says_so_and_the_status_is_1() {
    let said = "no vehicle file";
    let table = footplate(&["odometry", PLAIN]);
    assert!(table.status == 1 && table.output.starts_with("WARNING: no vehicle file"), "{}", table.output);
    let json = footplate(&["odometry", PLAIN, "--json"]);
    let read: Value = serde_json::from_str(&json.output).unwrap();
    assert!(json.status == 1 && read["warnings"][0].as_str().unwrap().contains(said));
    let rows = footplate(&["odometry", PLAIN, "--out", "-"]);
    assert!(rows.status == 1 && rows.errors.contains(said) && !rows.output.contains(said));
    let file = folder("odometry-no-vehicle").join("result.parquet");
    let warning = |run: Run, status: i32| {
        assert_eq!(run.status, status, "{}", run.errors);
        let read = SerializedFileReader::new(File::open(&file).unwrap()).unwrap();
        let about = read.metadata().file_metadata().key_value_metadata().cloned().unwrap_or_default();
        about.into_iter().find(|entry| entry.key == "warning").and_then(|entry| entry.value)
    };
    let written = file.to_str().unwrap();
    assert!(warning(footplate(&["odometry", PLAIN, "--out", written]), 1).unwrap().contains(said));
    assert_eq!(warning(odometry(&[PLAIN, "--out", written]), 0), None);
    assert_eq!(odometry(&[PLAIN]).status, 0);
}

#[test]
fn a_train_faster_than_its_file_claims_is_reported() {
    let folder = folder("odometry-claims");
    let file =
        std::fs::read_to_string(VEHICLE).unwrap().replace("max_speed_m_s = 70.0", "max_speed_m_s = 5.0");
    let (vehicle, recording) = (folder.join("slow.toml"), folder.join("fast.csv"));
    std::fs::write(&vehicle, file).unwrap();
    // 15 pulses of 33.8 mm in 50 ms: 10.1 m/s.
    let rows: String = (0..100).map(|period| format!("{},15,15\n", 0.05 * f64::from(period))).collect();
    std::fs::write(&recording, format!("t_s,pulses_1,pulses_2\n{rows}")).unwrap();
    let [vehicle, recording] = [vehicle, recording].map(|path| path.display().to_string());
    let run = footplate(&["odometry", &recording, "--vehicle", &vehicle]);
    assert!(run.status == 1 && run.output.contains("faster than max_speed_m_s"), "{}", run.output);
}

#[test]
fn the_period_is_that_of_the_rows_where_the_file_claims_another() {
    // 30 pulses of 33.77 mm in 100 ms: 10.13 m/s, 1 km after 1000 rows. A claimed period of 50 ms made it 2 km.
    let recording = folder("odometry-period").join("slow-rows.csv");
    let rows: String = (0..=1000).map(|row| format!("{:.1},30,30\n", 0.1 * f64::from(row))).collect();
    std::fs::write(&recording, format!("t_s,pulses_1,pulses_2\n{rows}")).unwrap();
    let run = odometry(&[&recording.display().to_string(), "--out", "-"]);
    assert!(run.errors.contains("rows are 0.1000 s apart, and period_s says 0.0500"), "{}", run.errors);
    let last = run.output.lines().next_back().unwrap();
    let distance: f64 = last.split(',').nth(7).unwrap().parse().unwrap();
    assert!((distance - 1013.2).abs() < 1.5, "{distance} m");
}

#[test]
fn a_diameter_that_known_places_contradict_is_reported() {
    // 15 pulses in 50 ms are 0.5066 m by the claimed diameter; the train runs 0.532 m in that time, as a wheel 1.05 times as large.
    let recording = folder("odometry-diameter").join("places.csv");
    let row = |row: u32| {
        let place = row.is_multiple_of(1000).then(|| format!("{:.3}", f64::from(row) * 0.506_577 * 1.05));
        format!("{:.2},15,15,{}\n", 0.05 * f64::from(row), place.unwrap_or_default())
    };
    let rows: String = (0..=6000).map(row).collect();
    std::fs::write(&recording, format!("t_s,pulses_1,pulses_2,balise_m\n{rows}")).unwrap();
    let run = odometry(&[&recording.display().to_string()]);
    assert_eq!(run.status, 1, "{}", run.output);
    for wheelset in [1, 2] {
        let said = format!("wheelset {wheelset} is 1.05");
        assert!(run.output.contains(&said), "{}", run.output);
    }
}

#[test]
fn a_reader_that_goes_ends_the_program() {
    let recording = folder("odometry-pipe").join("long.csv");
    // More blocks than are in hand at a time.
    let rows: String = (0..40_000).map(|row| format!("{:.2},15,15\n", 0.05 * f64::from(row))).collect();
    std::fs::write(&recording, format!("t_s,pulses_1,pulses_2\n{rows}")).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_footplate"))
        .args(["odometry", &recording.display().to_string(), "--out", "-", "--vehicle", VEHICLE])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(first.starts_with("t_s,"), "{first}");
    // The pipe is closed now. Before, this waited for good.
    child.wait().expect("it ends");
}

#[test]
fn json_carries_the_score_of_all_presets_and_baselines() {
    let run = odometry(&[PLAIN, "--score", "--json"]);
    assert!(run.status < 2, "{}", run.errors);
    let score: Value = serde_json::from_str(&run.output).unwrap();
    assert_eq!(score["preset"], "recommended");
    for scored in [&score["overall"], &score["runs"][0]] {
        for ours in [scored, &scored["presets"]["paper"], &scored["presets"]["recommended"]] {
            assert!(FIELDS.iter().all(|field| ours[*field].is_number()), "{ours}");
            assert!(ours["detect_delay_s"].is_null(), "nothing slips");
        }
        for baseline in ["raw_mean", "raw_max", "wheels_only"] {
            let theirs = &scored["baselines"][baseline];
            assert!(FIELDS[..4].iter().all(|field| theirs[*field].is_number()), "{theirs}");
            assert!(theirs["guaranteed_speed_inside_pct"].is_null(), "it states no interval");
        }
    }
    assert_eq!(score["runs"][0]["periods"], 40);
    // The mean of two equal counts is off by less than a pulse (33.8 mm) at the end.
    let end = score["overall"]["baselines"]["raw_mean"]["distance_end_m"].as_f64().unwrap();
    assert!(end.abs() < 0.034, "{end}");
}

#[test]
fn estimates_come_in_the_columns_of_the_contract() {
    let folder = folder("odometry-results");
    let out = folder.join("result.csv").display().to_string();
    let run = odometry(&[PLAIN, "--out", &out]);
    assert_eq!((run.status, run.errors.as_str()), (0, ""));
    let text = std::fs::read_to_string(&out).unwrap();
    assert_eq!(text.lines().next(), Some(HEADER));
    assert_eq!(text.lines().count(), 41);
    assert!(text.lines().nth(2).unwrap().starts_with("0.05,"), "times are exact");
    // As Parquet, which the same reader tells by its first bytes and misses its columns in; other endings are refused.
    let parquet = folder.join("result.parquet").display().to_string();
    assert_eq!(odometry(&[PLAIN, "--out", &parquet]).status, 0);
    assert!(std::fs::read(&parquet).unwrap().starts_with(b"PAR1"));
    assert!(odometry(&[&parquet]).errors.contains("missing columns: pulses_1 (or counter_1), pulses_2"));
    std::fs::remove_file(&parquet).unwrap();
    let unknown = odometry(&[PLAIN, "--out", "result.xlsx"]);
    assert!(
        unknown.status == 2 && unknown.errors.contains("should end in .csv or .parquet"),
        "{}",
        unknown.errors
    );
    // The same on standard output, and nothing else.
    assert_eq!(odometry(&[PLAIN, "--out", "-"]).output, text);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside the result");
}

#[test]
fn runs_are_independent_of_each_other() {
    let folder = folder("odometry-runs");
    let [whole, part] = ["whole.csv", "part.csv"].map(|name| folder.join(name).display().to_string());
    assert_eq!(odometry(&[RUNS, "--out", &whole]).status, 0);
    // The rows of run b alone, as a recording of its own.
    let text = std::fs::read_to_string(RUNS).unwrap();
    let of_b: Vec<&str> = text.lines().filter(|line| !line.starts_with("a,")).collect();
    std::fs::write(&part, of_b.join("\n") + "\n").unwrap();
    let alone = odometry(&[&part, "--out", "-"]);
    let estimates = std::fs::read_to_string(&whole).unwrap();
    let of_b: Vec<&str> = estimates.lines().filter(|line| !line.ends_with(",a")).collect();
    assert_eq!(of_b.len(), 41);
    assert_eq!(alone.output.lines().collect::<Vec<_>>(), of_b);
    // Several files without names of runs are distinguished by their names.
    let both = odometry(&[PLAIN, PLAIN, "--out", "-"]).output;
    assert!(both.lines().next().unwrap().ends_with(",run_id"));
    assert_eq!(both.lines().filter(|line| line.ends_with("plain.csv")).count(), 80);
}

#[test]
fn a_live_input_is_answered_line_by_line() {
    let mut live = Command::new(env!("CARGO_BIN_EXE_footplate"))
        .args(["odometry", "-", "--out", "-", "--vehicle", VEHICLE])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut writer = live.stdin.take().unwrap();
    let mut answers = BufReader::new(live.stdout.take().unwrap()).lines();
    writer.write_all(b"t_s,pulses_1,pulses_2,wind\n0,0,0,1\n").unwrap();
    assert!(answers.next().unwrap().unwrap().starts_with("t_s,speed_m_s,"));
    assert!(answers.next().unwrap().unwrap().starts_with("0,"));
    for period in 1..20 {
        // Each line comes in two pieces and is answered before the next one is written.
        let line = format!("{}.{:02},15,15,1\n", period / 20, 5 * period);
        let (one, other) = line.split_at(3);
        writer.write_all(one.as_bytes()).unwrap();
        writer.flush().unwrap();
        writer.write_all(other.as_bytes()).unwrap();
        let answer = answers.next().unwrap().unwrap();
        let time: f64 = answer.split(',').next().unwrap().parse().unwrap();
        assert!((time - 0.05 * f64::from(period)).abs() < 1e-9, "{answer}");
    }
    drop(writer);
    assert!(answers.next().is_none());
    let end = live.wait_with_output().expect("it ends with its input");
    assert!(end.status.success());
    let said = String::from_utf8_lossy(&end.stderr).into_owned();
    assert_eq!(said, "standard input, line 1: columns that are not used: wind\n", "one warning");
}

#[test]
fn times_in_milliseconds_are_doubted() {
    let recording = folder("odometry-milliseconds").join("in-ms.csv");
    let rows: String = (1..200).map(|period| format!("{},3,3\n", 50 * period)).collect();
    std::fs::write(&recording, format!("t_s,pulses_1,pulses_2\n{rows}")).unwrap();
    let run = odometry(&[&recording.display().to_string()]);
    assert!(run.status == 1 && run.output.starts_with("WARNING: "), "{}", run.output);
    assert!(run.output.contains("198 of 199 periods follow a gap"), "{}", run.output);
}

#[test]
fn wrong_input_is_named_and_ends_with_status_2() {
    let folder = folder("odometry-wrong");
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let wrong = |arguments: &[&str], says: &str| {
        let run = odometry(arguments);
        assert_eq!((run.status, run.output.as_str()), (2, ""), "{arguments:?}");
        assert!(run.errors.contains(says), "{}", run.errors);
    };
    let bad_row = file("bad.csv", "t_s,pulses_1,pulses_2\n0,1,1\n0.05,fast,1\n");
    let out = folder.join("result.csv").display().to_string();
    wrong(
        &[&bad_row, "--out", &out],
        "bad.csv, line 3, column 2 (pulses_1): `fast` should be a whole number",
    );
    assert!(!Path::new(&out).exists(), "nothing is half written");
    wrong(&["no-such.csv"], "no-such.csv: cannot be read");
    wrong(&[&folder.display().to_string()], "it is a folder");
    wrong(&[RUNS, "--score"], "--score needs the truth");
    wrong(&[PLAIN, "--out", "-", "--json"], "--out - fills standard output");
    wrong(&["-", "-"], "there is only one standard input");
    let vehicle = file("train.toml", "max_speed = 70\n");
    let run = footplate(&["odometry", PLAIN, "--vehicle", &vehicle]);
    assert_eq!((run.status, run.output.as_str()), (2, ""));
    assert!(run.errors.contains("train.toml, line 1, column 1"), "{}", run.errors);
    wrong(&[PLAIN, "--out", "missing-folder/result.csv"], "writing missing-folder/result.csv");
}

#[test]
fn labels_say_the_probability_that_was_asked_for() {
    let page = folder("odometry-confidence").join("page.html").display().to_string();
    let run = odometry(&[PLAIN, "--score", "--confidence", "0.5", "--report", &page]);
    assert!(run.output.contains(" 50 %") && !run.output.contains("99.99 %"), "{}", run.output);
    let page = std::fs::read_to_string(&page).unwrap();
    assert!(page.contains("\"confidence_pct\":\"50\"") && !page.contains("99.99 % interval"));
    let usual = odometry(&[PLAIN, "--score"]);
    assert!(usual.output.contains(" 99.99 %"), "{}", usual.output);
    let run = odometry(&[PLAIN, "--confidence", "0.9999999999"]);
    assert_eq!(run.status, 2);
    assert!(run.errors.contains("between 0.5 and 0.999999999,"), "{}", run.errors);
}

#[test]
fn runs_of_one_name_in_two_files_are_named_by_file() {
    let folder = folder("odometry-same-runs");
    let copy = folder.join("copy.csv");
    std::fs::copy(RUNS, &copy).unwrap();
    let (copy, out) = (copy.display().to_string(), folder.join("out.csv"));
    let run = odometry(&[RUNS, &copy, "--out", &out.display().to_string()]);
    assert_ne!(run.status, 2, "{}", run.errors);
    let rows = std::fs::read_to_string(&out).unwrap();
    let names: std::collections::BTreeSet<&str> =
        rows.lines().skip(1).filter_map(|row| row.rsplit(',').next()).collect();
    let of_copy = names.iter().filter(|name| name.starts_with(copy.as_str())).count();
    assert_eq!(names.len(), 2 * of_copy, "{names:?}");
    // One file alone names its runs as it did.
    let run = odometry(&[RUNS, "--out", &out.display().to_string()]);
    assert_ne!(run.status, 2, "{}", run.errors);
    assert!(!std::fs::read_to_string(&out).unwrap().contains("runs.csv"));
}

#[test]
fn an_accelerometer_alone_has_no_preset_and_comes_from_a_file() {
    for (arguments, says) in [
        (&["a.csv", "--imu", "--preset", "paper"][..], "--preset"),
        (&["a.csv", "--imu", "--confidence", "0.9"], "--confidence"),
        (&["a.csv", "--imu", "--language", "de"], "--language"),
        (&["-", "--imu"], "--imu reads files, not standard input"),
    ] {
        let run = footplate(&[&["odometry"], arguments].concat());
        assert_eq!(run.status, 2, "{arguments:?}");
        assert!(run.errors.contains(says), "{arguments:?}: {}", run.errors);
    }
}
