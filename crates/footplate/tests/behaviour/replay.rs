//! `footplate replay` decides a session again, bit for bit, and shows what another program would decide otherwise.

use std::path::{Path, PathBuf};

use footplate_store::{ContentHash, Store};
use rusqlite::Connection;
use serde_json::Value;

use crate::program::{Run, folder, footplate};
use crate::station::Standing;

/// Everything that can be said, on a layout where contacts and turnouts fail now and then.
const SCRIPT: &str = "\
turnout all straight
speed 24 9
wait 24 located
stop 24
wait 24 at rest
where
stop 24 at C13+120mm
move 24 60mm
wait 500ms
stop 24 at E7+200mm at step 9 not-beyond 5%
reverse 24
stop 24 at C14+100mm
hold 24 250mm/s
wait 5s
stop 24
hold 24 200mm/s
";

/// A session of driving in the simulator, written down; returns the store.
fn driven(name: &str, seed: u64, faults: &str) -> PathBuf {
    let folder = folder(&format!("replay/{name}"));
    let (script, store) = (folder.join("script.txt"), folder.join("railway.db"));
    std::fs::write(&script, SCRIPT).expect("a test file");
    let link = format!("sim:track-a?seed={seed}&faults={faults}&trains=24");
    let run = footplate(&[
        "drive",
        "--link",
        &link,
        "--script",
        script.to_str().expect("a plain name"),
        "--store",
        store.to_str().expect("a plain name"),
    ]);
    // Orders may fail on such a layout; that is decided, too.
    assert!(run.status < 2, "{}", run.errors);
    store
}

fn replay(store: &Path, more: &[&str]) -> Run {
    footplate(&[&["replay", store.to_str().expect("a plain name")], more].concat())
}

fn json(store: &Path, more: &[&str]) -> Value {
    let run = replay(store, &[&["--json"], more].concat());
    serde_json::from_str(run.output.trim()).unwrap_or_else(|error| panic!("{error}: {run:?}"))
}

/// Changes how the machine of a store began, as another program would have it, and lets the store believe it.
fn alter(store: &Path, change: impl FnOnce(&mut Value)) {
    let machines = Store::open_to_read(store).and_then(|store| store.machines()).expect("a store");
    let mut body: Value = serde_json::from_str(&machines[0].body).expect("JSON");
    change(&mut body);
    let body = body.to_string();
    let hash = ContentHash::of(body.as_bytes()).to_string();
    let file = Connection::open(store).expect("a store");
    file.execute_batch("DROP TRIGGER machines_are_not_changed").expect("it is there");
    file.execute(
        "UPDATE machines SET body = ?1, body_sha256 = ?2, packed = NULL, crc32 = NULL",
        [&body, &hash],
    )
    .expect("it can be changed");
}

#[test]
fn every_decision_of_a_driven_session_is_made_again_bit_for_bit() {
    for seed in [3, 5, 7, 11] {
        let store = driven(&format!("driven-{seed}"), seed, "some");
        let again = json(&store, &["--diff"]);
        assert_eq!(again["same"], true, "seed {seed}: {again}");
        assert_eq!(again["ending"], "whole");
        let decisions = again["decisions"].as_u64().expect("a count");
        assert!(decisions > 40, "seed {seed}: {decisions}");
        let said = replay(&store, &[]);
        assert_eq!(said.status, 0, "{}", said.errors);
        assert!(said.output.contains(&format!("{decisions} decisions, all the same")), "{}", said.output);
    }
}

/// A clock that runs by itself, a line with threads, a disk that is not waited for: none of it gets into a decision.
#[test]
fn a_session_over_a_line_in_real_time_is_made_again_bit_for_bit() {
    let standing = Standing::at("tcp:127.0.0.1:0");
    let folder = folder("replay/real-time");
    let (script, store) = (folder.join("script.txt"), folder.join("railway.db"));
    let lines = "turnout 6 straight\nspeed 24 10\nwait 24 located\nstop 24\nwait 24 at rest\nmove 24 60mm\n";
    std::fs::write(&script, lines).expect("a test file");
    let [script, path] = [&script, &store].map(|path| path.to_str().expect("a plain name"));
    let link = standing.address.as_str();
    let run = footplate(&[
        "drive", "--link", link, "--layout", "track-a", "--train", "24", "--script", script, "--store", path,
    ]);
    assert!(run.status < 2, "{}", run.errors);
    let again = json(&store, &["--diff"]);
    assert_eq!((&again["same"], &again["ending"]), (&Value::Bool(true), &Value::from("whole")), "{again}");
    assert!(again["decisions"].as_u64().expect("a count") > 10, "{again}");
}

#[test]
fn every_machine_of_a_demo_is_made_again_bit_for_bit() {
    let store = folder("replay/demo").join("railway.db");
    let run = footplate(&["demo", "--json", "--seed", "3", "--store", store.to_str().expect("a plain name")]);
    assert_eq!(run.status, 0, "{}", run.errors);
    let again = replay(&store, &["--json", "--diff"]);
    assert_eq!(again.status, 0, "{}", again.output);
    let machines: Vec<Value> =
        again.output.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let kinds: Vec<_> = machines.iter().map(|machine| machine["machine"].as_str().expect("a kind")).collect();
    assert_eq!(kinds, ["calibrate", "tour", "calibrate", "tour"]);
    assert!(machines.iter().all(|machine| machine["ending"] == "whole" && machine["same"] == true));
}

#[test]
fn a_session_that_learns_on_from_others_is_made_again_too() {
    let folder = folder("replay/learns-on");
    let (script, store) = (folder.join("script.txt"), folder.join("railway.db"));
    std::fs::write(&script, "speed 24 9\nwait 24 located\nstop 24 at C13+120mm\nstop 24 at E7+50mm\n")
        .expect("a test file");
    let path = store.to_str().expect("a plain name");
    let calibrate = [
        "calibrate",
        "--link",
        "sim:track-a?seed=5",
        "--layout",
        "track-a",
        "--train",
        "24",
        "--store",
        path,
    ];
    assert_eq!(footplate(&[&calibrate[..], &["--budget", "90s"]].concat()).status, 0);
    for _ in 0..2 {
        let link = "sim:track-a?seed=5&trains=24";
        let run = footplate(&[
            "drive",
            "--link",
            link,
            "--script",
            script.to_str().expect("a plain name"),
            "--store",
            path,
        ]);
        assert!(run.status < 2, "{}", run.errors);
    }
    let sessions = replay(&store, &["--list"]);
    assert_eq!(sessions.output.lines().count(), 3, "{}", sessions.output);
    for (session, machine) in [("1", "calibrate"), ("2", "drive"), ("3", "drive")] {
        let again = json(&store, &["--session", session, "--diff"]);
        assert_eq!(
            (again["machine"].as_str(), again["same"].as_bool()),
            (Some(machine), Some(true)),
            "{again}"
        );
    }
}

#[test]
fn every_decision_of_a_calibration_is_made_again_bit_for_bit() {
    for seed in [2, 9] {
        let store = folder(&format!("replay/calibrated-{seed}")).join("railway.db");
        let link = format!("sim:track-a?seed={seed}&faults=some");
        let run = footplate(&[
            "calibrate",
            "--link",
            &link,
            "--layout",
            "track-a",
            "--train",
            "24",
            "--store",
            store.to_str().expect("a plain name"),
        ]);
        assert!(run.status < 2, "{}", run.errors);
        let again = json(&store, &["--diff"]);
        assert_eq!(
            (&again["same"], &again["ending"]),
            (&Value::Bool(true), &Value::from("whole")),
            "{again}"
        );
        assert!(again["decisions"].as_u64().expect("a count") > 200, "seed {seed}: {again}");
    }
}

#[test]
fn a_machine_that_believes_something_else_shows_what_it_would_decide_otherwise() {
    let store = driven("altered", 7, "none");
    // One number of the model, a hundredth away: ln of the speed at some step.
    alter(&store, |body| {
        let values = body["models"][0]["values"].as_array_mut().expect("the numbers of the model");
        for value in values {
            *value = Value::from(value.as_f64().expect("a number") * 1.01);
        }
    });
    let said = replay(&store, &[]);
    assert_eq!(said.status, 1, "{}", said.output);
    assert!(said.output.contains("the last of them not the same"), "{}", said.output);
    assert!(said.output.contains(", after input "), "{}", said.output);
    let all = json(&store, &["--diff"]);
    let differences = all["differences"].as_array().expect("a list");
    assert!(differences.len() > 1, "{all}");
    let other = |kind: &str| differences.iter().filter(|one| one["kind"] == kind).count();
    assert!(other("command") + other("hold-line") > 0, "the trains are told at other times: {all}");
    assert!(other("notice") > 0, "and other things are said: {all}");
    let printed = replay(&store, &["--diff"]).output;
    assert!(printed.lines().last().is_some_and(|line| line.contains("other now: ")), "{printed}");
    // Before the first difference there is none.
    let first = differences[0]["time_ns"].as_i64().expect("a time") as f64 / 1e9;
    let before = json(&store, &["--diff", "--until", &format!("{:.6}", first - 1e-3)]);
    assert_eq!((&before["same"], &before["ending"]), (&Value::Bool(true), &Value::from("asked")), "{before}");
}

#[test]
fn a_recording_that_this_program_cannot_make_again_says_what_is_missing() {
    let store = driven("missing", 3, "none");
    alter(&store, |body| drop(body.as_object_mut().expect("an object").remove("turnouts")));
    let said = replay(&store, &[]);
    assert_eq!(said.status, 2, "{}", said.output);
    assert!(said.errors.contains("missing field `turnouts`"), "{}", said.errors);
    // And one that was bent is not trusted.
    let file = Connection::open(&store).expect("a store");
    file.execute_batch("UPDATE machines SET body = json_set(body, '$.turnouts', json('[]'))")
        .expect("it can");
    let said = replay(&store, &[]);
    assert_eq!(said.status, 2);
    assert!(said.errors.contains("is not what was written down: the store is damaged"), "{}", said.errors);
}

#[test]
fn rows_that_are_missing_end_the_replay_there_and_it_says_so() {
    let store = driven("gap", 5, "none");
    let file = Connection::open(&store).expect("a store");
    file.execute_batch("DROP TRIGGER inputs_are_not_deleted; DELETE FROM inputs WHERE id = 20")
        .expect("it can");
    let said = replay(&store, &[]);
    assert_eq!(said.status, 1, "{}", said.output);
    assert!(said.output.contains("rows are missing from number"), "{}", said.output);
    // Cut off at the end it is a recording that is shorter.
    file.execute_batch(
        "DROP TRIGGER decisions_are_not_deleted; DELETE FROM inputs WHERE id >= 20; \
         DELETE FROM decisions WHERE number > (SELECT max(number) FROM inputs)",
    )
    .expect("it can");
    let said = replay(&store, &["--diff"]);
    assert_eq!(said.status, 0, "{}", said.output);
    assert!(said.output.contains("all the same") && said.output.contains("it was killed"), "{}", said.output);
}

#[test]
fn wrong_usage_is_named_and_a_store_without_decisions_says_so() {
    let nothing = folder("replay/nothing").join("railway.db");
    let missing = replay(&nothing, &[]);
    assert_eq!(missing.status, 2);
    assert!(missing.errors.contains("there is no store at"), "{}", missing.errors);
    let compat = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/compat/store-2.sqlite");
    std::fs::copy(compat, &nothing).expect("a committed store");
    assert_eq!(replay(&nothing, &["--list"]).output, "no session in this store can be replayed\n");
    assert!(replay(&nothing, &[]).errors.contains("holds no session that can be replayed"));
    assert!(replay(&nothing, &["--session", "1"]).errors.contains("has no decisions in it"));
    assert!(replay(&nothing, &["--session", "99"]).errors.contains("has no recording 99"));
    assert!(replay(&nothing, &["--until", "soon"]).errors.contains("write a time in seconds"));
}
