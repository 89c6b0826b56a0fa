//! `footplate simulate line` writes recordings that give an odometer what the simulated run itself gives it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::program::{Run, footplate};

const TRAIN: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/trains/ttobench_CN_Beijing_Subway.json");
const LINE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/lines/ttobench_CN_Songjiazhuang_Yizhuang.json");

/// A folder of this test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    folder
}

fn simulate(more: &[&str]) -> Run {
    footplate(&[&["simulate", "line"], more].concat())
}

fn simulate_to(folder: &Path, more: &[&str]) -> Run {
    simulate(&[&["--out", folder.to_str().expect("a folder with a plain name")], more].concat())
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn the_list_names_every_scenario_with_what_happens_in_it() {
    let run = simulate(&["--list"]);
    assert_eq!((run.status, run.output.lines().count()), (0, 25));
    assert!(run.output.contains("S1   one wheelset slides under slide protection, from 37.5 s on\n"));
}

#[test]
fn the_same_seed_writes_the_same_bytes_and_another_seed_others() {
    for form in ["csv", "parquet"] {
        let folders = ["line-once", "line-again"].map(|name| folder(&format!("{name}-{form}")));
        for (folder, threads) in folders.iter().zip(["1", "3"]) {
            let run = simulate_to(
                folder,
                &[
                    "--scenario",
                    "s6,N5",
                    "--seed",
                    "1..2",
                    "--format",
                    form,
                    "--threads",
                    threads,
                    "--inertial",
                ],
            );
            assert_eq!((run.status, run.errors.as_str()), (0, ""));
        }
        let mut names = Vec::new();
        for entry in fs::read_dir(&folders[0]).unwrap() {
            let name = entry.unwrap().file_name();
            let [once, again] = folders.each_ref().map(|folder| fs::read(folder.join(&name)).unwrap());
            assert!(once == again, "{} differs", name.display());
            names.push(name.into_string().unwrap());
        }
        names.sort_unstable();
        let expected = ["N5-1", "N5-2", "S6-1", "S6-2"]
            .map(|run| [format!("{run}.{form}"), format!("{run}.toml")])
            .concat();
        assert_eq!(names.len(), 8, "nothing unfinished is left");
        assert!(expected.iter().all(|name| names.contains(name)), "{names:?}");
        let bytes = |name: &str| fs::read(folders[0].join(name)).unwrap();
        assert!(bytes(&format!("N5-1.{form}")) != bytes(&format!("N5-2.{form}")), "seeds differ");
    }
}

#[test]
fn a_recording_gets_the_score_that_the_run_itself_gets() {
    let names = ["S1", "S2", "N6", "F8", "F9"];
    let chosen = ["--scenario", "S1,S2,N6,F8,F9", "--seed", "7", "--teeth", "80", "--inertial"];
    let scored = simulate(&[&["--score", "--json"], &chosen[..]].concat());
    assert!(scored.status < 2, "{}", scored.errors);
    let scored = json(&scored.output);
    for form in ["csv", "parquet"] {
        let folder = folder(&format!("line-scores-{form}"));
        let written = simulate_to(&folder, &[&["--format", form], &chosen[..]].concat());
        assert_eq!((written.status, written.errors.as_str()), (0, ""));
        for (at, name) in names.into_iter().enumerate() {
            let path = |ending: &str| folder.join(format!("{name}-7.{ending}")).display().to_string();
            let read = footplate(&["odometry", &path(form), "--vehicle", &path("toml"), "--score", "--json"]);
            assert!(read.status < 2, "{}", read.errors);
            let (read, itself) = (&json(&read.output)["runs"][0], &scored["runs"][at]);
            assert_eq!(itself["scenario"], name);
            for preset in ["paper", "recommended"] {
                assert_eq!(read["presets"][preset], itself["scores"][preset], "{name} {form} {preset}");
            }
            for rival in ["raw_mean", "raw_max", "wheels_only"] {
                assert_eq!(read["baselines"][rival], itself["scores"][rival], "{name} {form} {rival}");
            }
            assert!(itself["scores"]["recommended"]["speed_rms_m_s"].as_f64().unwrap() > 0.0);
        }
    }
}

#[test]
fn the_table_is_the_same_however_many_work_on_it_and_counts_every_run() {
    let table = |threads| {
        let run = simulate(&[
            "--score",
            "--markdown",
            "--scenario",
            "N5,S1,S6,F3",
            "--seeds",
            "1..3",
            "--teeth",
            "80,200",
            "--threads",
            threads,
        ]);
        assert!(run.status < 2, "{}", run.errors);
        run.output
    };
    let page = table("1");
    assert_eq!(page, table("3"));
    assert!(page.starts_with("# "));
    assert!(page.contains("--score --seeds 1..3 --teeth 80,200 --scenario N5,S1,S6,F3 --markdown"));
    for (family, runs) in [("N5", 6), ("S1", 6), ("S6", 6), ("F3", 6), ("all", 24)] {
        assert!(page.contains(&format!("\n| {family} | {runs} |")), "{page}");
    }
    for group in ["N", "S", "F"] {
        let rows = page.lines().filter(|line| line.starts_with(&format!("| {group} | "))).count();
        assert_eq!(rows, 5, "both presets and three baselines: {page}");
    }
}

#[test]
fn each_interval_stands_beside_its_own_width_and_what_it_held() {
    let chosen = ["--score", "--scenario", "S1", "--seed", "7", "--teeth", "80"];
    let family = json(&simulate(&[&["--json"], &chosen[..]].concat()).output);
    let scores = &family["runs"][0]["scores"]["recommended"];
    let score = |key: &str| scores[key].as_f64().unwrap();
    assert!(score("confidence_speed_width_m_s") < 0.5 * score("guaranteed_speed_width_m_s"));
    let width = |interval: &str| format!("{0:.2} / {0:.2}", score(&format!("{interval}_speed_width_m_s")));
    let inside = |interval: &str, what: &str| {
        format!("{:.4}", (score(&format!("{interval}_{what}_inside_pct")) * 1e4).floor() / 1e4)
    };
    let columns = [
        width("guaranteed"),
        inside("guaranteed", "speed"),
        "1 of 1".to_owned(),
        width("confidence"),
        inside("confidence", "speed"),
        inside("confidence", "distance"),
    ]
    .join(" | ");
    let page = simulate(&[&["--markdown"], &chosen[..]].concat()).output;
    let heads =
        "| guaranteed m/s | guaranteed % | distance inside | 99.99 % m/s | 99.99 % | distance 99.99 % |";
    assert_eq!(page.matches(heads).count(), 2, "{page}");
    // The family, and both presets beside others: they share their intervals.
    assert_eq!(page.matches(&format!("| {columns} |")).count(), 3, "{columns}\n{page}");
}

#[test]
fn the_worst_ten_worlds_are_ten_worlds_and_faults_have_a_table_of_their_own() {
    let worlds = ["--score", "--worlds", "1..11"];
    let page = simulate(&[&["--markdown"], &worlds[..]].concat()).output;
    let (tables, worst) = page.split_once("## The worst").unwrap();
    let seed = |line: &str| line.strip_prefix("| ")?.split(" | ").next()?.parse::<u64>().ok();
    let seeds: BTreeSet<u64> = worst.lines().filter_map(seed).collect();
    assert_eq!(seeds.len(), 10, "{worst}");
    let scored = json(&simulate(&[&["--json", "--level", "L1"], &worlds[..]].concat()).output);
    let of_all = scored["worlds"].as_array().unwrap();
    assert!(of_all.iter().all(|world| world["worst_mechanism"].as_str().unwrap().contains("; train at ")));
    let is = |world: &Value, key: &str| world[key].as_bool().unwrap();
    let without =
        of_all.iter().filter(|world| is(world, "without_faults") && is(world, "claims_hold")).count();
    assert!((1..11).contains(&without), "some have faults, some have none: {without}");
    let counted = scored["levels_without_faults"]["L1"]["worlds"].as_u64().unwrap();
    assert_eq!(counted as usize, without);
    for (heading, levels) in
        [("## Worlds whose claims hold", "levels_without_faults"), ("## All worlds", "levels")]
    {
        let rolling = &scored[levels]["L1"]["phases"]["rolling"];
        let rms = |odometer: &str| rolling[odometer]["speed_rms_m_s"].as_f64().unwrap();
        let row = format!(
            "\n| L1 | rolling | {} | {:.3} | {:.3} |",
            rolling["recommended"]["scored"],
            rms("recommended"),
            rms("oracle")
        );
        let (_, table) = tables.split_once(heading).unwrap();
        assert!(table.contains(&row), "{row}\n{page}");
    }
}

#[test]
fn any_train_runs_on_any_line() {
    let folder = folder("line-service");
    let run = simulate_to(&folder, &["--train", TRAIN, "--line", LINE, "--json"]);
    assert_eq!((run.status, run.errors.as_str()), (0, ""));
    let written = json(&run.output);
    // From Songjiazhuang to Yizhuang it is 22.7 km, less what trains leave at either end.
    let way = written["distance_m"].as_f64().unwrap();
    assert!((20e3..23e3).contains(&way), "{way} m");
    let path = |key: &str| written[key].as_str().unwrap();
    let read = footplate(&["odometry", path("recording"), "--vehicle", path("vehicle"), "--score", "--json"]);
    assert!(read.status < 2, "{}", read.errors);
    let off = json(&read.output)["overall"]["distance_end_pct"].as_f64().unwrap();
    assert!(off.abs() < 0.3, "{off} %");
}

#[test]
fn what_is_wrong_is_said_with_what_would_be_right() {
    let folder = folder("line-wrong");
    for (arguments, expected) in [
        (&["--scenario", "S99"][..], "there is no scenario `S99`; there are N1, N2,"),
        (&["--scenario", "S1", "--seed", "9..1"][..], "it should be 1..9"),
        (&["--scenario", "S1", "--teeth", "0"][..], "0 is not in 1..=10000"),
        (&["--scenario", "S1", "--period", "2"][..], "a number of seconds between 0.001 and 1"),
        (&["--scenario", "S1", "--teeth", "80,100"][..], "give --teeth one number and not 2"),
        (&[][..], "give --scenario with a name that `footplate simulate line --list` lists"),
        (&["--train", LINE, "--line", LINE][..], "ttobench_CN_Songjiazhuang_Yizhuang.json, line 1"),
    ] {
        let run = simulate_to(&folder, arguments);
        assert_eq!(run.status, 2, "{arguments:?}");
        assert!(run.errors.contains(expected), "{arguments:?}: {}", run.errors);
    }
    assert!(!folder.exists(), "nothing is written before everything is understood");
    assert_eq!(simulate(&["--scenario", "S1"]).status, 2, "neither a folder nor a score");
}
