//! The loop over a line whose other end vanishes without notice: what it says is swallowed from then on, and nothing comes back.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use footplate_core::control::Machine;
use footplate_core::{Command, TimeSpan, Timestamp};
use footplate_sim::living::CanTransport;
use footplate_store::layout_named;
use footplate_wire::{CommandError, LinkNotice};

use super::over_a_simulation::Runs;
use super::{Attendant, Ended, Runtime, Wish};
use crate::link::{
    Address, CableLink, Server, SimulatedAddress, StationKind, listen_for_datagrams, listen_for_sockets,
    listen_on, open_session, station,
};

/// So many times real time.
const TIMES: f64 = 4.0;

/// When the other end vanishes, and how long the run lasts, by the station's clock.
const VANISHES: Timestamp = Timestamp::from_ns(4_000_000_000);
const LASTS: TimeSpan = TimeSpan::from_ms(12_000);

/// What a busy machine is given on top, by the station's clock.
const BUSY: TimeSpan = TimeSpan::from_ms(400);

/// Which connection the other end still serves: earlier ones are half open.
#[derive(Clone, Default)]
struct Serves(Arc<AtomicUsize>);

/// The network between a program and a station, in which connections can be made half open.
struct Network {
    place: String,
    serves: Serves,
    connections: Arc<AtomicUsize>,
}

impl Network {
    fn half_open(&self) {
        self.serves.0.store(self.connections.load(Ordering::SeqCst), Ordering::SeqCst);
    }

    /// Each connection to a new one to the station.
    fn of_connections(port: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let place = listener.local_addr().expect("an address").to_string();
        let network = Self { place, serves: Serves::default(), connections: Arc::default() };
        let (serves, connections) = (network.serves.clone(), Arc::clone(&network.connections));
        std::thread::spawn(move || {
            for program in listener.incoming().flatten() {
                let nth = connections.fetch_add(1, Ordering::SeqCst);
                let station = TcpStream::connect(("127.0.0.1", port)).expect("the station");
                for (from, to) in [(&program, &station), (&station, &program)] {
                    from.set_nodelay(true).expect("an option of sockets");
                    let from = from.try_clone().expect("a handle");
                    pass_on(from, to.try_clone().expect("a handle"), nth, serves.clone());
                }
            }
        });
        network
    }

    /// One that loses every datagram while it is cut.
    fn of_datagrams(port: u16) -> Self {
        let [program, station] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").expect("a free port"));
        station.connect(("127.0.0.1", port)).expect("the station");
        let place = program.local_addr().expect("an address").to_string();
        let network = Self { place, serves: Serves::default(), connections: Arc::new(AtomicUsize::new(1)) };
        let serves = network.serves.clone();
        std::thread::spawn(move || {
            let mut bytes = [0; 1_500];
            let (count, from) = program.recv_from(&mut bytes).expect("a datagram");
            program.connect(from).expect("the program");
            station.send(&bytes[..count]).expect("sent");
            let (back, answers, loses) = (
                program.try_clone().expect("a handle"),
                station.try_clone().expect("a handle"),
                serves.clone(),
            );
            let is_lost = move |serves: &Serves| serves.0.load(Ordering::SeqCst) > 0;
            std::thread::spawn(move || {
                let mut bytes = [0; 1_500];
                while let Ok(count) = answers.recv(&mut bytes) {
                    let _ = is_lost(&loses) || back.send(&bytes[..count]).is_ok();
                }
            });
            while let Ok(count) = program.recv(&mut bytes) {
                let _ = is_lost(&serves) || station.send(&bytes[..count]).is_ok();
            }
        });
        network
    }
}

fn pass_on(mut from: TcpStream, mut to: TcpStream, nth: usize, serves: Serves) {
    std::thread::spawn(move || {
        let mut bytes = [0; 4_096];
        while let Ok(count @ 1..) = from.read(&mut bytes) {
            if nth >= serves.0.load(Ordering::SeqCst) && to.write_all(&bytes[..count]).is_err() {
                return;
            }
        }
    });
}

/// Makes the network half open after a while, and notes what is heard of the line.
struct Watches<'w> {
    network: &'w Network,
    vanished: Option<Timestamp>,
    heard: Vec<(Timestamp, LinkNotice)>,
    datagrams: bool,
}

impl<M: Machine> Attendant<M> for Watches<'_> {
    fn hear(&mut self, _: Timestamp, _: M::Notice) {}

    fn hear_of_line(&mut self, now: Timestamp, notice: &LinkNotice) {
        self.heard.push((now, notice.clone()));
    }

    fn hear_of_refusal(&mut self, _: Timestamp, command: Command, error: CommandError) {
        panic!("{command:?}: {error}");
    }

    fn read(&mut self, _: &str) {}

    fn attend(&mut self, now: Timestamp, _: &mut M) -> Wish {
        if now >= VANISHES && self.vanished.is_none() {
            self.network.half_open();
            self.vanished = Some(now);
        }
        let is_silent = |(_, notice): &(Timestamp, LinkNotice)| matches!(notice, LinkNotice::Silent { .. });
        if self.datagrams && self.heard.iter().any(is_silent) {
            // The cable is put back.
            self.network.serves.0.store(0, Ordering::SeqCst);
        }
        if now >= VANISHES + LASTS { Wish::Finish } else { Wish::GoOn }
    }
}

/// Runs two trains over one; returns when the silence was noticed, when the station answered again, both
/// after the other end had vanished, and the connections made.
fn runs_over(kind: StationKind, scheme: &str) -> (TimeSpan, TimeSpan, usize) {
    let datagrams = kind == StationKind::Z21;
    let listen = match kind {
        StationKind::Z21 => listen_for_datagrams,
        StationKind::Jmri => listen_for_sockets,
        _ => listen_on,
    };
    let (port, incoming) = listen("127.0.0.1:0").expect("a free port");
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    let serving = std::thread::spawn(move || {
        let mut address = SimulatedAddress::of("track-a").expect("a layout");
        (address.seed, address.faults, address.station) = (7, false, kind);
        address.quirks.can.transport = CanTransport::Stream;
        let layout = layout_named("track-a").expect("a layout").layout;
        let mut server = Server::new(station(&address, &layout).expect("a world"), TIMES, incoming);
        server.serve(|| stopped.load(Ordering::Relaxed));
    });
    let network = if datagrams { Network::of_datagrams(port) } else { Network::of_connections(port) };
    let address: Address = format!("{scheme}{}?speed={TIMES}", network.place).parse().expect("an address");
    let link = CableLink::open(address.cable().expect("a line")).expect("a connection");
    let layout = layout_named("track-a").expect("a layout").layout;
    let session = open_session(&address, &link, &layout).expect("a session");
    let mut runtime = Runtime::new(link, session, None, None);
    let mut watches = Watches { network: &network, vanished: None, heard: Vec::new(), datagrams };
    let ended = runtime.run(&mut Runs::two(), &mut watches).expect("nothing is written down");
    assert!(matches!(ended, Ended::Finished), "{scheme} {ended}: {:?}", watches.heard);
    assert!(runtime.close().is_complete(), "{scheme}");
    stop.store(true, Ordering::Relaxed);
    serving.join().expect("a station that does not panic");
    let vanished = watches.vanished.expect("it has");
    let mut after = watches.heard.iter().filter(|(at, _)| *at >= vanished);
    let mut when = |is: fn(&LinkNotice) -> bool| {
        let found = after.find(|(_, notice)| is(notice));
        found.unwrap_or_else(|| panic!("{scheme} {:?}", watches.heard)).0 - vanished
    };
    let silent = when(|notice| matches!(notice, LinkNotice::Silent { .. }));
    (silent, when(|notice| *notice == LinkNotice::Answers), network.connections.load(Ordering::SeqCst))
}

#[test]
fn a_station_that_vanished_without_notice_is_noticed_in_time_and_found_over_a_new_connection() {
    // Issue 20, point 12. The longest time until a question is asked that must be answered, and 1.5 s without the answer.
    for (kind, scheme, within_s) in [
        (StationKind::Marklin, "marklin-serial:tcp://", 1.8),
        (StationKind::DccEx, "dcc-ex:tcp://", 2.0),
        (StationKind::MarklinCan, "marklin-can:tcp://", 2.5),
        (StationKind::LocoNet, "loconet:", 2.0),
        (StationKind::Jmri, "jmri:", 2.0),
        (StationKind::Z21, "z21:", 1.7),
    ] {
        let (silent, answers, connections) = runs_over(kind, scheme);
        println!("{scheme} silent after {:.2} s, answers after {:.2} s", silent.as_s(), answers.as_s());
        assert!(silent <= TimeSpan::from_s(within_s) + BUSY, "{scheme} noticed after {silent:?}");
        // All states are asked for again: LocoNet's eight questions are 100 ms apart.
        assert!(answers - silent < TimeSpan::from_s(5.0), "{scheme} answers after {answers:?}");
        assert_eq!(connections, if kind == StationKind::Z21 { 1 } else { 2 }, "{scheme}");
    }
}
