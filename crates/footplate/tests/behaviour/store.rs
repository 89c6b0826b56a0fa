//! `footplate store` keeps what it is given, tells why numbers changed, and saves what it can.

use std::fs;
use std::path::Path;

use crate::program::{Run, folder, footplate};

fn log(name: &str) -> String {
    format!("{}/../../testdata/sensor-logs/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// `footplate store …` on the store of a folder.
fn store(folder: &Path, arguments: &[&str]) -> Run {
    let file = folder.join("railway.db");
    footplate(&[&["store", "--store", file.to_str().unwrap()], arguments].concat())
}

fn import(folder: &Path) -> Run {
    store(folder, &["import", &log("choochoos_2020_track_a_train24_run.csv")])
}

#[test]
fn a_log_is_imported_once_and_what_was_odd_is_said() {
    let folder = folder("store-import");
    let first = import(&folder);
    assert_eq!(first.status, 0, "{first:?}");
    assert!(first.output.ends_with("train24_run.csv: recording 1, 14 runs with 288 events\n"), "{first:?}");
    assert!(first.errors.contains("train24_run.csv, line 31: the timer restarts before run 2"), "{first:?}");
    let second = import(&folder);
    assert_eq!(second.status, 0);
    assert!(second.output.contains("in the store since ") && second.output.contains("nothing added"));
    let shown = store(&folder, &["show", "--json"]);
    let shown: serde_json::Value = serde_json::from_str(&shown.output).unwrap();
    assert_eq!(shown["recordings"].as_array().unwrap().len(), 1);
    assert_eq!(shown["recordings"][0]["event_count"], 288);
}

#[test]
fn a_wrong_log_among_right_ones_leaves_the_store_as_it_was() {
    let folder = folder("store-import-wrong");
    let wrong = folder.join("wrong.csv");
    fs::write(&wrong, "t_s,kind,name\n1.0,sensor,Z9\n").unwrap();
    let right = log("eadanila_2020_track_a.csv");
    let run = store(&folder, &["import", &right, wrong.to_str().unwrap()]);
    assert_eq!(run.status, 2);
    assert!(run.errors.contains("wrong.csv, line 2, column 3 (name): `Z9` should be "), "{}", run.errors);
    assert_eq!(run.output, "");
    assert!(!folder.join("railway.db").exists());
}

#[test]
fn an_event_is_excluded_with_a_reason_and_comes_back() {
    let folder = folder("store-exclude");
    import(&folder);
    let run = store(&folder, &["exclude", "2", "20-29", "--reason", "a child lifted the train"]);
    assert_eq!((run.status, run.output.as_str()), (0, "excluded 11 events: a child lifted the train\n"));
    let shown = store(&folder, &["show", "--recording", "1", "--events"]).output;
    let lines: Vec<&str> = shown.lines().filter(|line| line.contains("excluded 2")).collect();
    assert_eq!(lines.len(), 11, "{shown}");
    assert!(lines[0].contains("0.314 s  sensor A3; excluded"), "{}", lines[0]);
    assert!(lines[0].ends_with(": a child lifted the train"), "{}", lines[0]);

    let again = store(&folder, &["exclude", "2", "--reason", "again"]);
    assert_eq!(again.status, 2);
    assert_eq!(again.errors, "error: event 2 is excluded already: a child lifted the train\n");
    assert_eq!(store(&folder, &["restore", "2", "--reason", "it was another train"]).status, 0);
    let changes = store(&folder, &["changes"]).output;
    assert_eq!(changes.lines().count(), 13, "{changes}");
    assert!(changes.ends_with("event 2 was restored: it was another train\n"));
    assert_eq!(store(&folder, &["changes", "--until", "2001-01-01"]).output, "");
}

#[test]
fn what_is_not_there_or_not_understood_ends_with_status_two() {
    let folder = folder("store-usage");
    let missing = store(&folder, &["show"]);
    assert_eq!(missing.status, 2);
    assert!(missing.errors.contains("railway.db; `footplate store import` makes one"), "{}", missing.errors);
    import(&folder);
    for (arguments, complaint) in [
        (&["show", "--recording", "7"][..], "there is no recording 7"),
        (&["show", "--as-of", "yesterday"], "write a date such as 2026-11-21"),
        (&["show", "--recording", "1", "--as-of", "2001-01-01"], "was not in the store yet on 2001-01-01"),
        (&["exclude", "5-3", "--reason", "x"], "write the number of an event, or two as in 20-29"),
        (&["exclude", "3", "--reason", " "], "a mark needs a reason"),
        (&["restore", "3", "--reason", "x"], "event 3 was never excluded"),
    ] {
        let run = store(&folder, arguments);
        assert_eq!(run.status, 2, "{arguments:?}");
        assert!(run.errors.contains(complaint), "{arguments:?}: {}", run.errors);
    }
}

#[test]
fn a_damaged_store_says_so_and_is_salvaged() {
    let folder = folder("store-salvage");
    import(&folder);
    let path = folder.join("railway.db");
    let mut bytes = fs::read(&path).unwrap();
    let last_page = bytes.len() - 4096;
    bytes[last_page..].fill(0x55);
    fs::write(&path, &bytes).unwrap();

    let shown = store(&folder, &["show"]);
    assert_eq!(shown.status, 2);
    assert!(
        shown.errors.contains("is damaged") && shown.errors.contains("footplate store salvage"),
        "{shown:?}"
    );
    let out = folder.join("new.db");
    let salvaged = store(&folder, &["salvage", "--out", out.to_str().unwrap(), "--json"]);
    assert!(salvaged.status < 2, "{salvaged:?}");
    let report: serde_json::Value = serde_json::from_str(&salvaged.output).unwrap();
    assert_eq!(report["tables"]["runs"]["rows"], 14);
    let new = footplate(&["store", "show", "--store", out.to_str().unwrap()]);
    assert!(new.status == 0 && new.output.contains("new.db is sound: 1 recording, 14 runs"), "{new:?}");
    let again = store(&folder, &["salvage", "--out", out.to_str().unwrap()]);
    assert!(again.status == 2 && again.errors.contains("exists already"), "{again:?}");
}

#[test]
fn a_train_and_a_line_convert_to_the_own_form_and_that_to_itself() {
    let folder = folder("convert-described");
    let testdata = format!("{}/../../testdata", env!("CARGO_MANIFEST_DIR"));
    for (file, says) in [
        ("trains/trainruns_local.yaml", "train Regional Train, from format railtoolkit-rolling-stock\n"),
        ("lines/ttobench_CH_Fribourg_Bern.json", "line CH_Fribourg_Bern, from format ttobench-track\n"),
    ] {
        let [own, again] =
            ["own.toml", "again.toml"].map(|name| folder.join(name).to_str().unwrap().to_owned());
        let run = footplate(&["convert", &format!("{testdata}/{file}"), "--out", &own]);
        assert_eq!(run.status, 0, "{run:?}");
        assert!(run.output.ends_with(&format!("own.toml: {says}")), "{run:?}");
        let run = footplate(&["convert", &own, "--out", &again, "--json"]);
        assert_eq!(run.status, 0, "{run:?}");
        assert_eq!(fs::read(&own).unwrap(), fs::read(&again).unwrap());
    }
    let both = format!("{testdata}/lines/trainruns_const.yaml");
    let out = folder.join("none.toml").to_str().unwrap().to_owned();
    let own = folder.join("own.toml").display().to_string();
    for (more, says) in [
        (["--out", "train.json"].as_slice(), "let the name end with .toml"),
        (&["--out", &own, "--train", "24"], "--train is for sensor logs"),
        (&["--out", &own, "--layout", "track-a"], "--layout is for sensor logs"),
    ] {
        let refused = footplate(&[&["convert", &both], more].concat());
        assert_eq!(refused.status, 2, "{more:?}");
        assert!(refused.errors.contains(says), "{}", refused.errors);
    }
    let failed = footplate(&["convert", &both, "--out", &out, "--name", "other"]);
    assert!(failed.status == 2 && failed.errors.contains("there is no `other` in the file"), "{failed:?}");
    assert!(!folder.join("none.toml").exists());
}

#[test]
fn a_log_converts_to_the_own_form_and_that_to_itself() {
    let folder = folder("convert");
    let [own, again] = ["own.csv", "again.csv"].map(|name| folder.join(name).to_str().unwrap().to_owned());
    let run = footplate(&["convert", &log("choochoos_2020_track_a_train78_stop.csv"), "--out", &own]);
    assert_eq!(run.status, 0, "{run:?}");
    assert!(run.output.ends_with("own.csv: 4 runs with 167 events, from format since-command\n"), "{run:?}");
    assert_eq!(footplate(&["convert", &own, "--out", &again]).status, 0);
    assert_eq!(fs::read(&own).unwrap(), fs::read(&again).unwrap());

    let nowhere = folder.join("no folder/log.csv");
    let failed = footplate(&["convert", &own, "--out", nowhere.to_str().unwrap()]);
    assert!(failed.status == 2 && failed.errors.contains("writing "), "{failed:?}");
}

#[test]
fn what_a_browser_reads_leaves_the_store_as_it_is() {
    use std::io::Write;
    use std::process::{Command, Stdio};
    let folder = folder("store-clerk");
    let file = folder.join("railway.db");
    // One of an older version: a store that is opened to be written is migrated.
    let compat = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/compat/store-2.sqlite");
    fs::copy(compat, &file).unwrap();
    let before = fs::read(&file).unwrap();
    let track = concat!(env!("CARGO_MANIFEST_DIR"), "/../footplate-store/layouts/track-a.toml");
    let layout = fs::read_to_string(track).unwrap();
    let ask = |query: serde_json::Value| {
        let mut clerk = Command::new(env!("CARGO_BIN_EXE_footplate"))
            .arg("clerk")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let question = serde_json::json!({ "Store": { "path": &file, "layout": &layout, "query": query } });
        writeln!(clerk.stdin.take().unwrap(), "{question}").unwrap();
        let answer = clerk.wait_with_output().unwrap();
        assert!(answer.status.success(), "{answer:?}");
        serde_json::from_slice::<serde_json::Value>(&answer.stdout).unwrap()
    };
    assert!(ask("Recordings".into()).is_array() || ask("Recordings".into()).is_object());
    assert_eq!(fs::read(&file).unwrap(), before);
    ask(serde_json::json!({ "WithdrawSchedule": { "name": "Evening" } }));
    assert_ne!(fs::read(&file).unwrap(), before, "a change is written");
}
