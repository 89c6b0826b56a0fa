//! A seed means one result, today and later: what known seeds and recordings give is pinned here to the last digit.
//!
//! The tables in `docs/tables` are compared on every run, too, but are rounded and take minutes; these are their short sisters, for
//! tests that are run hundreds of times (`./ci.sh mutants`). A pin does not say what is right: that is asserted elsewhere, with
//! numbers from other sources. It says that nothing changed unnoticed.

use std::path::{Path, PathBuf};

use footplate_core::TimeSpan;
use footplate_core::odometry::Odometer;
use footplate_eval::survey::longest_between_sensors;
use footplate_eval::written_scores::WrittenScores;
use footplate_eval::{disasters, driving, survey, traffic, zones};
use footplate_sim::LawFamily;
use footplate_sim::line::{LineConditions, LineScenario};
use footplate_store::odometry::{Preset, simulated_rows, simulated_vehicle};
use footplate_store::score::{Forecasters, ReplayContext, score_recording};
use footplate_store::{Batch, Findings, LogContext, ModuleLetters, Recording, built_in, read_sensor_log};

/// Track time that each calibration may take: the first steps of one.
const BUDGET: TimeSpan = TimeSpan::from_s(60.0);
/// On a layout whose lengths are unknown they come later.
const SURVEY_BUDGET: TimeSpan = TimeSpan::from_s(240.0);

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A fingerprint of any text (FNV-1a, 64 bits).
fn fingerprint(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

fn json(page: &impl WrittenScores) -> String {
    let mut written = Vec::new();
    page.write_json(&mut written).unwrap();
    String::from_utf8(written).unwrap()
}

/// The calibration of one train from nothing, and its stops, by Footplate and by both others.
fn driving_of(law: LawFamily) -> String {
    let layout = built_in("track-a").unwrap().layout;
    let trains = [driving::score(&layout, 3, law, BUDGET).unwrap()];
    json(&driving::Page { trains: &trains, asked: String::new() })
}

fn disasters_of(seed: u64) -> String {
    let layout = built_in("track-a").unwrap().layout;
    let scored = vec![disasters::score(&layout, seed, BUDGET).unwrap()];
    json(&disasters::Page { scored, asked: String::new() })
}

fn zones_of(seed: u64) -> String {
    let layout = built_in("track-a").unwrap().layout;
    let scored = vec![zones::score(&layout, seed, BUDGET).unwrap()];
    json(&zones::Page { scored, asked: String::new() })
}

/// Four trains for six minutes on a layout.
fn traffic_of(layout: &str, seed: u64) -> String {
    let layout = built_in(layout).unwrap().layout;
    let time = TimeSpan::from_s(360.0);
    let asked = traffic::Asked { trains: 4, time, budget: BUDGET, by_blocks: false };
    let tallies = [traffic::Session::new(&layout, seed, asked, false).unwrap().run(time)];
    json(&traffic::Page { tallies: &tallies, by_blocks: &[], asked: String::new() })
}

fn survey_of(seed: u64) -> String {
    let layout = built_in("track-a").unwrap().layout;
    let known = longest_between_sensors(&layout).unwrap();
    let worlds = [survey::score(&layout, known, 2, SURVEY_BUDGET, seed).unwrap()];
    json(&survey::Page { worlds: &worlds, known: [String::new(), String::new()], asked: String::new() })
}

/// Every figure of every period, by the recommended and the published algorithm, with an inertial sensor or without.
fn odometer_of(scenario: &str, inertial_sensor: bool) -> String {
    let scenario = LineScenario::by_name(scenario).unwrap();
    let run = scenario.run(1, LineConditions { inertial_sensor, ..LineConditions::default() });
    let vehicle = simulated_vehicle(&run.vehicle).unwrap().vehicle;
    let mut said = String::new();
    for preset in [Preset::Recommended, Preset::Paper] {
        let mut odometer = Odometer::new(vehicle, preset.settings()).unwrap();
        for (period, _) in simulated_rows(&run) {
            said += &format!("{:?}", odometer.step(&period));
        }
    }
    said
}

fn recordings() -> Vec<Recording> {
    let files =
        std::fs::read_dir(project().join("testdata/sensor-logs")).unwrap().map(|entry| entry.unwrap().path());
    let mut logs: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|ending| ending == "csv")).collect();
    logs.sort();
    let context = LogContext { sensors: &ModuleLetters, train: None };
    logs.iter().map(|log| read_sensor_log(log, context).unwrap()).collect()
}

/// All that `footplate report` says of the recordings of real trains.
fn reports_of_recordings() -> String {
    let layout = built_in("track-a").unwrap().layout;
    let batch = Batch::of_recordings(&layout, &recordings(), None).unwrap();
    format!("{batch:?}{:?}", Findings::of(&layout, &batch))
}

/// Every forecast of `footplate predict`.
fn forecasts_of_recordings() -> String {
    let layout = built_in("track-a").unwrap().layout;
    let context = ReplayContext { layout: &layout, turnouts: &[] };
    let scored = recordings().into_iter().map(|log| {
        format!("{:?}", score_recording(context, &log, None, &mut Forecasters::of_layout(&layout)).unwrap())
    });
    scored.collect()
}

/// Compares with a file of `testdata/same-seed`: a line for each result, with its name and fingerprint.
fn assert_pinned(file: &str, results: &[(&str, &dyn Fn() -> String)]) {
    let path = project().join("testdata/same-seed").join(file);
    let line =
        |(name, found): &(&str, &dyn Fn() -> String)| format!("{name} {:016x}\n", fingerprint(&found()));
    let now: String = results.iter().map(line).collect();
    if std::env::var_os("FOOTPLATE_REWRITE_PINS").is_some() {
        std::fs::write(&path, &now).unwrap();
    }
    let pinned = std::fs::read_to_string(&path).unwrap();
    assert_eq!(pinned, now, "other results than before; if that is meant: ./ci.sh expected");
}

#[test]
fn recordings_of_real_trains_give_the_pinned_reports_and_forecasts() {
    assert_pinned(
        "recordings.txt",
        &[("reports", &reports_of_recordings), ("forecasts", &forecasts_of_recordings)],
    );
}

#[test]
fn trains_of_known_seeds_are_calibrated_and_stopped_as_pinned() {
    assert_pinned(
        "driving.txt",
        &[
            ("momentum", &|| driving_of(LawFamily::Momentum)),
            ("lag", &|| driving_of(LawFamily::Lag)),
            ("survey", &|| survey_of(1)),
        ],
    );
}

#[test]
fn trains_of_known_seeds_are_paced_and_found_again_as_pinned() {
    assert_pinned(
        "recovery.txt",
        &[
            ("disasters 1", &|| disasters_of(1)),
            ("disasters 2", &|| disasters_of(2)),
            ("disasters 3", &|| disasters_of(3)),
            ("zones", &|| zones_of(21)),
        ],
    );
}

#[test]
fn trains_of_known_seeds_are_dispatched_as_pinned() {
    assert_pinned(
        "dispatching.txt",
        &[("track-a", &|| traffic_of("track-a", 541)), ("track-b", &|| traffic_of("track-b", 542))],
    );
}

#[test]
fn odometers_on_known_seeds_say_what_is_pinned() {
    let of = |scenario: &'static str, inertial| move || odometer_of(scenario, inertial);
    assert_pinned(
        "odometers.txt",
        &[
            ("N5", &of("N5", true)),
            ("N6", &of("N6", false)),
            ("S3", &of("S3", true)),
            ("S4", &of("S4", false)),
            ("S6", &of("S6", true)),
            ("F5", &of("F5", false)),
            ("F7", &of("F7", false)),
        ],
    );
}
