//! `footplate` alone shows two unknown trains being calibrated and stopped, and ends with what was promised beside the
//! truth; a session that is killed in the middle has lost nothing that was acknowledged.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use footplate_core::{SpeedStep, Timestamp, TrainId};
use footplate_store::{MotionFile, MotionReplay, Store, built_in};
use serde_json::Value;

use crate::drawn_moments::DrawnMoments;
use crate::program::{folder, footplate};

fn store(name: &str) -> PathBuf {
    folder(name).join("railway.db")
}

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
}

#[test]
fn two_unknown_trains_learn_and_make_five_stops_each_within_a_minute() {
    let run = footplate(&["demo", "--json", "--seed", "1"]);
    assert_eq!(run.status, 0, "{run:?}");
    let told = lines(&run.output);
    let of = |key: &str| told.iter().filter(|line| line.get(key).is_some()).count();
    assert_eq!((of("learnt"), of("stop"), of("result")), (2, 10, 1));
    let result = &told.last().unwrap()["result"];
    assert!(result["wall_time_s"].as_f64().unwrap() < 60.0, "{result}");
    for learnt in result["learnt"].as_array().unwrap() {
        // Five minutes, and the time to come to rest.
        assert!(learnt["track_time_s"].as_f64().unwrap() <= 310.0, "{learnt}");
        assert!(learnt["steps"].as_array().unwrap().len() >= 8, "{learnt}");
    }
    // How well promises are kept is scored elsewhere, over thousands of stops; here nothing is far out.
    let stops = result["stops"].as_array().unwrap();
    assert!(stops.iter().all(|stop| stop["error_mm"].as_f64().unwrap().abs() < 400.0), "{stops:?}");
}

#[test]
fn without_a_command_it_is_the_demo_and_it_ends_with_the_table() {
    let run = footplate(&[]);
    assert_eq!(run.status, 0, "{run:?}");
    assert!(
        run.output.starts_with("Footplate calibrates and drives trains 24 and 58, which it has never seen")
    );
    let table = run.output.lines().skip_while(|line| !line.contains("predicted mm")).skip(1);
    let rows = table.take_while(|line| line.ends_with("inside") || line.ends_with("outside"));
    assert_eq!(rows.count(), 10, "{}", run.output);
    // No terminal is there to be written over.
    assert!(!run.output.contains('\x1b'));
}

#[test]
fn the_same_seed_is_the_same_evening() {
    let run = |seed| {
        let told = lines(&footplate(&["demo", "--json", "--seed", seed]).output);
        told.last().unwrap()["result"]["stops"].clone()
    };
    assert_eq!(run("2"), run("2"));
}

/// Sessions that are killed, and how long (µs) after the first word: chosen, a few seconds' worth.
const KILLS: u64 = 10;
const KILLED_WITHIN_US: std::ops::Range<u64> = 0..800_000;

/// Kills a session of the program at drawn moments, and looks at what is left.
#[test]
fn every_acknowledged_event_is_in_the_store_after_a_kill_and_learning_goes_on_from_there() {
    let mut moments = DrawnMoments::new();
    for number in 0..KILLS {
        let wait = moments.wait_us(KILLED_WITHIN_US);
        println!("kill {number} of seed {}: after {wait:?}", moments.seed);
        let store = store(&format!("demo-killed-{number}"));
        let mut child = Command::new(env!("CARGO_BIN_EXE_footplate"))
            .args(["demo", "--json", "--speed", "200", "--seed", &number.to_string(), "--store"])
            .arg(&store)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(child.stdout.take().unwrap()).lines();
        let acknowledged = |line: Option<std::io::Result<String>>| -> Option<u64> {
            let line: Value = serde_json::from_str(&line?.ok()?).ok()?;
            line["acknowledged"].as_u64()
        };
        let mut last = said.by_ref().find_map(|line| acknowledged(Some(line))).expect("something is kept");
        thread::sleep(wait);
        child.kill().unwrap();
        child.wait().unwrap();
        // What it said before the end counts, even if nobody had listened yet; the last line may be torn.
        for line in said {
            last = acknowledged(Some(line)).unwrap_or(last).max(last);
        }

        let path = store.to_str().unwrap();
        let shown = footplate(&["store", "show", "--store", path, "--json"]);
        assert_eq!(shown.status, 0, "{shown:?}");
        let shown: Value = serde_json::from_str(&shown.output).unwrap();
        let recording = &shown["recordings"][0];
        assert_eq!(recording["form"], "live");
        let events = recording["event_count"].as_u64().unwrap();
        assert!(events >= last, "{events} of {last} acknowledged events are there");
        // And what the train had taught is learnt again from them.
        let learnt = replayed(&store, TrainId(24));
        assert_eq!((learnt.runs, learnt.left_out.len()), (1, 0));
        assert!(learnt.events > 0 && learnt.events as u64 <= events);
    }
}

fn replayed(store: &Path, train: TrainId) -> MotionReplay {
    let layout = built_in("track-a").unwrap().layout;
    let mut store = Store::open(store).unwrap();
    let highest = SpeedStep::new(14).unwrap();
    MotionReplay::of_store(&layout, &mut store, train, highest, Timestamp::from_ns(i64::MAX)).unwrap()
}

#[test]
fn what_two_trains_taught_is_learnt_again_from_their_session() {
    let store = store("demo-replayed");
    let run = footplate(&["demo", "--json", "--seed", "5", "--store", store.to_str().unwrap()]);
    assert_eq!(run.status, 0, "{run:?}");
    for train in [TrainId(24), TrainId(58)] {
        let again = replayed(&store, train);
        let late = Timestamp::from_ns(i64::MAX);
        let kept =
            MotionFile::of_store(&Store::open(&store).unwrap(), train, late).unwrap().expect("it is kept");
        assert!(kept.steps.len() >= 16, "both sides of eight steps: {}", kept.steps.len());
        // The session went on after the model was kept: five stops more.
        for known in kept.steps.iter().filter(|known| known.speed.measurements > 2) {
            let speed = again.fit.model().speed(known.step, known.approach);
            let off = speed.value.as_mm_per_s() / known.speed.value - 1.0;
            assert!(off.abs() < 0.03, "train {train}, step {}: {off}", known.step);
        }
    }
}
