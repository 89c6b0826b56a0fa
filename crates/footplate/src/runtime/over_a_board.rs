//! The loop over a DCC-EX board: over a network with every quirk of its line, reset meanwhile, and left alone.

use std::io::Write;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use footplate_core::{EventKind, TimeSpan, Timestamp};
use footplate_store::layout_named;
use footplate_wire::LinkNotice;

use super::over_a_simulation::{Runs, Until};
use super::{Ended, Runtime};
use crate::link::{
    Address, CableLink, Link, Server, SimulatedAddress, SimulatedStation, Speed, listen_on, open_session,
    open_simulated, station,
};

/// So many times real time.
const TIMES: f64 = 10.0;

/// A board in a thread.
struct Served {
    place: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Seen>>,
}

/// What became of it.
struct Seen {
    powered: bool,
    travelled_m: Vec<f64>,
}

impl Served {
    fn with(quirks: &str) -> Self {
        let written = format!("sim:track-a?seed=7&faults=none&station=dcc-ex{quirks}");
        let (port, incoming) = listen_on("127.0.0.1:0").expect("a free port");
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let Ok(Address::Simulated(address)) = written.parse() else { panic!("a simulated one") };
            let layout = layout_named("track-a").expect("a layout").layout;
            let mut server = Server::new(station(&address, &layout).expect("a world"), TIMES, incoming);
            server.serve(|| stopped.load(Ordering::Relaxed));
            let world = server.station().world();
            let distance = |train| world.truth().train(train).map_or(0.0, |truth| truth.odometer.as_m());
            let SimulatedAddress { trains, .. } = &address;
            Seen {
                powered: world.is_powered(),
                travelled_m: trains.iter().map(|train| distance(*train)).collect(),
            }
        });
        Self { place: format!("tcp://127.0.0.1:{port}"), stop, thread: Some(thread) }
    }

    fn end(&mut self) -> Seen {
        // Time for the last bytes, at ten times real time.
        std::thread::sleep(std::time::Duration::from_millis(50));
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().expect("it is ended once").join().expect("a board that does not panic")
    }
}

fn connected(place: &str) -> Runtime<'static, CableLink> {
    let address: Address = format!("dcc-ex:{place}?speed={TIMES}").parse().expect("an address");
    let link = CableLink::open(address.cable().expect("a line")).expect("a connection");
    let layout = layout_named("track-a").expect("a layout").layout;
    let session = open_session(&address, &link, &layout).expect("a session");
    Runtime::new(link, session, None, None)
}

fn reports(machine: &Runs) -> usize {
    machine.heard.iter().filter(|event| matches!(event.kind, EventKind::Sensor(_))).count()
}

#[test]
fn trains_run_and_stop_over_a_network_whatever_its_line_is_like() {
    for quirks in ["", "&quirks=chatter,split", "&quirks=chatter,merged", "&quirks=lossy,split"] {
        let mut served = Served::with(quirks);
        let mut runtime = connected(&served.place);
        let (mut machine, mut until) = (Runs::two(), Until(Timestamp::from_s(30.0), Vec::new()));
        let ended = runtime.run(&mut machine, &mut until).expect("nothing is written down");
        assert!(matches!(ended, Ended::Finished), "{quirks}: {ended}");
        let closing = runtime.close();
        assert!(closing.is_complete() && closing.commanded_to_stop.len() == 2, "{quirks}: {closing}");
        let seen = served.end();
        assert!(reports(&machine) > 5, "{quirks}: {} reports, {:?}", reports(&machine), until.1);
        assert!(seen.travelled_m.iter().all(|distance| *distance > 1.0), "{quirks}: {:?}", seen.travelled_m);
        assert!(!seen.powered, "{quirks}");
        assert!(machine.heard.is_sorted_by_key(|event| event.time), "{quirks}");
    }
}

#[test]
fn a_program_that_vanishes_leaves_trains_running_and_the_next_one_can_stop_them() {
    let mut served = Served::with("");
    let mut stream = TcpStream::connect(served.place.trim_start_matches("tcp://")).expect("a connection");
    stream.write_all(b"<1><t 24 72 1>").expect("written");
    std::thread::sleep(std::time::Duration::from_millis(300));
    drop(stream);
    std::thread::sleep(std::time::Duration::from_millis(300));
    let mut runtime = connected(&served.place);
    let mut until = Until(Timestamp::from_s(3.0), Vec::new());
    let ended = runtime.run(&mut Runs::none(), &mut until).expect("nothing is written down");
    assert!(matches!(ended, Ended::Finished), "{ended}");
    assert!(runtime.close().is_complete());
    let seen = served.end();
    assert!(seen.travelled_m[0] > 0.5, "{:?}", seen.travelled_m);
    assert!(!seen.powered);
}

#[test]
fn a_board_that_is_reset_stops_its_trains_and_is_opened_anew() {
    let address: Address = "sim:track-a?seed=7&faults=none&station=dcc-ex".parse().expect("an address");
    let Address::Simulated(simulated) = &address else { panic!("a simulated one") };
    let layout = layout_named("track-a").expect("a layout").layout;
    let link = open_simulated(simulated, &layout, Speed::Unpaced).expect("a world");
    let session = open_session(&address, &link, &layout).expect("a session");
    let mut runtime = Runtime::new(link, session, None, None);
    let (mut machine, mut until) = (Runs::two(), Until(Timestamp::from_s(20.0), Vec::new()));
    runtime.run(&mut machine, &mut until).expect("nothing is written down");
    let SimulatedStation::DccEx(board) = runtime.link_mut().station_mut() else { panic!("a board") };
    board.restart();
    let mut until = Until(runtime.link().now() + TimeSpan::from_s(10.0), Vec::new());
    let ended = runtime.run(&mut Runs::none(), &mut until).expect("nothing is written down");
    assert!(matches!(ended, Ended::Finished), "{ended}");
    let place = |notice: &LinkNotice| until.1.iter().position(|heard| heard == notice);
    let (restarted, answers) = (place(&LinkNotice::Restarted), place(&LinkNotice::Answers));
    assert!(restarted.is_some() && restarted < answers, "{:?}", until.1);
    let world = runtime.link().station().world();
    assert!(world.is_powered(), "the session has given power again");
    for train in &simulated.trains {
        assert!(world.truth().train(*train).expect("it is there").at_rest_since.is_some(), "{train} runs");
    }
    assert!(runtime.close().is_complete());
}
