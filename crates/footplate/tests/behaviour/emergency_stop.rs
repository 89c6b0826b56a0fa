//! An emergency stop reaches the line however many connections there are, whatever they do.
//!
//! `cargo nextest run -E 'test(emergency_stop_under_full_load)' --run-ignored all --no-capture` measures how soon.

#![expect(clippy::disallowed_methods, reason = "how long a stop takes is measured")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use crate::board::calibrated;
use crate::guardian::{child_of, signal};
use crate::station::Standing;
use crate::uploads::upload;

/// How a command to the train begins (the question `<t 24>` does not), and one that stops it, the first that an emergency stop sends.
const DRIVE: &[u8] = b"<t 24 ";
const STOP: &[u8] = b"<t 24 0 ";
/// The command that takes the power from the track, the last that it sends.
const POWER_OFF: &[u8] = b"<0>";
/// The end of a command.
const END: u8 = b'>';
/// Between two bytes of a slow one.
const SLOW: Duration = Duration::from_millis(100);
/// Nothing here takes longer.
const PATIENCE: Duration = Duration::from_secs(20);

/// What hostile or broken programs do at the same time.
#[derive(Clone, Copy)]
struct Load {
    /// Connections that say nothing.
    idle: usize,
    /// Connections that send a header byte by byte.
    slow: usize,
    /// Threads that give one order after another.
    orders: usize,
    /// Threads that upload one recording after another: more than the queue takes.
    uploads: usize,
}

/// When the commands of emergency stops were on the line.
#[derive(Clone, Default)]
struct Stops {
    trains: Vec<Instant>,
    power: Vec<Instant>,
    /// Whether the train runs.
    is_running: bool,
}

/// Passes bytes between the program and a board, and knows what was said, and when trains and power were commanded off.
pub(crate) struct Tap {
    pub(crate) place: String,
    said: Arc<Mutex<String>>,
    stops: Arc<Mutex<Stops>>,
}

impl Tap {
    pub(crate) fn before(board: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let place = listener.local_addr().expect("an address").to_string();
        let board = board.to_owned();
        let stops = Arc::<Mutex<Stops>>::default();
        let seen = Arc::clone(&stops);
        let said = Arc::<Mutex<String>>::default();
        let text = Arc::clone(&said);
        thread::spawn(move || {
            let (mut program, _) = listener.accept().expect("the program");
            let mut station = TcpStream::connect(board).expect("the board");
            for stream in [&program, &station] {
                stream.set_nodelay(true).expect("an option of sockets");
            }
            let (mut answers, mut back) =
                (station.try_clone().expect("a handle"), program.try_clone().expect("a handle"));
            thread::spawn(move || std::io::copy(&mut answers, &mut back));
            let mut bytes = [0; 4096];
            let mut command = Vec::new();
            while let Ok(count @ 1..) = program.read(&mut bytes) {
                let now = Instant::now();
                text.lock().expect("no panic").push_str(&String::from_utf8_lossy(&bytes[..count]));
                for byte in &bytes[..count] {
                    command.push(*byte);
                    if *byte == END {
                        let mut seen = seen.lock().expect("no panic");
                        match command.trim_ascii_start() {
                            said if said.starts_with(STOP) => {
                                seen.is_running = false;
                                seen.trains.push(now);
                            }
                            said if said.starts_with(DRIVE) => seen.is_running = true,
                            POWER_OFF => seen.power.push(now),
                            _ => {}
                        }
                        command.clear();
                    }
                }
                if station.write_all(&bytes[..count]).is_err() {
                    break;
                }
            }
            let _ = station.shutdown(Shutdown::Both);
        });
        Self { place, said, stops }
    }

    /// All that the program said.
    pub(crate) fn said(&self) -> String {
        self.said.lock().expect("no panic").clone()
    }

    fn stops(&self) -> Stops {
        self.stops.lock().expect("no panic").clone()
    }
}

/// `footplate serve`, until it is dropped.
pub(crate) struct Served {
    child: Child,
    address: String,
}

impl Served {
    pub(crate) fn with(store: &Path, link: &str) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_footplate"))
            .args(["serve", "0", "--layout", "track-a", "--train", "24", "--link", link, "--store"])
            .arg(store)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut errors = BufReader::new(child.stderr.take().expect("its errors")).lines();
        let line =
            errors.find_map(|line| line.ok()?.strip_prefix("the dashboard is at http://").map(str::to_owned));
        let address = line.expect("an address").trim_end_matches('/').to_owned();
        // It goes on writing, and must not wait for a reader.
        thread::spawn(move || errors.for_each(drop));
        Self { child, address }
    }

    pub(crate) fn post(&self, path: &str, body: &str) -> String {
        let mut stream = TcpStream::connect(&self.address).expect("a connection");
        send(&mut stream, &self.address, path, body).expect("an answer")
    }
}

impl Served {
    /// Ends the program and its guardian at once, as a power cut does.
    pub(crate) fn cut_power(self) {
        let driving = child_of(self.child.id());
        // Neither notices the end of the other.
        signal("STOP", self.child.id());
        if let Some(driving) = driving {
            signal("KILL", driving);
        }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // Without its guardian it would try for ever to stop trains at a board that is gone.
        if let Some(driving) = child_of(self.child.id()) {
            signal("KILL", driving);
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The first line of the answer to one request.
fn send(stream: &mut TcpStream, host: &str, path: &str, body: &str) -> std::io::Result<String> {
    stream.set_read_timeout(Some(PATIENCE))?;
    let length = body.len();
    let header = format!(
        "POST {path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
    );
    stream.write_all((header + body).as_bytes())?;
    let mut bytes = [0; 2048];
    let count = stream.read(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes[..count]).lines().next().unwrap_or_default().to_owned())
}

fn opened(host: &str, count: usize) -> Vec<TcpStream> {
    (0..count).filter_map(|_| TcpStream::connect(host).ok()).collect()
}

/// Slow connections and orders in threads, until they are to end. Counts the orders.
fn loaded(load: Load, host: &str, ends: &Arc<AtomicBool>, answered: &Arc<AtomicUsize>) {
    let (place, over) = (host.to_owned(), Arc::clone(ends));
    thread::spawn(move || {
        let mut slow = opened(&place, load.slow);
        while !over.load(Ordering::Relaxed) {
            for stream in &mut slow {
                if stream.write_all(b"G").is_err() {
                    // It was cut off: another one takes its place.
                    if let Ok(next) = TcpStream::connect(&place) {
                        *stream = next;
                    }
                }
            }
            sleep(SLOW);
        }
    });
    for _ in 0..load.orders {
        let (place, over, answered) = (host.to_owned(), Arc::clone(ends), Arc::clone(answered));
        thread::spawn(move || {
            let mut stream = None;
            while !over.load(Ordering::Relaxed) {
                let open = stream.take().or_else(|| TcpStream::connect(&place).ok());
                stream = open.and_then(|mut open| {
                    let answer = send(&mut open, &place, "/api/orders", "{\"line\": \"where\"}").ok()?;
                    answered.fetch_add(usize::from(!answer.is_empty()), Ordering::Relaxed);
                    (!answer.is_empty()).then_some(open)
                });
            }
        });
    }
}

/// Uploads in threads, until they are to end. Counts those that were computed and those that were sent away.
fn uploading(load: Load, host: &str, ends: &Arc<AtomicBool>) -> [Arc<AtomicUsize>; 2] {
    /// An hour and a half of one tachometer.
    const ROWS: usize = 100_000;
    let rows = (1..=ROWS).map(|row| format!("{:.2},10,10\n", row as f64 * 0.05));
    let recording: Arc<String> =
        Arc::new(["t_s,pulses_1,pulses_2\n".to_owned()].into_iter().chain(rows).collect());
    let [computed, refused] = [Arc::<AtomicUsize>::default(), Arc::default()];
    for _ in 0..load.uploads {
        let (place, over, recording) = (host.to_owned(), Arc::clone(ends), Arc::clone(&recording));
        let (computed, refused) = (Arc::clone(&computed), Arc::clone(&refused));
        thread::spawn(move || {
            while !over.load(Ordering::Relaxed) {
                let answer = upload(&place, "load.csv", recording.as_bytes()).unwrap_or_default();
                computed.fetch_add(usize::from(answer.contains("200 OK")), Ordering::Relaxed);
                if answer.contains("429") {
                    refused.fetch_add(1, Ordering::Relaxed);
                    sleep(SLOW);
                }
            }
        });
    }
    [computed, refused]
}

/// How soon emergency stops under a load were on the line, in order: the command to the train and that to the power.
struct Took {
    train: Vec<Duration>,
    power: Vec<Duration>,
}

fn stops_under(load: Load, name: &str, count: usize) -> Took {
    let folder = calibrated(name, 7);
    let board = Standing::with("tcp:127.0.0.1:0", "1", &["--protocol", "dcc-ex", "--seed", "7"]);
    let of_board = board.address.strip_prefix("dcc-ex:tcp://").expect(&board.address);
    let (at, more) = of_board.split_once('?').unwrap_or((of_board, ""));
    let tap = Tap::before(at);
    let served = Served::with(&folder.join("railway.db"), &format!("dcc-ex:tcp://{}?{more}", tap.place));
    let (ends, answered) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
    let idle = opened(&served.address, load.idle);
    assert_eq!(idle.len(), load.idle, "raise the limit of descriptors: ulimit -n");
    loaded(load, &served.address, &ends, &answered);
    let [computed, refused] = uploading(load, &served.address, &ends);
    // The idle ones are cut off after a while, and come again.
    let (place, over) = (served.address.clone(), Arc::clone(&ends));
    let coming = thread::spawn(move || {
        let mut idle = idle;
        let count = idle.len();
        let mut next = 0;
        while !over.load(Ordering::Relaxed) {
            if let Ok(stream) = TcpStream::connect(&place) {
                idle[next % count] = stream;
            }
            next += 1;
            sleep(Duration::from_millis(1));
        }
    });
    sleep(Duration::from_secs(1));
    let mut took = Took { train: Vec::new(), power: Vec::new() };
    for _ in 0..count {
        // Refused until the power is on again.
        let began = Instant::now();
        while !tap.stops().is_running && began.elapsed() < PATIENCE {
            for line in ["power on", "speed 24 1"] {
                let order = serde_json::json!({ "line": line }).to_string();
                assert!(retried(|| served.post("/api/orders", &order)).contains("202"));
            }
            sleep(Duration::from_millis(300));
        }
        assert!(tap.stops().is_running, "{}", tap.said());
        let (before, began) = (tap.stops().power.len(), Instant::now());
        let answer = served.post("/api/emergency-stop", "{}");
        assert!(answer.contains("202"), "{answer}");
        while tap.stops().power.len() == before && began.elapsed() < PATIENCE {
            sleep(Duration::from_micros(200));
        }
        let stops = tap.stops();
        took.train.push(*stops.trains.iter().find(|at| **at > began).expect("the train is stopped") - began);
        took.power.push(*stops.power.get(before).expect("the power is commanded off") - began);
    }
    ends.store(true, Ordering::Relaxed);
    coming.join().expect("no panic");
    assert!(answered.load(Ordering::Relaxed) > 0 || load.orders == 0, "orders were answered meanwhile");
    if load.uploads > 0 {
        let [computed, refused] = [computed, refused].map(|count| count.load(Ordering::Relaxed));
        println!("{computed} recordings were computed meanwhile, {refused} sent away from a full queue");
        assert!(computed > 0 && refused > 0, "{computed} and {refused}");
    }
    took.train.sort_unstable();
    took.power.sort_unstable();
    took
}

/// The order of a person among thousands: asked again while too many wait.
fn retried(ask: impl Fn() -> String) -> String {
    let began = Instant::now();
    loop {
        let answer = ask();
        if !answer.contains("429") || began.elapsed() > PATIENCE {
            return answer;
        }
    }
}

#[test]
fn an_emergency_stop_is_on_the_line_though_a_thousand_connections_say_nothing() {
    let load = Load { idle: 1_200, slow: 50, orders: 4, uploads: 0 };
    let took = stops_under(load, "emergency-stop", 2);
    assert_eq!(took.power.len(), 2);
    assert!(took.train.first().is_some_and(|first| *first <= took.power[0]), "the train is stopped first");
}

#[test]
#[ignore = "a measurement: needs 12 000 descriptors and a machine of its own"]
fn emergency_stop_under_full_load() {
    let nothing = Load { idle: 1, slow: 0, orders: 0, uploads: 0 };
    let full = Load { idle: 5_000, slow: 500, orders: 100, uploads: 12 };
    for load in [nothing, Load { uploads: 12, ..nothing }, Load { uploads: 0, ..full }, full] {
        let took = stops_under(load, "emergency-stop-full", 40);
        println!(
            "{} idle, {} slow, {} threads of orders, {} of uploads:",
            load.idle, load.slow, load.orders, load.uploads
        );
        for (what, took) in [("stop of the train", took.train), ("power off", took.power)] {
            assert!(!took.is_empty(), "{what}: no command");
            let of = |part: usize| took[(took.len() - 1) * part / 100].as_secs_f64() * 1e3;
            println!(
                "  {what} on the line after {:.1} ms (median), {:.1} ms (95 %), {:.1} ms (longest of {})",
                of(50),
                of(95),
                of(100),
                took.len()
            );
        }
    }
}
