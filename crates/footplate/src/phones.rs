//! Phones as throttles: a WiThrottle server on a thread of its own.
//!
//! Phones give orders in the words of the prompt through the board of the dashboard, like browsers: they are checked,
//! reserved for and recorded alike. The protocol has no token: everyone who can reach the port can drive.

mod given_orders;
mod places;

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};
use std::str::FromStr;
use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use footplate_core::track::Leg;
use footplate_core::{Approach, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::withrottle::{
    LONGEST_LINE, Phone, PhoneOrder, PhoneOutput, Railway, RosterTrain, ThrottleKey, TrainState,
};
use mdns_sd::{ServiceDaemon, ServiceInfo};
use serde::Deserialize;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::net::tcp::OwnedWriteHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;
use tokio::time::{interval, sleep, timeout};

use self::given_orders::{GivenOrders, line};
use self::places::{Place, Places};
use crate::accept_queue::listen;
use crate::clock::Stopwatch;
use crate::dashboard::{Board, Request};
use crate::link::{PowerCommand, SharedTallies};
use crate::standard_error::say;

/// JMRI's port, at which phones look first.
const USUAL_PORT: u16 = 12_090;
/// How often a phone's display follows the railway.
const DISPLAY_INTERVAL: Duration = Duration::from_millis(200);
/// A phone that does not read for so long is gone.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);
/// Pause after a connection failed for lack of descriptors.
const RETRY_PAUSE: Duration = Duration::from_millis(50);
/// The longest address without its meaning in the key: DCC's short ones go up to 127.
const LONGEST_SHORT: u16 = 127;

/// The address to serve phones at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PhonesAt(SocketAddr);

impl FromStr for PhonesAt {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let any = |port| SocketAddr::from((Ipv4Addr::UNSPECIFIED, port));
        if text.is_empty() {
            return Ok(Self(any(USUAL_PORT)));
        }
        let address = text.parse::<u16>().map(any).or_else(|_| text.parse());
        let says =
            || format!("`{text}` is no address for phones: use a port such as 12090, or 192.168.0.7:12090");
        Ok(Self(address.with_context(says)?))
    }
}

/// The server; the program's end closes it.
pub(crate) struct Phones {
    /// Announces the server on the network; nothing where that is not possible.
    _announcement: Option<ServiceDaemon>,
}

impl Phones {
    /// Serves phones until the program ends, and says where.
    ///
    /// # Errors
    /// The address is in use.
    pub(crate) fn serve(at: PhonesAt, board: &Arc<Board>, line: &SharedTallies) -> anyhow::Result<Self> {
        let listener = listen(at.0)
            .with_context(|| format!("phones cannot be served at {}: name another port", at.0))?;
        listener.set_nonblocking(true)?;
        let bound = listener.local_addr()?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        let station = Station { board: Arc::clone(board), line: Arc::clone(line), clock: Stopwatch::start() };
        thread::Builder::new().name("phones".to_owned()).spawn(move || {
            runtime.block_on(async move {
                match TcpListener::from_std(listener) {
                    Ok(listener) => station.accept(listener).await,
                    Err(error) => say!("phones are not served: {error}"),
                }
            });
        })?;
        let reach =
            if bound.ip().is_loopback() { "programs on this machine" } else { "everyone on this network" };
        say!("phones (WiThrottle, Engine Driver) connect to {bound}; {reach} can drive");
        Ok(Self { _announcement: announced(bound) })
    }
}

/// Announces the server, so that phones find it by themselves. Without a network people type the address.
fn announced(bound: SocketAddr) -> Option<ServiceDaemon> {
    if bound.ip().is_loopback() {
        return None;
    }
    let announce = || -> Result<ServiceDaemon, mdns_sd::Error> {
        let service = ServiceInfo::new(
            "_withrottle._tcp.local.",
            "Footplate",
            "footplate.local.",
            "",
            bound.port(),
            None,
        )?;
        let daemon = ServiceDaemon::new()?;
        daemon.register(service.enable_addr_auto())?;
        Ok(daemon)
    };
    announce()
        .map_err(|error| say!("the network does not announce it to phones ({error}): type the address"))
        .ok()
}

/// The railway as phones reach it.
#[derive(Clone)]
struct Station {
    board: Arc<Board>,
    line: SharedTallies,
    clock: Stopwatch,
}

/// The part of the dashboard's picture that phones show.
#[derive(Deserialize)]
struct Shown {
    trains: Vec<ShownTrain>,
    turnouts: BTreeMap<u16, Option<String>>,
}

#[derive(Deserialize)]
struct ShownTrain {
    train: u16,
    step: u8,
    reversed: bool,
    functions: Vec<u8>,
}

impl Station {
    async fn accept(self, listener: TcpListener) {
        let places = Arc::new(Places::new());
        for number in 0.. {
            let Ok((stream, _)) = listener.accept().await else {
                sleep(RETRY_PAUSE).await;
                continue;
            };
            let (station, places, leaves) = (self.clone(), Arc::clone(&places), places.add(number));
            tokio::spawn(async move {
                station.converse(stream, &leaves, || places.take(number)).await;
                places.forget(number);
            });
        }
    }

    fn now(&self) -> Timestamp {
        Timestamp::ZERO + TimeSpan::from_s(self.clock.elapsed().as_secs_f64())
    }

    /// The railway; `None` before the session shows its first picture.
    fn railway(&self) -> Option<Railway> {
        let text = Arc::clone(&self.board.pictures().borrow());
        let shown: Shown = serde_json::from_str(&text).ok()?;
        let trains = shown.trains.iter().map(|shown| TrainState {
            train: TrainId(shown.train),
            step: SpeedStep::new(shown.step).unwrap_or_default(),
            forward: !shown.reversed,
            functions: shown
                .functions
                .iter()
                .fold(0, |set, number| set | 1_u32.checked_shl((*number).into()).unwrap_or(0)),
        });
        let leg = |name: &String| if name == "curved" { Leg::Curved } else { Leg::Straight };
        let power = self.line.lock().unwrap_or_else(PoisonError::into_inner).power;
        Some(Railway {
            power: power.map(PowerCommand::is_on),
            trains: trains.collect(),
            turnouts: shown
                .turnouts
                .iter()
                .map(|(number, name)| (TurnoutId(*number), name.as_ref().map(leg)))
                .collect(),
        })
    }

    /// The trains with their speeds by step; `None` before the session shows its motion models.
    fn roster(&self, railway: &Railway) -> Option<Vec<RosterTrain>> {
        let of_train = |state: &TrainState| {
            let train = state.train;
            let model = self.board.model(train)?;
            let steps = (0..=model.highest().get()).filter_map(SpeedStep::new);
            Some(RosterTrain {
                key: ThrottleKey { is_long: train.0 > LONGEST_SHORT, train },
                name: format!("train {train}"),
                speeds: steps.map(|step| model.speed(step, Approach::Below).value.as_m_per_s()).collect(),
            })
        };
        railway.trains.iter().map(of_train).collect()
    }

    /// One phone, from its first to its last line; it takes its place with the first, and is closed if there is none. However it ends,
    /// its trains are stopped.
    async fn converse(&self, stream: TcpStream, leaves: &Notify, take_place: impl Fn() -> Option<Place>) {
        let _ = stream.set_nodelay(true);
        let (read, mut write) = stream.into_split();
        let mut read = BufReader::new(read);
        let mut display = interval(DISPLAY_INTERVAL);
        let (roster, railway) = loop {
            tokio::select! {
                _ = display.tick() => {}
                () = leaves.notified() => return,
            }
            let shown = self.railway().and_then(|railway| Some((self.roster(&railway)?, railway)));
            if let Some(shown) = shown {
                break shown;
            }
        };
        let mut phone = Phone::connected(self.now(), roster, railway);
        let (mut given, mut refusals) = (GivenOrders::default(), self.board.refusals());
        let (mut line, mut place) = (Vec::new(), None);
        while self.carry_out(&mut phone, &mut given, &mut write).await {
            let silent_at = phone.next_timeout().map(|at| (at - self.now()).as_s().max(0.0));
            let silence = async {
                match silent_at {
                    Some(seconds) => sleep(Duration::from_secs_f64(seconds)).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                ended = next_line(&mut read, &mut line) => {
                    if ended.is_some() && place.is_none() {
                        place = take_place();
                    }
                    if ended.is_none() || place.is_none() {
                        break;
                    }
                    let text = String::from_utf8_lossy(&line).trim().to_owned();
                    line.clear();
                    phone.handle_line(self.now(), &text);
                }
                _ = display.tick() => {
                    if let Some(railway) = self.railway() {
                        phone.handle_railway(self.now(), railway);
                    }
                }
                refusal = refusals.recv() => {
                    if let Ok(refusal) = refusal && given.remove(&refusal) {
                        phone.handle_refusal(self.now(), &refusal.why);
                    }
                }
                () = leaves.notified(), if place.is_none() => break,
                () = silence => phone.handle_timeout(self.now()),
            }
        }
        phone.handle_closed();
        self.carry_out(&mut phone, &mut given, &mut write).await;
    }

    /// Sends the lines and carries out the orders of a phone. Returns whether the conversation goes on.
    async fn carry_out(
        &self,
        phone: &mut Phone,
        given: &mut GivenOrders,
        write: &mut OwnedWriteHalf,
    ) -> bool {
        let mut goes_on = true;
        while let Some(output) = phone.poll_output() {
            match output {
                PhoneOutput::Line(line) if goes_on => {
                    let text = format!("{line}\n");
                    goes_on =
                        matches!(timeout(WRITE_TIMEOUT, write.write_all(text.as_bytes())).await, Ok(Ok(())));
                }
                // The trains of a phone that does not read are stopped without more waiting.
                PhoneOutput::Line(_) => {}
                PhoneOutput::Order(order) => match self.order(order).await {
                    Ok(()) => given.add(order),
                    Err(why) => phone.handle_refusal(self.now(), &why),
                },
                PhoneOutput::Close => goes_on = false,
            }
        }
        goes_on
    }

    async fn order(&self, order: PhoneOrder) -> Result<(), String> {
        let request = line(order).map_or(Request::EmergencyStop, Request::Line);
        self.board.ask_and_wait(request).await.map(drop).map_err(|not_done| not_done.says().to_owned())
    }
}

/// Reads to the next line end; `line` keeps what has arrived so far when the wait is given up. `None` at the end of the
/// connection, or of a line that is too long.
async fn next_line(read: &mut BufReader<tokio::net::tcp::OwnedReadHalf>, line: &mut Vec<u8>) -> Option<()> {
    loop {
        let available = read.fill_buf().await.ok().filter(|bytes| !bytes.is_empty())?;
        let end = available.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let taken = end.unwrap_or(available.len());
        line.extend_from_slice(&available[..taken]);
        read.consume(end.map_or(taken, |end| end + 1));
        if line.len() > LONGEST_LINE {
            return None;
        }
        if end.is_some() && !line.is_empty() {
            return Some(());
        }
    }
}
