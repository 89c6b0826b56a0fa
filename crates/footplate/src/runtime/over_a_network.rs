//! The loop over a real connection: a station that is there, one that goes, one that says nothing, and noise in between.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use footplate_core::{EventKind, TimeSpan, Timestamp};
use footplate_store::layout_named;
use footplate_wire::LinkNotice;

use super::over_a_simulation::{Runs, Until};
use super::{Ended, Runtime};
use crate::clock::Stopwatch;
use crate::link::{
    Address, CableLink, Link, Server, SimulatedAddress, listen_on, open_pseudo_terminal, open_session,
    station,
};

/// So many times real time: a reply may take a tenth of a second of track time, and the machine be busy for a hundredth of one.
const TIMES: f64 = 10.0;

/// A station in a thread.
struct Standing {
    place: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Seen>>,
}

/// What became of it.
struct Seen {
    powered: bool,
    coils_overdue: usize,
    travelled_m: Vec<f64>,
}

impl Standing {
    fn at_a_port() -> Self {
        let (port, incoming) = listen_on("127.0.0.1:0").expect("a free port");
        Self::serve(format!("tcp://127.0.0.1:{port}"), incoming)
    }

    fn serve(place: String, incoming: std::sync::mpsc::Receiver<crate::link::Incoming>) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut address = SimulatedAddress::of("track-a").expect("a layout");
            (address.seed, address.faults) = (7, false);
            let layout = layout_named("track-a").expect("a layout").layout;
            let station = station(&address, &layout).expect("a world");
            let mut server = Server::new(station, TIMES, incoming);
            server.serve(|| stopped.load(Ordering::Relaxed));
            let world = server.station().world();
            let distance = |train| world.truth().train(train).map_or(0.0, |truth| truth.odometer.as_m());
            Seen {
                powered: world.is_powered(),
                coils_overdue: server.station().alarms().len(),
                travelled_m: address.trains.iter().map(|train| distance(*train)).collect(),
            }
        });
        Self { place, stop, thread: Some(thread) }
    }

    fn end(&mut self) -> Seen {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().expect("it is ended once").join().expect("a station that does not panic")
    }
}

fn connected(place: &str) -> Runtime<'static, CableLink> {
    let written = format!("marklin-serial:{place}?pace=fast&speed={TIMES}");
    let address: Address = written.parse().expect("an address");
    let link = CableLink::open(address.cable().expect("a line")).expect("a connection");
    let layout = layout_named("track-a").expect("a layout").layout;
    let session = open_session(&address, &link, &layout).expect("modules");
    Runtime::new(link, session, None, None)
}

fn reports(machine: &Runs) -> usize {
    machine.heard.iter().filter(|event| matches!(event.kind, EventKind::Sensor(_))).count()
}

#[test]
fn trains_run_over_a_network_as_they_do_in_process() {
    let mut standing = Standing::at_a_port();
    let mut runtime = connected(&standing.place);
    let (mut machine, mut until) = (Runs::two(), Until(Timestamp::from_s(30.0), Vec::new()));
    let ended = runtime.run(&mut machine, &mut until).expect("nothing is written down");
    assert!(matches!(ended, Ended::Finished), "{ended}");
    assert!(runtime.close().is_complete());
    // Time for the last bytes, at ten times real time.
    std::thread::sleep(std::time::Duration::from_millis(50));
    let seen = standing.end();
    assert!(reports(&machine) > 5, "{} reports, {:?}", reports(&machine), until.1);
    assert!(seen.travelled_m.iter().all(|distance| *distance > 1.0), "{:?}", seen.travelled_m);
    assert!(!seen.powered);
    assert_eq!(seen.coils_overdue, 0);
}

#[cfg(unix)]
#[test]
fn a_pseudo_terminal_is_spoken_to_by_the_clock() {
    let (path, incoming) = open_pseudo_terminal().expect("a pseudo-terminal");
    let mut standing = Standing::serve(path, incoming);
    let mut runtime = connected(&standing.place);
    assert_eq!(runtime.link().cts(), None, "it has no hand-shake that could be read");
    let (mut machine, mut until) = (Runs::two(), Until(Timestamp::from_s(25.0), Vec::new()));
    runtime.run(&mut machine, &mut until).expect("nothing is written down");
    runtime.close();
    std::thread::sleep(std::time::Duration::from_millis(50));
    let seen = standing.end();
    assert!(reports(&machine) > 3, "{} reports, {:?}", reports(&machine), until.1);
    assert!(!seen.powered);
}

#[test]
fn a_program_that_vanishes_leaves_trains_running_and_the_next_one_can_stop_them() {
    let mut standing = Standing::at_a_port();
    // Given a program that starts a train and dies without a word,
    let mut stream = TcpStream::connect(standing.place.trim_start_matches("tcp://")).expect("a connection");
    stream.write_all(&[96, 96, 24, 24]).expect("written");
    drop(stream);
    std::thread::sleep(std::time::Duration::from_millis(200));
    // when the next one connects,
    let mut runtime = connected(&standing.place);
    let mut idle = Runs::none();
    let mut until = Until(Timestamp::from_s(10.0), Vec::new());
    let ended = runtime.run(&mut idle, &mut until).expect("nothing is written down");
    assert!(matches!(ended, Ended::Finished), "{ended}");
    runtime.close();
    std::thread::sleep(std::time::Duration::from_millis(50));
    // then the train has run on, and the power is off in the end.
    let seen = standing.end();
    assert!(seen.travelled_m[0] > 0.5, "{:?}", seen.travelled_m);
    assert!(!seen.powered);
}

#[test]
fn a_station_that_vanishes_is_said_to_be_gone() {
    // Given a server that closes the connection and its port after a moment,
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let place = format!("tcp://{}", listener.local_addr().expect("an address"));
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a client");
        let mut bytes = [0; 4];
        stream.read_exact(&mut bytes).expect("the opening words");
    });
    let mut runtime = connected(&place);
    let stopwatch = Stopwatch::start();
    let mut until = Until(Timestamp::from_s(1e6), Vec::new());
    let ended = runtime.run(&mut Runs::two(), &mut until).expect("nothing is written down");
    // then it is tried again for a few seconds, and the message says what to do.
    let Ended::LineLost(_) = &ended else { panic!("{ended}") };
    assert!(ended.to_string().contains("switch the track power off by hand"), "{ended}");
    assert!(stopwatch.elapsed().as_secs_f64() < 10.0);
    assert!(!runtime.close().is_complete());
}

#[test]
fn a_station_that_says_nothing_is_given_up_within_seconds() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let place = format!("tcp://{}", listener.local_addr().expect("an address"));
    let mut runtime = connected(&place);
    let stopwatch = Stopwatch::start();
    let mut until = Until(Timestamp::from_s(1e6), Vec::new());
    let ended = runtime.run(&mut Runs::two(), &mut until).expect("nothing is written down");
    let Ended::NoAnswer(why) = &ended else { panic!("{ended}") };
    assert!(why.contains("check its power, the cable and the port"), "{why}");
    assert!(stopwatch.elapsed().as_secs_f64() < 5.0);
    // The bytes leave, and nothing confirms them.
    let closing = runtime.close();
    assert!(closing.to_string().contains("check that the trains are at rest"), "{closing}");
}

/// Passes everything on, and adds a byte to what the station says every so often.
fn noisy(place: &str, every: usize) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let noisy = format!("tcp://{}", listener.local_addr().expect("an address"));
    let station = TcpStream::connect(place.trim_start_matches("tcp://")).expect("a station");
    station.set_nodelay(true).expect("a socket");
    std::thread::spawn(move || {
        let (client, _) = listener.accept().expect("a client");
        client.set_nodelay(true).expect("a socket");
        let (mut from, mut to) =
            (client.try_clone().expect("a socket"), station.try_clone().expect("a socket"));
        std::thread::spawn(move || std::io::copy(&mut from, &mut to));
        let (mut from, mut to) = (station, client);
        let mut byte = [0];
        for count in 1.. {
            if from.read_exact(&mut byte).and_then(|()| to.write_all(&byte)).is_err() {
                return;
            }
            if count % every == 0 && to.write_all(&[0x55]).is_err() {
                return;
            }
        }
    });
    noisy
}

#[test]
fn noise_on_the_line_is_noticed_and_trains_can_still_be_stopped() {
    let mut standing = Standing::at_a_port();
    let place = noisy(&standing.place, 97);
    let mut runtime = connected(&place);
    let (mut machine, mut until) = (Runs::two(), Until(Timestamp::from_s(30.0), Vec::new()));
    let ended = runtime.run(&mut machine, &mut until).expect("nothing is written down");
    assert!(matches!(ended, Ended::Finished), "{ended}");
    assert!(runtime.close().is_complete());
    std::thread::sleep(std::time::Duration::from_millis(50));
    let noticed = until
        .1
        .iter()
        .filter(|notice| matches!(notice, LinkNotice::UnexpectedBytes { .. } | LinkNotice::ReplyLost { .. }));
    assert!(noticed.count() > 2, "{:?}", until.1);
    assert!(reports(&machine) > 3, "{:?}", until.1);
    let longest = machine.heard.iter().filter_map(|event| match event.kind {
        EventKind::Sensor(report) => report.poll_interval,
        _ => None,
    });
    assert!(longest.max().expect("reports") < TimeSpan::from_s(30.0));
    assert!(!standing.end().powered);
}
