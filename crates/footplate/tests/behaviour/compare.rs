//! `footplate compare` sets published figures beside ours, and says what is wrong with a table.

use std::path::{Path, PathBuf};

use crate::program::{footplate, written};

const LOG: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/sensor-logs/choochoos_2020_track_a_train24_run.csv");
const SPEEDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/published-tables/speeds.csv");
const STOPS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/published-tables/stops.csv");

/// A table of its own for each test.
fn table(name: &str, text: &str) -> PathBuf {
    written(&format!("compare-{name}.csv"), text)
}

fn compare(with: &[&str], more: &[&str]) -> crate::program::Run {
    let mut arguments = vec!["compare", LOG, "--layout", "track-a", "--train", "24", "--with"];
    arguments.extend(with);
    arguments.extend(more);
    footplate(&arguments)
}

#[test]
fn speeds_of_train_24_agree_with_three_teams() {
    let run = compare(&[SPEEDS, STOPS], &["--json"]);
    assert_eq!(run.status, 0, "{}", run.errors);
    let check: serde_json::Value = serde_json::from_str(&run.output).unwrap();
    let speeds = check["speeds_mm_per_s"].as_array().unwrap();
    // Three teams published speeds of train 24; every step from 4 to 14 has one of them at least.
    assert!(speeds.len() >= 20, "{}", speeds.len());
    for speed in speeds {
        assert_eq!(speed["train"], 24);
        // The statement of the data: speeds of one train differ between teams by 4 to 20 %.
        let percent = speed["difference_percent"].as_f64().unwrap();
        assert!(percent.abs() < 20.0 && speed["agrees"] == true, "{speed}");
    }
}

#[test]
fn the_page_and_the_table_tell_the_same_verdicts() {
    let page = compare(&[SPEEDS], &["--markdown"]).output;
    let table = compare(&[SPEEDS], &[]).output;
    assert!(page.starts_with("# ") && page.contains("| 24 | 14 |"), "{page}");
    let verdicts = |text: &str| text.matches("thechrisu/trains 2018").count();
    assert_eq!(verdicts(&page), verdicts(&table));
    assert!(verdicts(&page) > 5);
}

#[test]
fn wrong_tables_are_refused_with_their_place() {
    let header = "train,step,approach,speed_mm_s,team,term\n";
    let mistyped = table("mistyped", &format!("{header}24,14,below,fast,someone,2018\n"));
    let columns = table("columns", "train,level,v\n24,14,500\n");
    let alone = table("alone", &format!("{header}24,14,below,500,someone,2018\n"));
    let stranger = table("stranger", &format!("{header}24,1,,5,a,\n24,1,,6,b,\n"));
    let empty = table("empty", "");
    for (path, told) in [
        (mistyped.as_path(), "line 2, column 4 (speed_mm_s): `fast`"),
        (columns.as_path(), "counted_from"),
        (alone.as_path(), "give the tables of more teams"),
        (stranger.as_path(), "none of the 2 published figures"),
        (empty.as_path(), "is empty"),
        (Path::new("missing/speeds.csv"), "missing/speeds.csv: cannot be read"),
    ] {
        let run = compare(&[path.to_str().unwrap()], &[]);
        assert_eq!((run.status, run.output.as_str()), (2, ""), "{told}");
        assert!(run.errors.contains(told), "{told}: {}", run.errors);
    }
    let run = footplate(&["compare", "missing.csv", "--layout", "track-a", "--with", SPEEDS]);
    assert!(run.status == 2 && run.errors.contains("missing.csv"), "{}", run.errors);
}

#[test]
fn sessions_of_two_teams_with_the_same_engines_are_compared_step_by_step() {
    let logs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/sensor-logs/");
    let choochoos = [1, 74, 78].map(|train| format!("{logs}choochoos_2020_track_a_train{train}_run.csv"));
    let other = format!("{logs}eadanila_2020_track_a.csv");
    let mut arguments = vec!["compare"];
    arguments.extend(choochoos.iter().map(String::as_str));
    arguments.extend(["--layout", "track-a", "--session", &other, "--json"]);
    let run = footplate(&arguments);
    assert_eq!(run.status, 0, "{}", run.errors);
    let check: serde_json::Value = serde_json::from_str(&run.output).unwrap();
    let figures = check["speeds_mm_per_s"]["figures"].as_array().unwrap();
    assert!(figures.len() >= 9, "{}", figures.len());
    // The statement of the data: 1 % in the median, 10 % at worst.
    let mut percent: Vec<f64> =
        figures.iter().map(|figure| figure["difference_percent"].as_f64().unwrap().abs()).collect();
    percent.sort_by(f64::total_cmp);
    assert!(percent[percent.len() / 2] < 3.0 && percent[percent.len() - 1] < 12.0, "{percent:?}");
    // What sessions differ by is part of both uncertainties: about 1, and 9 figures of which one is an engine that lost a
    // tenth of its top speed in between. Without that part it was 2.6, at worst 7.6.
    let sigmas: Vec<f64> = figures.iter().map(|figure| figure["sigmas"].as_f64().unwrap()).collect();
    let rms = (sigmas.iter().map(|sigma| sigma * sigma).sum::<f64>() / sigmas.len() as f64).sqrt();
    assert!(rms < 1.5 && sigmas.iter().all(|sigma| sigma.abs() < 4.5), "{rms} rms, {sigmas:?}");
}
