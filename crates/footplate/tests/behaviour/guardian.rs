//! However the program dies, its trains are commanded to stop within a second, as the station's end of the line sees it.
//!
//! `cargo nextest run -p footplate -E 'test(every_death_stops)' --no-capture` prints how soon.
#![cfg(unix)]
#![expect(clippy::disallowed_methods, reason = "how soon trains are stopped is measured")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use crate::board::calibrated;
use crate::station::Standing;

/// Stops are on the line within this (issue 19) ...
pub(crate) const WITHIN: Duration = Duration::from_secs(1);
/// ... and nothing else here takes longer than this.
pub(crate) const PATIENCE: Duration = Duration::from_secs(30);
const EVERY: Duration = Duration::from_millis(5);

/// What a station heard, and when.
#[derive(Default)]
struct Heard {
    bytes: Vec<(Instant, u8)>,
    /// Connections that were made.
    connections: usize,
    open: Option<TcpStream>,
    /// The other half of that connection, to the board.
    board: Option<TcpStream>,
    refuses: bool,
}

/// The station's end of a line that can be pulled out and put back: a board behind it, or nobody.
pub(crate) struct Line {
    place: String,
    heard: Arc<Mutex<Heard>>,
}

impl Line {
    /// A line to a board, or to a station that never answers.
    fn to(board: Option<&str>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let place = listener.local_addr().expect("an address").to_string();
        let heard = Arc::<Mutex<Heard>>::default();
        let (shared, board) = (Arc::clone(&heard), board.map(str::to_owned));
        let at = place.clone();
        thread::spawn(move || {
            let mut listener = Some(listener);
            loop {
                let refuses = locked(&shared).refuses;
                if refuses {
                    listener = None;
                } else if listener.is_none() {
                    listener = TcpListener::bind(&at).ok();
                }
                if let Some(listener) = &listener {
                    listener.set_nonblocking(true).expect("an option of sockets");
                    if let Ok((program, _)) = listener.accept() {
                        program.set_nonblocking(false).expect("an option of sockets");
                        let mut heard = locked(&shared);
                        heard.connections += 1;
                        heard.open = program.try_clone().ok();
                        drop(heard);
                        serve(program, board.as_deref(), &shared);
                        continue;
                    }
                }
                sleep(EVERY);
            }
        });
        Self { place, heard }
    }

    pub(crate) fn said(&self) -> String {
        String::from_utf8_lossy(&locked(&self.heard).bytes.iter().map(|(_, byte)| *byte).collect::<Vec<_>>())
            .into_owned()
    }

    /// When some words were said first at or after a time.
    pub(crate) fn time_of(&self, words: &[u8], since: Instant) -> Option<Instant> {
        let heard = locked(&self.heard);
        let after: Vec<_> = heard.bytes.iter().filter(|(at, _)| *at >= since).copied().collect();
        let at = after.windows(words.len()).position(|part| part.iter().map(|(_, byte)| byte).eq(words))?;
        Some(after[at].0)
    }

    pub(crate) fn await_words(&self, words: &[u8], since: Instant) -> Instant {
        let began = Instant::now();
        loop {
            if let Some(at) = self.time_of(words, since) {
                return at;
            }
            assert!(began.elapsed() < PATIENCE, "{:?} in {}", String::from_utf8_lossy(words), self.said());
            sleep(EVERY);
        }
    }

    pub(crate) fn now(&self) -> Instant {
        Instant::now()
    }

    /// The board behind this connection is gone without notice: the connection stays, and nothing comes back.
    fn is_half_open(&self) {
        let board = locked(&self.heard).board.take().expect("a connection");
        board.shutdown(Shutdown::Both).expect("it was open");
    }

    /// Pulls the plug, or puts it back.
    pub(crate) fn is_pulled(&self, pulled: bool) {
        let mut heard = locked(&self.heard);
        heard.refuses = pulled;
        if let Some(open) = heard.open.take().filter(|_| pulled) {
            let _ = open.shutdown(Shutdown::Both);
        }
    }
}

fn locked(heard: &Mutex<Heard>) -> MutexGuard<'_, Heard> {
    heard.lock().unwrap_or_else(PoisonError::into_inner)
}

fn serve(mut program: TcpStream, board: Option<&str>, heard: &Arc<Mutex<Heard>>) {
    program.set_nodelay(true).expect("an option of sockets");
    let mut station = board.map(|board| TcpStream::connect(board).expect("the board"));
    if let Some(station) = &station {
        station.set_nodelay(true).expect("an option of sockets");
        let (mut answers, mut back) =
            (station.try_clone().expect("a handle"), program.try_clone().expect("a handle"));
        thread::spawn(move || std::io::copy(&mut answers, &mut back));
    }
    locked(heard).board = station.as_ref().and_then(|station| station.try_clone().ok());
    let heard = Arc::clone(heard);
    thread::spawn(move || {
        let mut bytes = [0; 4096];
        while let Ok(count @ 1..) = program.read(&mut bytes) {
            let now = Instant::now();
            locked(&heard).bytes.extend(bytes[..count].iter().map(|byte| (now, *byte)));
            // Once the board is gone, bytes are taken all the same, as by a connection that is half open.
            station = station.filter(|mut station| station.write_all(&bytes[..count]).is_ok());
        }
        let _ = station.map(|station| station.shutdown(Shutdown::Both));
    });
}

/// A program that drives: a guardian and its child.
pub(crate) struct Driven {
    guardian: Child,
    orders: ChildStdin,
    errors: Arc<Mutex<String>>,
}

impl Driven {
    pub(crate) fn over(link: &str, store: &Path, more: &[&str]) -> Self {
        let own = ["serve", "0", "--layout", "track-a", "--train", "24", "--link", link];
        Self::given(&[&own[..], more].concat(), store)
    }

    fn given(arguments: &[&str], store: &Path) -> Self {
        let mut guardian = Command::new(env!("CARGO_BIN_EXE_footplate"))
            .args(arguments)
            .arg("--store")
            .arg(store)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let errors = Arc::<Mutex<String>>::default();
        let (lines, all) = (BufReader::new(guardian.stderr.take().expect("its errors")), Arc::clone(&errors));
        thread::spawn(move || {
            for line in lines.lines().map_while(Result::ok) {
                let mut all = all.lock().expect("no panic");
                all.push_str(&line);
                all.push('\n');
            }
        });
        let orders = guardian.stdin.take().expect("its input");
        Self { guardian, orders, errors }
    }

    pub(crate) fn errors(&self) -> String {
        self.errors.lock().expect("no panic").clone()
    }

    /// The process that was started.
    pub(crate) fn guardian(&self) -> u32 {
        self.guardian.id()
    }

    /// The child that drives.
    pub(crate) fn child(&self) -> u32 {
        child_of(self.guardian.id()).expect("a child")
    }

    /// Waits until a child has ended that its guardian has left.
    pub(crate) fn ended_without_guardian(&self, child: u32) {
        self.await_errors("without a guardian all trains are stopped");
        let began = Instant::now();
        while Path::new(&format!("/proc/{child}/exe")).exists() {
            assert!(began.elapsed() < PATIENCE, "its child goes on: {}", self.errors());
            sleep(EVERY);
        }
    }

    pub(crate) fn await_errors(&self, words: &str) {
        let began = Instant::now();
        while !self.errors().contains(words) {
            assert!(began.elapsed() < PATIENCE, "{words} in {}", self.errors());
            sleep(EVERY);
        }
    }

    /// Where its dashboard is, of the child that was started last.
    pub(crate) fn host(&self) -> String {
        self.await_errors("the dashboard is at http://");
        let errors = self.errors();
        let at = errors.rsplit("the dashboard is at http://").next().and_then(|rest| rest.lines().next());
        at.expect("an address").trim_end_matches('/').to_owned()
    }

    pub(crate) fn order(&self, line: &str) {
        let host = self.host();
        let body = format!("{{\"line\": \"{line}\"}}");
        let mut stream = TcpStream::connect(&host).expect("a connection");
        let length = body.len();
        let request = format!(
            "POST /api/orders HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).expect("sent");
        let mut answer = [0; 64];
        let count = stream.read(&mut answer).expect("an answer");
        assert!(String::from_utf8_lossy(&answer[..count]).contains("202"));
    }

    pub(crate) fn status(&mut self) -> Option<i32> {
        let began = Instant::now();
        loop {
            if let Some(status) = self.guardian.try_wait().expect("a status") {
                return status.code();
            }
            assert!(began.elapsed() < PATIENCE, "it goes on: {}", self.errors());
            sleep(EVERY);
        }
    }
}

impl Drop for Driven {
    fn drop(&mut self) {
        if let Some(child) = child_of(self.guardian.id()) {
            signal("KILL", child);
        }
        let _ = self.guardian.kill();
        let _ = self.guardian.wait();
    }
}

/// The child of a guardian.
pub(crate) fn child_of(parent: u32) -> Option<u32> {
    let children = std::fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).ok()?;
    children.split_whitespace().next()?.parse().ok()
}

pub(crate) fn signal(name: &str, process: u32) {
    let sent = Command::new("kill").args([&format!("-{name}"), &process.to_string()]).status();
    assert!(sent.expect("kill").success());
}

/// A program that drives a calibrated train over a line to a board.
pub(crate) fn over_a_board(name: &str, more: &[&str]) -> (Standing, Line, Driven) {
    let folder = calibrated(name, 7);
    let board = Standing::with("tcp:127.0.0.1:0", "1", &["--protocol", "dcc-ex", "--seed", "7"]);
    let of_board = board.address.strip_prefix("dcc-ex:tcp://").expect(&board.address);
    let (at, settings) = of_board.split_once('?').unwrap_or((of_board, ""));
    let line = Line::to(Some(at));
    let link = format!("dcc-ex:tcp://{}?{settings}", line.place);
    let driven = Driven::over(&link, &folder.join("railway.db"), more);
    (board, line, driven)
}

/// The same, with the train running.
pub(crate) fn running(name: &str) -> (Standing, Line, Driven, Instant) {
    let (board, line, driven) = over_a_board(name, &[]);
    let began = Instant::now();
    driven.order("speed 24 8");
    line.await_words(b"<t 24 72", began);
    (board, line, driven, began)
}

/// Asserts that the train is stopped in time, and the power switched off.
pub(crate) fn stopped(line: &Line, since: Instant, how: &str) {
    let stop = line.await_words(b"<t 24 0", since) - since;
    let off = line.await_words(b"<0>", since) - since;
    println!("{how}: the stop was on the line after {stop:.1?}, power off after {off:.1?}");
    assert!(stop < WITHIN, "{how}: {stop:?}");
}

#[test]
fn every_death_stops_the_trains() {
    for death in ["KILL", "SEGV", "ABRT", "QUIT", "STOP"] {
        let (_board, line, mut driven, _) = running(&format!("guardian-{death}"));
        let since = Instant::now();
        let child = driven.child();
        signal(death, child);
        if death == "SEGV" {
            // Rust takes the first for a fault, whose instruction would fault again.
            sleep(EVERY);
            signal(death, child);
        }
        stopped(&line, since, death);
        assert!(driven.status().is_some_and(|status| status >= 128), "{}", driven.errors());
        driven.await_errors("guardian: ");
        assert!(driven.errors().contains("all trains are commanded to stop"), "{}", driven.errors());
    }
}

#[test]
fn a_guardian_that_dies_takes_its_program_with_it_and_no_train_runs() {
    let (_board, line, mut driven, _) = running("guardian-killed");
    let child = driven.child();
    let since = Instant::now();
    driven.guardian.kill().expect("killed");
    stopped(&line, since, "the guardian was killed");
    driven.ended_without_guardian(child);
    assert_eq!(locked(&line.heard).connections, 2);
}

#[test]
fn a_guardian_that_hangs_is_ended_by_its_program_and_no_train_runs() {
    let (_board, line, mut driven, _) = running("guardian-hangs");
    let child = driven.child();
    let since = Instant::now();
    signal("STOP", driven.guardian.id());
    stopped(&line, since, "the guardian hangs");
    driven.ended_without_guardian(child);
    let errors = driven.errors();
    assert!(errors.contains("the guardian has answered nothing for 600 ms; it is ended"), "{errors}");
    assert_eq!(driven.status(), None, "a signal ended it: {errors}");
    assert_eq!(locked(&line.heard).connections, 2);
}

#[test]
fn what_is_signalled_to_the_guardian_ends_the_program_in_order() {
    for (name, signals) in [("TERM", 1), ("INT", 1), ("QUIT", 0), ("TSTP", 0), ("HUP", 1)] {
        let (_board, line, mut driven, _) = running(&format!("guardian-told-{name}"));
        let since = Instant::now();
        signal(name, driven.guardian.id());
        if signals == 0 {
            // Keys of a terminal: the child hears them itself.
            sleep(WITHIN);
            assert!(line.time_of(b"<t 24 0", since).is_none(), "{name}: {}", line.said());
            continue;
        }
        stopped(&line, since, name);
        assert_eq!(driven.status(), Some(1), "{name}: {}", driven.errors());
        assert!(!driven.errors().contains("guardian: "), "{name}: {}", driven.errors());
    }
}

#[test]
fn a_line_that_was_gone_carries_the_stops_once_it_is_back() {
    let (_board, line, mut driven, _) = running("guardian-unplugged");
    // The program waits 5 s for the line and gives up; the guardian does not.
    line.is_pulled(true);
    driven.await_errors("trying for ever");
    sleep(WITHIN);
    let since = Instant::now();
    line.is_pulled(false);
    stopped(&line, since, "the plug was put back");
    assert_eq!(driven.status(), Some(2), "{}", driven.errors());
    // And if the program dies while the line is gone, it is the same.
    let (_board, line, mut driven, _) = running("guardian-unplugged-and-killed");
    line.is_pulled(true);
    signal("KILL", driven.child());
    driven.await_errors("trying for ever");
    sleep(WITHIN);
    let since = Instant::now();
    line.is_pulled(false);
    stopped(&line, since, "killed, and the plug was put back");
    assert_eq!(driven.status(), Some(128 + 9), "{}", driven.errors());
}

#[test]
fn a_connection_that_is_half_open_is_noticed_and_the_train_stopped_over_a_new_one() {
    let (_board, line, driven, _) = running("guardian-half-open");
    let since = Instant::now();
    line.is_half_open();
    driven.await_errors("the station has answered nothing");
    let silent = Instant::now();
    let stop = line.await_words(b"<t 24 0", silent);
    println!("noticed after {:.1?}, stopped after {:.1?}", silent - since, stop - since);
    // A question after 500 ms, 1.5 s without the answer, and half a second for a busy machine.
    assert!(silent - since < Duration::from_millis(2_500), "{:?}", silent - since);
    assert!(stop - silent < WITHIN, "{:?}", stop - silent);
    assert_eq!(locked(&line.heard).connections, 2);
}

#[test]
fn a_program_that_dies_is_started_again_if_that_is_wanted() {
    let folder = calibrated("guardian-restart", 7);
    let board = Standing::with("tcp:127.0.0.1:0", "1", &["--protocol", "dcc-ex", "--seed", "7"]);
    let of_board = board.address.strip_prefix("dcc-ex:tcp://").expect(&board.address);
    let (at, more) = of_board.split_once('?').unwrap_or((of_board, ""));
    let line = Line::to(Some(at));
    let link = format!("dcc-ex:tcp://{}?{more}", line.place);
    let began = Instant::now();
    let mut driven = Driven::over(&link, &folder.join("railway.db"), &["--restart"]);
    driven.order("speed 24 8");
    line.await_words(b"<t 24 72", began);
    // One that dies at once would die again.
    sleep(Duration::from_secs(11).saturating_sub(began.elapsed()));
    let first = driven.child();
    let since = Instant::now();
    signal("KILL", first);
    stopped(&line, since, "killed, to be started again");
    driven.await_errors("the program is started again");
    let before = driven.errors().len();
    let began = Instant::now();
    while !driven.errors()[before..].contains("the dashboard is at") {
        assert!(began.elapsed() < PATIENCE, "{}", driven.errors());
        sleep(EVERY);
    }
    assert_ne!(driven.child(), first);
    let since = Instant::now();
    driven.order("speed 24 8");
    line.await_words(b"<t 24 72", since);
    signal("TERM", driven.guardian.id());
    assert_eq!(driven.status(), Some(1), "{}", driven.errors());
}

#[test]
fn a_signal_in_the_pause_before_a_restart_ends_the_guardian() {
    let began = Instant::now();
    let (_board, line, mut driven) = over_a_board("guardian-restart-ended", &["--restart"]);
    driven.order("speed 24 8");
    line.await_words(b"<t 24 72", began);
    sleep(Duration::from_secs(11).saturating_sub(began.elapsed()));
    let since = Instant::now();
    signal("KILL", driven.child());
    stopped(&line, since, "killed, and ended in the pause");
    driven.await_errors("the program is started again");
    signal("TERM", driven.guardian.id());
    assert_eq!(driven.status(), Some(128 + 9), "{}", driven.errors());
    assert_eq!(driven.errors().matches("the dashboard is at").count(), 1, "{}", driven.errors());
    driven.await_errors("it is not started again");
}

#[test]
fn an_endless_line_on_standard_input_ends_nothing_and_takes_no_memory() {
    let folder = calibrated("guardian-input", 7);
    let board = Standing::with("tcp:127.0.0.1:0", "1", &["--protocol", "dcc-ex", "--seed", "7"]);
    let of_board = board.address.strip_prefix("dcc-ex:tcp://").expect(&board.address);
    let (at, more) = of_board.split_once('?').unwrap_or((of_board, ""));
    let line = Line::to(Some(at));
    let began = Instant::now();
    let mut driven = Driven::given(
        &[
            "drive",
            "--layout",
            "track-a",
            "--train",
            "24",
            "--link",
            &format!("dcc-ex:tcp://{}?{more}", line.place),
        ],
        &folder.join("railway.db"),
    );
    // Standard input is passed from the guardian to its child.
    driven.orders.write_all(b"speed 24 8\n").expect("it reads");
    line.await_words(b"<t 24 72", began);
    let before = memory_kb(driven.child(), "VmRSS:");
    let since = Instant::now();
    let piece = vec![b'x'; 1 << 20];
    for _ in 0..200 {
        driven.orders.write_all(&piece).expect("it reads");
    }
    assert!(line.time_of(b"<t 24 0", since).is_none(), "{}", line.said());
    let after = memory_kb(driven.child(), "VmRSS:");
    println!("{before} kB before and {after} kB after 200 MB");
    assert!(after < before + 20_000, "{before} kB, then {after} kB");
    driven.await_errors("a line is longer than");
    // The end of the line, and an order that is understood.
    let since = Instant::now();
    driven.orders.write_all(b"\nspeed 24 0\n").expect("it reads");
    line.await_words(b"<t 24 0", since);
    signal("TERM", driven.guardian.id());
    assert!(driven.status().is_some(), "{}", driven.errors());
}

/// A figure of a process's memory.
pub(crate) fn memory_kb(process: u32, figure: &str) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("its status");
    let line = status.lines().find_map(|line| line.strip_prefix(figure)).expect("a figure");
    line.split_whitespace().next().and_then(|figure| figure.parse().ok()).expect("a number")
}
