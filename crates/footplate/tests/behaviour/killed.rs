//! A session that is killed leaves a beginning of itself in the store: whole rows, in order, and decided alike again.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use footplate_core::{Event, Timestamp};
use footplate_store::{Side, Store, Traced};

use crate::drawn_moments::DrawnMoments;
use crate::program::footplate;

/// Sessions that are killed, chosen: some seconds' worth.
const KILLS: usize = 12;
/// Kills come so long (µs) after the program was started: a calibration takes a second or two.
const KILLED_WITHIN_US: std::ops::Range<u64> = 20_000..1_200_000;

const CALIBRATE: [&str; 7] =
    ["calibrate", "--link", "sim:track-a?seed=4", "--layout", "track-a", "--train", "24"];

fn path_of(name: impl std::fmt::Display) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("killed");
    std::fs::create_dir_all(&folder).expect("the test folder can be made");
    folder.join(format!("{name}.db"))
}

/// A place where no store is.
fn fresh(name: impl std::fmt::Display) -> PathBuf {
    let path = path_of(name);
    for ending in ["", "-wal", "-shm"] {
        let _ = std::fs::remove_file(format!("{}{ending}", path.display()));
    }
    path
}

/// The events and the trace of the only session in a store, if it got so far.
fn kept(path: &Path) -> (Vec<Event>, Vec<Traced>) {
    let late = Timestamp::from_ns(i64::MAX);
    let Ok(store) = Store::open(path) else { return Default::default() };
    store.check().expect("it is sound");
    let runs = store.recordings(late).expect("readable");
    let runs = runs.first().map(|recording| store.runs(recording.key, late).expect("readable"));
    let events = runs.into_iter().flatten().flat_map(|run| run.events).map(|stored| stored.raw.event);
    let machines = store.machines().expect("readable");
    let trace = machines.first().map(|machine| store.trace(machine.key).expect("readable"));
    (events.collect(), trace.unwrap_or_default())
}

#[test]
fn a_calibration_that_is_killed_leaves_the_beginning_of_the_one_that_is_not() {
    let whole = fresh("whole");
    let run = footplate(&[&CALIBRATE[..], &["--store", whole.to_str().expect("a plain name")]].concat());
    assert_eq!(run.status, 0, "{}", run.errors);
    let (events, trace) = kept(&whole);
    assert_eq!(trace.last().map(|row| row.kind.as_ref()), Some("end"));

    let mut moments = DrawnMoments::new();
    let mut cut_off = 0;
    for kill in 0..KILLS {
        let wait = moments.wait_us(KILLED_WITHIN_US);
        println!("kill {kill} of seed {}: after {wait:?}", moments.seed);
        let path = fresh(kill);
        let mut child = Command::new(env!("CARGO_BIN_EXE_footplate"))
            .args(CALIBRATE)
            .arg("--store")
            .arg(&path)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        thread::sleep(wait);
        child.kill().expect("it can be killed");
        child.wait().expect("it ends");

        let (some, told) = kept(&path);
        assert!(some.len() <= events.len() && told.len() <= trace.len());
        assert_eq!(some, events[..some.len()], "events are those of the whole session, from its beginning");
        assert_eq!(told, trace[..told.len()], "and so is what was told and decided");
        // No event reached the machine, and no command a train, before it was on its way to the disk.
        let inputs = told.iter().filter(|row| row.side == Side::Input && row.kind == "event").count();
        assert!(inputs <= some.len());
        if told.is_empty() {
            continue;
        }
        cut_off += usize::from(told.len() < trace.len());
        let replay = footplate(&["replay", path.to_str().expect("a plain name"), "--diff"]);
        assert_eq!(replay.status, 0, "{}{}", replay.output, replay.errors);
        assert!(replay.output.contains("all the same"), "{}", replay.output);
        assert_eq!(replay.output.contains("it was killed"), told.len() < trace.len(), "{}", replay.output);
    }
    assert!(cut_off > 0, "no session was killed while it ran");

    // And the next session goes on from what is there.
    let path = (0..KILLS).map(path_of).find(|path| kept(path).0.len() > 50);
    if let Some(path) = path {
        let store = path.to_str().expect("a plain name");
        let next = footplate(&[&CALIBRATE[..], &["--budget", "60s", "--store", store]].concat());
        assert!(next.status < 2 && next.errors.contains("going on from 1 run "), "{}", next.errors);
    }
}

/// How far behind the session the disk is, of a train that runs and is given an order every 50 ms.
#[cfg(unix)]
#[test]
#[ignore = "a measurement, for docs/trust.md"]
fn how_far_the_store_lags_behind_the_session() {
    use std::io::{Read as _, Write as _};
    use std::net::TcpStream;
    use std::time::Duration;

    const ORDERS: u32 = 400;
    let (_board, _line, driven, _) = crate::guardian::running("lag-on-disk");
    let host = driven.host();
    let mut lags_ms: Vec<f64> = Vec::new();
    for nth in 0..ORDERS {
        driven.order(&format!("speed 24 {}", 5 + nth % 9));
        for _ in 0..5 {
            let mut stream = TcpStream::connect(&host).expect("a connection");
            write!(stream, "GET /api/picture HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")
                .expect("sent");
            let mut answer = String::new();
            stream.read_to_string(&mut answer).expect("an answer");
            let (_, body) = answer.split_once("\r\n\r\n").expect("a body");
            let picture: serde_json::Value = serde_json::from_str(body).expect("JSON");
            let time = |key: &str| picture[key].as_f64();
            lags_ms
                .extend(time("t_s").zip(time("written_until_s")).map(|(now, written)| 1e3 * (now - written)));
            thread::sleep(Duration::from_millis(10));
        }
    }
    lags_ms.sort_by(f64::total_cmp);
    let at = |share: f64| lags_ms[((lags_ms.len() - 1) as f64 * share) as usize];
    let [median, most, nearly_all, longest] = [0.5, 0.95, 0.99, 1.0].map(at);
    println!(
        "{} pictures: behind by {median:.0} ms (median), {most:.0} (95 %), {nearly_all:.0} (99 %), {longest:.0} (longest)",
        lags_ms.len()
    );
}
