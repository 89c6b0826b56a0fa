//! Trains that a session left running, whose guardian died with it, are stopped before the next session does anything else.

use std::thread::sleep;
use std::time::Duration;

use crate::board::calibrated;
use crate::emergency_stop::{Served, Tap};
use crate::program::footplate;
use crate::station::Standing;

#[test]
fn the_next_session_stops_what_a_killed_one_left_running() {
    let folder = calibrated("left-running", 7);
    let store = folder.join("railway.db");
    let board = Standing::with("tcp:127.0.0.1:0", "1", &["--protocol", "dcc-ex", "--seed", "7"]);
    let of_board = board.address.strip_prefix("dcc-ex:tcp://").expect(&board.address);
    let (at, more) = of_board.split_once('?').unwrap_or((of_board, ""));
    let link = |tap: &Tap| format!("dcc-ex:tcp://{}?{more}", tap.place);
    // Given a train that runs when the program is killed,
    let tap = Tap::before(at);
    let served = Served::with(&store, &link(&tap));
    assert!(served.post("/api/orders", "{\"line\": \"speed 24 8\"}").contains("202"));
    sleep(Duration::from_millis(500));
    served.cut_power();
    let running = tap.said();
    let steps =
        |said: &str| said.split("<t 24 ").skip(1).map(|rest| rest.starts_with('0')).collect::<Vec<_>>();
    assert_eq!(steps(&running).last(), Some(&false), "{running}");
    assert!(!running.ends_with("<0>"), "it was killed: {running}");

    // when the next session begins, with a script that moves nothing,
    let script = folder.join("where.txt");
    std::fs::write(&script, "where 24\n").expect("a file");
    let (script, path) = (script.to_str().expect("UTF-8"), store.to_str().expect("UTF-8"));
    let drive = |tap: &Tap| {
        footplate(&[
            "drive",
            "--layout",
            "track-a",
            "--link",
            &link(tap),
            "--store",
            path,
            "--script",
            script,
        ])
    };
    let tap = Tap::before(at);
    let output = drive(&tap);

    // then the train is commanded to stop before the power is switched off, and both before it is switched on again.
    assert_eq!(output.status, 0, "{}", output.errors);
    assert!(output.errors.contains("has not ended: every known train may be running"), "{}", output.errors);
    assert!(output.errors.contains("commanded to stop: 24; track power switched off"), "{}", output.errors);
    let said = tap.said();
    let first = |words: &str| said.find(words).unwrap_or_else(|| panic!("{words} in {said}"));
    assert!(first("<t 24 0") < first("<0>"), "{said}");
    assert!(said[first("<0>")..].contains("<1"), "the session switches the power on: {said}");
    assert!(steps(&said).iter().all(|stands| *stands), "{said}");

    // And the session after that has nothing to stop.
    let output = drive(&Tap::before(at));
    assert!(!output.errors.contains("has not ended"), "{}", output.errors);
}
