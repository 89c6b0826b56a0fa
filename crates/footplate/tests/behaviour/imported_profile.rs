//! A train of which only JMRI's speeds are known is driven, and calibrated from there; the truth is the simulated world's.
//!
//! `cargo nextest run -p footplate -E 'test(imported_profile)' --no-capture` prints the figures.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::board::{SCRIPT, calibrated_over, errors, stops_of};
use crate::program::{Run, footplate};

/// Worlds whose train faces the direction of the script's places.
const SEEDS: [u64; 3] = [7, 10, 11];
const LINK: &str = "sim:track-a?faults=none&trains=24&station=dcc-ex&seed=";

fn did(arguments: &[&str]) -> Run {
    let run = footplate(arguments);
    assert_eq!(run.status, 0, "{arguments:?}: {}{}", run.output, run.errors);
    run
}

/// What JMRI knows of a train that was calibrated: the speeds of an export, without what only this program adds.
fn roster_entry(folder: &Path) -> PathBuf {
    let [store, entry] =
        ["railway.db", "entry.xml"].map(|file| folder.join(file).to_str().expect("a path").to_owned());
    let empty = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/profiles/jmri_without_profile.xml");
    let to = ["--format", "jmri", "--into", empty, "--out", &entry];
    did(&[&["profiles", "export", "--train", "24", "--store", &store], &to[..]].concat());
    let text = std::fs::read_to_string(&entry).expect("the export");
    const PAIR: &str = "<keyvaluepair>";
    let parts = text.split(PAIR).enumerate().map(|(nth, part)| match part.split_once("</keyvaluepair>") {
        Some((pair, rest)) if pair.contains("<key>Footplate.") => rest.to_owned(),
        _ if nth == 0 => part.to_owned(),
        _ => format!("{PAIR}{part}"),
    });
    let plain = parts.collect::<String>();
    assert!(plain.contains("<speedprofile>") && !plain.contains("Footplate."), "{plain}");
    std::fs::write(&entry, plain).expect("a test file");
    entry.into()
}

/// The speeds of steps reached from below and their standard deviations (mm/s).
fn speeds(calibration: &Value) -> BTreeMap<u64, [f64; 2]> {
    let rows = calibration["steps"].as_array().expect("steps").iter();
    let number = |row: &Value, field: &str| row[field].as_f64().expect("a number");
    rows.filter(|row| row["approach"] == "below")
        .map(|row| {
            let speed = ["speed_mm_s", "speed_uncertainty_mm_s"].map(|field| number(row, field));
            (row["step"].as_u64().expect("a step"), speed)
        })
        .collect()
}

fn calibration(store: &str, link: &str, budget: &str) -> (Value, String) {
    let over = ["--link", link, "--layout", "track-a", "--store", store, "--json"];
    let run = did(&[&["calibrate", "--train", "24", "--budget", budget], &over[..]].concat());
    (serde_json::from_str(&run.output).expect("JSON"), run.errors)
}

#[test]
fn a_train_with_an_imported_profile_is_driven_as_promised_and_calibrated_from_there() {
    let (mut all, mut broken) = (Vec::new(), 0);
    for seed in SEEDS {
        let link = format!("{LINK}{seed}");
        let folder = calibrated_over(LINK, &format!("profile-{seed}"), seed);
        let entry = roster_entry(&folder).display().to_string();
        let [known, imported, unknown, script] = ["railway.db", "imported.db", "unknown.db", "script.txt"]
            .map(|file| folder.join(file).display().to_string());
        did(&["profiles", "import", &entry, "--train", "24", "--store", &imported]);
        std::fs::write(&script, SCRIPT).expect("a test file");

        // It is driven: no stop was ever measured, so the intervals are wide at first, and true.
        let over = ["--link", &link, "--layout", "track-a", "--train", "24"];
        let drives = |store: &str| {
            let task = ["drive", "--script", &script, "--json", "--store", store];
            let run = footplate(&[&task[..], &over].concat());
            assert!(run.status <= 1, "{}{}", run.output, run.errors);
            (stops_of(&run), run.errors)
        };
        let (copy, kept) = (folder.join("driven.db").display().to_string(), &imported);
        std::fs::copy(kept, &copy).expect("a copy of the store");
        let (stops, said) = drives(&copy);
        assert!(said.contains("begins with the speeds of entry.xml"), "{said}");
        let (found, outside) = errors(&stops);
        let (others, _) = drives(&unknown);
        let width = |stops: &[Value]| stops[1]["promised_high_mm"].as_f64().expect("a promise");
        println!(
            "{seed}: errors {found:.0?} mm, {outside} outside; second stop within {:.0} mm, of an unknown train {:.0} mm",
            width(&stops),
            width(&others)
        );
        assert!(width(&stops) < width(&others), "the profile is used");
        all.extend(found);
        broken += outside;

        // It is calibrated from there, and ends where a calibration without the profile did.
        let (truth, _) = calibration(&known, &link, "20s");
        let (from_profile, said) = calibration(&imported, &link, "40s");
        assert!(said.contains("beginning with the speeds of entry.xml"), "{said}");
        let truth = speeds(&truth);
        let measured = speeds(&from_profile);
        assert!(measured.contains_key(&9), "{measured:?}");
        for (step, [value, deviation]) in measured {
            let [true_speed, its_deviation] = truth[&step];
            let off = (value - true_speed) / deviation.hypot(its_deviation);
            println!(
                "{seed}: step {step} {value:.0} ± {deviation:.0} mm/s, in five minutes {true_speed:.0} mm/s"
            );
            assert!(off.abs() < 3.0, "{seed}: step {step}: {value} ± {deviation} and {true_speed}");
        }
    }
    // One in twenty should be.
    assert!(
        all.len() >= 15 && broken <= 3,
        "{broken} of {} outside of what was promised: {all:.0?}",
        all.len()
    );
}
