//! `footplate report` writes one page that needs nothing else, the same for the same input, or no page at all.

use std::fs;
use std::path::Path;

use crate::program::{Run, folder, footplate};

const LOGS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/sensor-logs/");

fn log(name: &str) -> String {
    format!("{LOGS}choochoos_2020_track_a_{name}.csv")
}

fn report(log: &str, out: &Path) -> Run {
    footplate(&["report", log, "--layout", "track-a", "--train", "24", "--out", out.to_str().unwrap()])
}

/// The data that a page carries.
fn data(page: &str) -> serde_json::Value {
    let (_, rest) = page.split_once("id=\"report\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn a_page_holds_tables_and_data_of_the_same_numbers_and_is_the_same_twice() {
    let folder = folder("report/twice");
    let (one, two) = (folder.join("one.html"), folder.join("two.html"));
    let run = report(&log("train24_run"), &one);
    assert_eq!(run.status, 0, "{}", run.errors);
    assert!(run.output.starts_with("train 24: "), "{}", run.output);
    report(&log("train24_run"), &two);
    let page = fs::read_to_string(&one).unwrap();
    assert!(page == fs::read_to_string(&two).unwrap(), "the same input made another page");

    let data = data(&page);
    let train = &data["trains"][0];
    let steps = train["calibration"]["steps"].as_array().unwrap();
    let is_measured = |step: &&serde_json::Value| step["speed"]["measurements"].as_u64() > Some(1);
    let speed = steps.iter().rfind(is_measured).unwrap();
    let shown = format!("{:.1} ± ", speed["speed"]["value"].as_f64().unwrap());
    assert!(page.contains(&shown), "{shown}");
    for address in ["src=\"http", "href=\"http", "@import", "url(http"] {
        assert!(!page.contains(address), "the page asks for {address}");
    }
}

#[test]
fn the_law_runs_through_its_contacts_and_residuals_are_what_is_left() {
    let out = folder("report/law").join("report.html");
    report(&log("train24_run"), &out);
    let data = data(&fs::read_to_string(out).unwrap());
    let changes = data["trains"][0]["changes"].as_array().unwrap();
    assert!(changes.len() >= 3, "{}", changes.len());
    for change in changes {
        let curve = |name: &str| -> Vec<f64> {
            change[name].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
        };
        let (times, ways, speeds) = (curve("time_s"), curve("way_mm"), curve("speed_mm_s"));
        // The way is the integral of the speed: the trapezoidal rule is good to a millimetre here.
        let mut way = ways[0];
        for place in 1..times.len() {
            way += 0.5 * (speeds[place] + speeds[place - 1]) * (times[place] - times[place - 1]);
        }
        assert!((way - ways[ways.len() - 1]).abs() < 5.0, "{way} {}", ways[ways.len() - 1]);
        for contact in change["contacts"].as_array().unwrap() {
            let number = |name: &str| contact[name].as_f64().unwrap();
            let after = times.partition_point(|time| *time < number("time_s")).clamp(1, times.len() - 1);
            let part = (number("time_s") - times[after - 1]) / (times[after] - times[after - 1]);
            let law = ways[after - 1] + part * (ways[after] - ways[after - 1]);
            assert!((number("way_mm") - law - number("residual_mm")).abs() < 1.0, "{contact}");
        }
    }
}

#[test]
#[cfg(unix)]
fn a_name_that_looks_like_markup_stays_text() {
    let folder = folder("report/markup");
    let hostile = folder.join("<script>alert(1)&.csv");
    fs::copy(log("train24_run"), &hostile).unwrap();
    let out = folder.join("report.html");
    let run = report(hostile.to_str().unwrap(), &out);
    assert_eq!(run.status, 0, "{}", run.errors);
    let page = fs::read_to_string(out).unwrap();
    assert!(!page.contains("<script>alert") && page.contains("&lt;script&gt;alert(1)&amp;"));
    assert_eq!(data(&page)["polling"][0]["recording"], "<script>alert(1)&");
}

#[test]
fn a_store_makes_the_same_page_as_the_log_in_it() {
    let folder = folder("report/store");
    let store = folder.join("railway.db");
    let (from_log, from_store) = (folder.join("log.html"), folder.join("store.html"));
    let log = log("train24_run");
    let kept = footplate(&[
        "calibrate",
        "--from",
        &log,
        "--layout",
        "track-a",
        "--train",
        "24",
        "--store",
        store.to_str().unwrap(),
    ]);
    assert_eq!(kept.status, 0, "{}", kept.errors);
    report(&log, &from_log);
    let run = footplate(&[
        "report",
        "--store",
        store.to_str().unwrap(),
        "--layout",
        "track-a",
        "--out",
        from_store.to_str().unwrap(),
    ]);
    assert_eq!(run.status, 0, "{}", run.errors);
    let tables = |path: &Path| {
        let page = fs::read_to_string(path).unwrap();
        page.split_once("<main>").unwrap().1.split_once("<script").unwrap().0.to_owned()
    };
    assert_eq!(tables(&from_log), tables(&from_store));
}

#[test]
fn what_is_wrong_leaves_no_page_and_an_old_one_as_it_was() {
    let folder = folder("report/wrong");
    let out = folder.join("report.html");
    fs::write(&out, "old").unwrap();
    let columns = folder.join("columns.csv");
    fs::write(&columns, "a,b\n1,2\n").unwrap();
    let empty = folder.join("empty.csv");
    fs::write(&empty, "").unwrap();
    for (path, told) in [
        (Path::new("missing.csv"), "missing.csv"),
        (columns.as_path(), "missing columns"),
        (empty.as_path(), "is empty"),
    ] {
        let run = report(path.to_str().unwrap(), &out);
        assert_eq!((run.status, run.output.as_str()), (2, ""), "{told}");
        assert!(run.errors.contains(told), "{told}: {}", run.errors);
        assert_eq!(fs::read_to_string(&out).unwrap(), "old");
    }
    let nowhere = folder.join("nowhere/report.html");
    let run = report(&log("train24_run"), &nowhere);
    assert!(
        run.status == 2 && run.errors.contains("writing") && run.errors.contains("nowhere"),
        "{}",
        run.errors
    );
    let store = footplate(&["report", "--store", "missing.db", "--layout", "track-a", "--out", "x.html"]);
    assert!(store.status == 2 && store.errors.contains("missing.db"), "{}", store.errors);
    assert_eq!(footplate(&["report", "--layout", "track-a", "--out", "x.html"]).status, 2);
}

#[test]
fn a_page_is_read_in_german_and_holds_the_same_numbers() {
    let folder = folder("report/german");
    let (english, german) = (folder.join("english.html"), folder.join("german.html"));
    let log = log("train24_run");
    report(&log, &english);
    let asked = ["report", &log, "--layout", "track-a", "--train", "24", "--language", "de", "--out"];
    let run = footplate(&[&asked[..], &[german.to_str().unwrap()]].concat());
    assert_eq!(run.status, 0, "{}", run.errors);
    assert!(run.output.starts_with("Zug 24: "), "{}", run.output);
    let page = |path: &Path| fs::read_to_string(path).unwrap();
    let (english, german) = (page(&english), page(&german));
    for word in ["lang=\"de\"", "Tempo je Fahrstufe", "Vorhersagefehler", "Verdächtige Messungen", "erklärt"]
    {
        assert!(german.contains(word), "{word}");
    }
    let body = |page: &str| page.split_once("<main>").unwrap().1.split_once("<script").unwrap().0.to_owned();
    for word in ["throttle step", "reached from", "getting", "surveyed", "nothing out", "mm now"] {
        assert!(body(&english).contains(word) && !body(&german).contains(word), "{word}");
    }
    let digits = |page: &str| {
        let shown: String =
            body(page).chars().map(|c| if "0123456789.".contains(c) { c } else { ' ' }).collect();
        shown.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(digits(&english), digits(&german));
}
