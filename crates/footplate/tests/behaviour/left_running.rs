//! Trains that a session left running, whose guardian died with it, are stopped before the next session does anything else.

use std::collections::BTreeSet;
use std::net::TcpListener;
use std::path::PathBuf;
use std::thread::sleep;
use std::time::Duration;

use rusqlite::Connection;

use crate::board::calibrated;
use crate::emergency_stop::{Served, Tap};
use crate::program::{Run, footplate};
use crate::station::Standing;

/// A train that ran behind a board when the computer lost its power.
struct LeftRunning {
    board: Standing,
    folder: PathBuf,
}

impl LeftRunning {
    fn new(name: &str) -> Self {
        let folder = calibrated(name, 7);
        let board = Standing::with("tcp:127.0.0.1:0", "1", &["--protocol", "dcc-ex", "--seed", "7"]);
        let left = Self { board, folder };
        let tap = left.tap();
        let served = Served::with(&left.folder.join("railway.db"), &left.link(&tap));
        assert!(served.post("/api/orders", "{\"line\": \"speed 24 8\"}").contains("202"));
        sleep(Duration::from_millis(500));
        served.cut_power();
        let running = tap.said();
        assert_eq!(steps(&running).last(), Some(&false), "{running}");
        assert!(!running.ends_with("<0>"), "it was killed: {running}");
        std::fs::write(left.folder.join("where.txt"), "wait 1s\nwhere 24\n").expect("a file");
        left
    }

    fn parts(&self) -> (&str, &str) {
        let of_board = self.board.address.strip_prefix("dcc-ex:tcp://").expect(&self.board.address);
        of_board.split_once('?').unwrap_or((of_board, ""))
    }

    fn tap(&self) -> Tap {
        Tap::before(self.parts().0)
    }

    fn link(&self, tap: &Tap) -> String {
        format!("dcc-ex:tcp://{}?{}", tap.place, self.parts().1)
    }

    fn file(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// Drives over a link with a script that moves nothing, and waits until the station has answered.
    fn drive(&self, link: &str, layout: &str, store: &str) -> Run {
        let [script, store] = ["where.txt", store].map(|file| self.file(file));
        footplate(&["drive", "--layout", layout, "--link", link, "--store", &store, "--script", &script])
    }
}

/// Whether each command for train 24 is a stop.
fn steps(said: &str) -> Vec<bool> {
    said.split("<t 24 ").skip(1).map(|rest| rest.starts_with('0')).collect()
}

/// The train was commanded to stop, alone or with all others, before the power was switched off.
fn assert_stopped(said: &str, errors: &str) {
    let stop = said.find("<t 24 0").or_else(|| said.find("<!>"));
    assert!(stop.is_some() && stop < said.find("<0>"), "{said}\n{errors}");
    assert!(steps(said).iter().all(|stands| *stands), "{said}");
}

#[test]
fn the_next_session_stops_what_a_killed_one_left_running() {
    let left = LeftRunning::new("left-running");
    // A layout that cannot be read stops nothing of that: it is read later.
    std::fs::write(left.file("broken.toml"), "what = [").expect("a file");
    let tap = left.tap();
    let output = left.drive(&left.link(&tap), &left.file("broken.toml"), "railway.db");
    assert_eq!(output.status, 2, "{}", output.errors);
    assert!(output.errors.contains("broken.toml"), "{}", output.errors);
    assert_stopped(&tap.said(), &output.errors);

    // Nor does a port that is in use, where the link is that of the set-up.
    let tap = left.tap();
    let (busy, set_up) =
        (TcpListener::bind("127.0.0.1:0").expect("a free port"), left.file("railway.setup.json"));
    let text =
        format!("{{\"link\": \"{}\", \"layout\": \"track-a\", \"is_complete\": true}}", left.link(&tap));
    std::fs::write(&set_up, text).expect("a file");
    let at = busy.local_addr().expect("an address").to_string();
    let output = footplate(&["serve", &at, "--store", &left.file("railway.db")]);
    assert_eq!(output.status, 2, "{}", output.errors);
    assert_stopped(&tap.said(), &output.errors);
    std::fs::remove_file(set_up).expect("it was there");

    // And a simulated session on the same store does not hide the one that has not ended.
    let output = left.drive("sim:track-a?seed=7&trains=24", "track-a", "railway.db");
    assert!(!output.errors.contains("has not ended"), "{}", output.errors);

    // When the next session begins, with a script that moves nothing,
    let tap = left.tap();
    let output = left.drive(&left.link(&tap), "track-a", "railway.db");

    // then the train is commanded to stop before the power is switched off, and both before it is switched on again.
    assert_eq!(output.status, 0, "{}", output.errors);
    assert!(output.errors.contains("has not ended: every known train may be running"), "{}", output.errors);
    assert!(output.errors.contains("commanded to stop: 24; track power switched off"), "{}", output.errors);
    let said = tap.said();
    assert_stopped(&said, &output.errors);
    assert!(
        said[said.find("<0>").expect("power off")..].contains("<1"),
        "the session switches the power on: {said}"
    );

    // And the session after that has nothing to stop.
    let output = left.drive(&left.link(&left.tap()), "track-a", "railway.db");
    assert!(!output.errors.contains("has not ended"), "{}", output.errors);
}

#[test]
fn whichever_page_of_the_store_is_destroyed_all_trains_are_stopped_before_it_is_refused() {
    let left = LeftRunning::new("left-running-damaged");
    let file = Connection::open(left.file("railway.db")).expect("a store");
    file.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(())).expect("a checkpoint");
    let size: usize = file.pragma_query_value(None, "page_size", |row| row.get(0)).expect("a size");
    let mut statement =
        file.prepare("SELECT pageno, name, pagetype FROM dbstat ORDER BY pageno").expect("SQL");
    let row = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?, row.get(2)?));
    let pages: Vec<(usize, String, String)> =
        statement.query_map([], row).expect("pages").map(|page| page.expect("a page")).collect();
    let whole = std::fs::read(left.file("railway.db")).expect("a store");
    // One page of each kind of each table and index.
    let mut kinds = BTreeSet::new();
    let mut by_number = 0;
    for (page, name, kind) in pages {
        if !kinds.insert((name.clone(), kind.clone())) {
            continue;
        }
        let mut bytes = whole.clone();
        bytes[(page - 1) * size..page * size].fill(0x55);
        for beside in ["damaged.db-wal", "damaged.db-shm"] {
            let _ = std::fs::remove_file(left.file(beside));
        }
        std::fs::write(left.file("damaged.db"), bytes).expect("a file");
        let tap = left.tap();
        let output = left.drive(&left.link(&tap), "track-a", "damaged.db");
        let which = format!("page {page}, {kind} of {name}: {}", output.errors);
        assert_eq!(output.status, 2, "{which}");
        assert!(
            output.errors.contains("every train may be running")
                || output.errors.contains("every known train"),
            "{which}"
        );
        assert!(
            output.errors.contains("is damaged") || output.errors.contains("is not a Footplate store"),
            "{which}"
        );
        let said = tap.said();
        assert_stopped(&said, &which);
        by_number += usize::from(!steps(&said).is_empty());
    }
    println!("{} kinds of pages; with {by_number} the train was stopped by its number", kinds.len());
    assert!(kinds.len() >= 30 && by_number >= kinds.len() - 6, "{by_number} of {}", kinds.len());
}
