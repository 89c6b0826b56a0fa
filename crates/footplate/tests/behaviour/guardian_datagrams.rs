//! However the program dies, trains behind a station that exchanges datagrams are commanded to stop within a second.
//!
//! `cargo nextest run -p footplate -E 'test(over_datagrams)' --no-capture` prints how soon, as the station's end of the line
//! sees it.
#![cfg(unix)]
#![expect(clippy::disallowed_methods, reason = "how soon trains are stopped is measured")]

use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use footplate_wire::marklin_can::{Frame, Message};
use footplate_wire::z21::{Datasets, Request, Throttle};

use crate::board::calibrated_over;
use crate::guardian::{Driven, PATIENCE, WITHIN, signal};
use crate::station::Standing;

const EVERY: Duration = Duration::from_millis(5);

/// What a message to a station commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Said {
    Run,
    Stop,
    PowerOff,
}

/// What was commanded at the station's end of the line, and when.
#[derive(Debug, Clone, Default)]
pub(crate) struct Commanded(Arc<Mutex<Vec<(Instant, Said)>>>);

impl Commanded {
    pub(crate) fn push(&self, said: Said) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push((Instant::now(), said));
    }

    fn time_of(&self, what: Said, since: Instant) -> Option<Instant> {
        let said = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        said.iter().find(|(at, said)| *at >= since && *said == what).map(|(at, _)| *at)
    }

    pub(crate) fn delay_of(&self, what: Said, since: Instant) -> Duration {
        while since.elapsed() < PATIENCE {
            if let Some(at) = self.time_of(what, since) {
                return at - since;
            }
            thread::sleep(EVERY);
        }
        panic!("{what:?} was not commanded: {self:?}")
    }

    /// Asserts that the train is stopped in time by a command, and the power switched off.
    pub(crate) fn stopped(&self, by: Said, since: Instant, how: &str) {
        let stop = self.delay_of(by, since);
        let off = self.delay_of(Said::PowerOff, since);
        println!("{how}: the stop was on the line after {stop:.1?}, power off after {off:.1?}");
        assert!(stop < WITHIN, "{how}: {stop:?}");
    }
}

fn said_to_z21(datagram: &[u8]) -> Option<Said> {
    Datasets::of(datagram).find_map(|dataset| match Request::read(&dataset)? {
        Request::Drive { throttle: Throttle::Step(1..), .. } => Some(Said::Run),
        Request::Drive { .. } | Request::StopAll => Some(Said::Stop),
        Request::Power { on: false } => Some(Said::PowerOff),
        _ => None,
    })
}

fn said_to_central_station(datagram: &[u8]) -> Option<Said> {
    let frame = Frame::decode(datagram.try_into().ok()?)?;
    if frame.is_response {
        return None;
    }
    match Message::of(&frame) {
        Message::Speed { speed: Some(1..), .. } => Some(Said::Run),
        Message::Speed { speed: Some(0), .. } | Message::Halt(_) | Message::EmergencyStop(_) => {
            Some(Said::Stop)
        }
        Message::Stop(_) => Some(Said::PowerOff),
        _ => None,
    }
}

/// A network between the program and a station, which can be cut.
struct Network {
    place: SocketAddr,
    commanded: Commanded,
    is_cut: Arc<AtomicBool>,
}

impl Network {
    fn to(station: &str, meaning: fn(&[u8]) -> Option<Said>) -> Self {
        let program = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        let towards = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        towards.connect(station).expect("the station");
        let network = Self {
            place: program.local_addr().expect("an address"),
            commanded: Commanded::default(),
            is_cut: Arc::default(),
        };
        let last = Arc::<Mutex<Option<SocketAddr>>>::default();
        let (back, answers, to) = (
            program.try_clone().expect("a handle"),
            towards.try_clone().expect("a handle"),
            Arc::clone(&last),
        );
        let is_cut = Arc::clone(&network.is_cut);
        thread::spawn(move || {
            let mut bytes = [0; 2000];
            while let Ok(count) = answers.recv(&mut bytes) {
                let to = *to.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some(to) = to.filter(|_| !is_cut.load(Ordering::Acquire)) {
                    let _ = back.send_to(&bytes[..count], to);
                }
            }
        });
        let (commanded, is_cut) = (network.commanded.clone(), Arc::clone(&network.is_cut));
        thread::spawn(move || {
            let mut bytes = [0; 2000];
            while let Ok((count, from)) = program.recv_from(&mut bytes) {
                if is_cut.load(Ordering::Acquire) {
                    continue;
                }
                *last.lock().unwrap_or_else(PoisonError::into_inner) = Some(from);
                if let Some(what) = meaning(&bytes[..count]) {
                    commanded.push(what);
                }
                let _ = towards.send(&bytes[..count]);
            }
        });
        network
    }
}

/// A kind of station: its name, the link that is calibrated over, how its address begins, and what its datagrams mean.
type Kind = (&'static str, &'static str, &'static str, fn(&[u8]) -> Option<Said>);
const KINDS: [Kind; 2] = [
    ("z21", "sim:track-a?faults=none&trains=24&station=z21&seed=", "z21:", said_to_z21),
    (
        "marklin-can",
        "sim:track-a?faults=none&trains=24&station=marklin-can&seed=",
        "marklin-can:",
        said_to_central_station,
    ),
];

/// A train that runs behind a station of a kind.
fn running((name, link, begins, meaning): Kind, how: &str) -> (Standing, Network, Driven) {
    let folder = calibrated_over(link, &format!("guardian-{name}-{how}"), 7);
    let station = Standing::with("udp:127.0.0.1:0", "1", &["--protocol", name, "--seed", "7"]);
    let of_station = station.address.strip_prefix(begins).expect(&station.address);
    let (at, more) = of_station.split_once('?').unwrap_or((of_station, ""));
    let network = Network::to(at, meaning);
    let link = format!("{begins}{}?{more}", network.place);
    let driven = Driven::over(&link, &folder.join("railway.db"), &[]);
    let began = Instant::now();
    driven.order("speed 24 8");
    network.commanded.delay_of(Said::Run, began);
    (station, network, driven)
}

/// A signal has ended the program, and its guardian says what it did.
pub(crate) fn ended_by_signal(driven: &mut Driven) {
    assert!(driven.status().is_some_and(|status| status >= 128), "{}", driven.errors());
    driven.await_errors("all trains are commanded to stop");
}

#[test]
fn every_death_stops_the_trains_over_datagrams() {
    for kind in KINDS {
        for death in ["KILL", "STOP"] {
            let (_station, network, mut driven) = running(kind, death);
            let since = Instant::now();
            signal(death, driven.child());
            network.commanded.stopped(Said::Stop, since, &format!("{} {death}", kind.0));
            ended_by_signal(&mut driven);
        }
    }
}

#[test]
fn the_death_of_the_guardian_stops_the_trains_over_datagrams() {
    for kind in KINDS {
        let (_station, network, driven) = running(kind, "guardian");
        let (child, since) = (driven.child(), Instant::now());
        signal("KILL", driven.guardian());
        network.commanded.stopped(Said::Stop, since, &format!("{}, guardian killed", kind.0));
        driven.ended_without_guardian(child);
    }
}

#[test]
fn a_network_that_was_cut_carries_the_stops_over_datagrams_once_it_is_back() {
    for kind in KINDS {
        let (_station, network, mut driven) = running(kind, "cut");
        network.is_cut.store(true, Ordering::Release);
        signal("KILL", driven.child());
        driven.await_errors("trying for ever");
        let back = Instant::now();
        network.is_cut.store(false, Ordering::Release);
        let stop = network.commanded.delay_of(Said::Stop, back);
        println!("{}: the stop was on the line {stop:.1?} after the network was back", kind.0);
        // The stops are repeated every two seconds or so: a datagram does not tell that it was lost.
        assert!(stop < 3 * WITHIN, "{stop:?}");
        assert_eq!(driven.status(), Some(128 + 9), "{}", driven.errors());
        assert!(driven.errors().contains("all trains are commanded to stop"), "{}", driven.errors());
    }
}
