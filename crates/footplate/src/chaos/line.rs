//! The line to the station, which loses, delays and garbles bytes and breaks.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp, TrainId};
use footplate_eval::seeds::Choice;

use super::life::Spell;
use super::plan::{Planned, Trouble};
use super::transport::Transport;
use crate::link::{Cable, FromSimulated, Heard, Link, Lost, SimulatedStation};
use crate::runtime::WillLine;

/// How often the operator acts: seldom enough that a story of minutes takes a second.
pub(super) const PATIENCE: TimeSpan = TimeSpan::from_ms(25);
/// How often the true motion is checked while trains are to be stopped.
const LOOK: TimeSpan = TimeSpan::from_ms(5);

/// A segment that is lost or garbled on a connection is sent again after this time (the shortest of Linux, RFC 6298).
const SENT_AGAIN_AFTER: TimeSpan = TimeSpan::from_ms(200);

/// The station of a story, shared by all its lives.
pub(super) type SharedStation<'l> = Rc<RefCell<SimulatedStation<'l>>>;

/// The line of one life of the program.
pub(super) struct FaultyLine<'l> {
    station: SharedStation<'l>,
    cable: Cable,
    trains: Vec<TrainId>,
    choice: Choice,
    began: Timestamp,
    troubles: Vec<Planned>,
    /// Failures of one moment that have happened.
    begun: Vec<bool>,
    arrivals: VecDeque<(Timestamp, Heard)>,
    is_open: bool,
    transport: Transport,
    has_answered: bool,
    /// Whether trains are to be stopped.
    is_watched: bool,
    /// When all trains had received their stop, or had no power.
    pub(super) stopped_at: Option<Timestamp>,
    /// What happened, for people.
    pub(super) notes: Vec<(Timestamp, String)>,
}

impl<'l> FaultyLine<'l> {
    pub(super) fn new(
        station: SharedStation<'l>,
        cable: Cable,
        trains: &[TrainId],
        troubles: &[Planned],
        choice: Choice,
    ) -> Self {
        let began = station.borrow().now();
        Self {
            station,
            trains: trains.to_vec(),
            choice,
            began,
            begun: vec![false; troubles.len()],
            troubles: troubles.to_vec(),
            arrivals: VecDeque::new(),
            is_open: false,
            transport: Transport::of(&cable),
            cable,
            has_answered: false,
            is_watched: false,
            stopped_at: None,
            notes: Vec::new(),
        }
    }

    /// From now on, or no longer, it is noted when all trains are stopped.
    pub(super) fn watch_stops(&mut self, is_watched: bool) {
        (self.is_watched, self.stopped_at) = (is_watched, None);
        self.look();
    }

    fn look(&mut self) {
        if self.is_watched && self.stopped_at.is_none() && self.all_stopped() {
            self.stopped_at = Some(self.time());
        }
    }

    pub(super) fn tell(&mut self, words: impl Into<String>) {
        let now = self.time();
        self.notes.push((now, words.into()));
    }

    pub(super) fn time(&self) -> Timestamp {
        self.station.borrow().now()
    }

    /// The time since the beginning of this life.
    fn age(&self) -> Timestamp {
        Timestamp::ZERO + (self.time() - self.began)
    }

    fn now_in<T>(&self, pick: impl Fn(Trouble) -> Option<T>) -> Option<T> {
        let age = self.age();
        self.troubles
            .iter()
            .filter(|planned| planned.spell.covers(age))
            .find_map(|planned| pick(planned.trouble))
    }

    /// The spans of world time in which no command reaches the station.
    pub(super) fn unreachable(&self) -> Vec<Spell> {
        let cuts = self.troubles.iter().filter(|planned| self.cuts_off(planned.trouble));
        let at = |time: Timestamp| self.began + (time - Timestamp::ZERO);
        cuts.map(|cut| Spell { from: at(cut.spell.from), until: at(cut.spell.until) }).collect()
    }

    /// Begins a failure of one moment that is due. Returns the one that a process has, and its time.
    pub(super) fn happen(&mut self) -> Option<(Trouble, TimeSpan)> {
        for at in 0..self.troubles.len() {
            let Planned { trouble, spell } = self.troubles[at];
            if self.begun[at] || self.age() < spell.from {
                continue;
            }
            self.begun[at] = true;
            let lasts = spell.until - spell.from;
            self.tell(format!("{trouble:?} for {:.2} s", lasts.as_s()));
            match trouble {
                Trouble::Cut => {
                    self.arrivals.clear();
                    if self.transport != Transport::Datagrams {
                        self.lose("the line is cut");
                    }
                }
                Trouble::StationOff => self.switch_station_off(lasts),
                Trouble::Hang | Trouble::GuardianHang => return Some((trouble, lasts)),
                _ => {}
            }
        }
        None
    }

    fn lose(&mut self, why: &str) {
        self.is_open = false;
        self.arrivals.push_back((self.time(), Heard::Lost(Lost(why.to_owned()))));
    }

    /// Whether no connection can be made.
    pub(super) fn is_unreachable(&self) -> bool {
        self.now_in(|trouble| self.cuts_off(trouble).then_some(())).is_some()
    }

    /// Whether no byte reaches the station in a trouble: the line is cut, or JMRI, which is a program, does not run.
    fn cuts_off(&self, trouble: Trouble) -> bool {
        let is_off = trouble == Trouble::StationOff;
        trouble == Trouble::Cut || is_off && matches!(&*self.station.borrow(), SimulatedStation::Jmri(_))
    }

    fn switch_station_off(&mut self, dark_for: TimeSpan) {
        if matches!(&*self.station.borrow(), SimulatedStation::Jmri(_)) {
            self.arrivals.clear();
            self.lose("JMRI has ended");
        }
        match &mut *self.station.borrow_mut() {
            SimulatedStation::Marklin(station) => station.restart(dark_for),
            SimulatedStation::DccEx(board) => board.restart(),
            SimulatedStation::Z21(station) => station.restart(),
            SimulatedStation::Can(station) => station.restart(),
            SimulatedStation::LocoNet(station) => station.restart(),
            SimulatedStation::Jmri(jmri) => jmri.restart(),
        }
    }

    /// Advances the world to a time at most, and to the next thing that happens before.
    pub(super) fn step(&mut self, until: Timestamp) {
        let now = self.time();
        let due = self.arrivals.front().map(|(at, _)| *at);
        let begins = self.troubles.iter().zip(&self.begun).filter(|(_, begun)| !**begun);
        let begins = begins.map(|(planned, _)| self.began + (planned.spell.from - Timestamp::ZERO)).min();
        let looks = self.is_watched.then(|| now + LOOK);
        let next =
            [due, begins, looks].into_iter().flatten().filter(|at| *at > now).fold(until, Timestamp::min);
        let heard = self.station.borrow_mut().advance(next.max(now));
        if let Some(heard) = heard {
            self.hear(heard);
        }
        self.look();
    }

    /// Advances the world; what arrives waits.
    fn advance(&mut self, until: Timestamp) {
        while self.time() < until {
            self.step(until);
        }
    }

    /// What has arrived by now.
    pub(super) fn arrived(&mut self) -> Option<Heard> {
        let now = self.time();
        self.arrivals.pop_front_if(|(at, _)| *at <= now).map(|(_, heard)| heard)
    }

    /// Schedules the arrival of bytes from the station, unless they are lost.
    fn hear(&mut self, heard: FromSimulated) {
        if self.is_unreachable() || !self.is_open {
            return;
        }
        let delay = self.now_in(|trouble| match trouble {
            Trouble::Delay(delay) => Some(delay),
            _ => None,
        });
        let (noise, loss) = self.rates();
        let is_late = self.transport == Transport::Connection && (self.happens(noise) || self.happens(loss));
        let again = if is_late { SENT_AGAIN_AFTER } else { TimeSpan::ZERO };
        let at = self.time() + delay.unwrap_or(TimeSpan::ZERO) + again;
        // Bytes keep their order.
        let at = self.arrivals.back().map_or(at, |(last, _)| at.max(*last));
        match heard {
            FromSimulated::Cts(up) => self.arrivals.push_back((at, Heard::Cts(up))),
            FromSimulated::Bytes(bytes) => {
                for byte in bytes {
                    if let Some(byte) = self.passed(byte) {
                        self.arrivals.push_back((at, Heard::Byte(byte)));
                    }
                }
            }
            FromSimulated::Datagram(_, datagram) => {
                if let Some(datagram) = self.passed_datagram(datagram) {
                    self.arrivals.push_back((at, Heard::Datagram(datagram)));
                }
            }
        }
    }

    fn happens(&mut self, percent: Option<f64>) -> bool {
        percent.is_some_and(|percent| self.choice.between(0.0, 100.0) < percent)
    }

    fn rates(&self) -> (Option<f64>, Option<f64>) {
        let noise = self.now_in(|trouble| match trouble {
            Trouble::Noise(percent) => Some(percent),
            _ => None,
        });
        let loss = self.now_in(|trouble| match trouble {
            Trouble::Loss(percent) => Some(percent),
            _ => None,
        });
        (noise, loss)
    }

    /// A byte as it arrives; `None` if it is lost.
    fn passed(&mut self, byte: u8) -> Option<u8> {
        if self.transport == Transport::Connection {
            return Some(byte);
        }
        let (noise, loss) = self.rates();
        if self.happens(loss) {
            return None;
        }
        Some(if self.happens(noise) {
            byte ^ (1 << (self.choice.between(0.0, 8.0) as u8).min(7))
        } else {
            byte
        })
    }

    /// A datagram arrives whole or not at all: the network has checksums.
    fn passed_datagram(&mut self, datagram: Vec<u8>) -> Option<Vec<u8>> {
        let (noise, loss) = self.rates();
        (!self.happens(loss) && !self.happens(noise)).then_some(datagram)
    }

    /// Puts bytes on the line.
    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        if self.transport == Transport::Datagrams {
            if !self.is_unreachable()
                && let Some(bytes) = self.passed_datagram(bytes.to_vec())
            {
                self.station.borrow_mut().write(&bytes);
            }
            return Ok(());
        }
        if self.is_unreachable() || !self.is_open {
            self.is_open = false;
            return Err(Lost("the line is cut".to_owned()));
        }
        let bytes: Vec<u8> = bytes.iter().filter_map(|byte| self.passed(*byte)).collect();
        self.station.borrow_mut().write(&bytes);
        Ok(())
    }

    /// Whether no train is commanded to run, or none can.
    pub(super) fn all_stopped(&self) -> bool {
        let station = self.station.borrow();
        let world = station.world();
        let stands = |train: &TrainId| {
            world.truth().train(*train).is_none_or(|truth| truth.commanded.get() == 0 || truth.is_wrecked)
        };
        !world.is_powered() || self.trains.iter().all(stands)
    }

    /// Opens the line, anew if it is open.
    pub(super) fn connect(&mut self) -> Result<(), Lost> {
        if self.is_unreachable() && self.transport != Transport::Datagrams {
            return Err(Lost("the line is cut".to_owned()));
        }
        self.arrivals.clear();
        self.is_open = true;
        self.station.borrow_mut().connect();
        Ok(())
    }

    /// Closes it: the process that held it has ended.
    pub(super) fn close(&mut self) {
        self.arrivals.clear();
        self.is_open = false;
    }

    /// Lets a trouble begin that is due, in which the process that holds the line hangs.
    fn hang(&mut self, hangs: Trouble) {
        while let Some((trouble, span)) = self.happen() {
            if trouble == hangs {
                self.advance(self.time() + span);
            }
        }
    }
}

/// The line of a program without a guardian.
impl Link for FaultyLine<'_> {
    fn now(&self) -> Timestamp {
        self.time()
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        self.hang(Trouble::Hang);
        self.put(bytes)
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        loop {
            self.hang(Trouble::Hang);
            if let Some(heard) = self.arrived() {
                return heard;
            }
            if !self.is_open && self.transport != Transport::Datagrams {
                return Heard::Lost(Lost("the line is gone".to_owned()));
            }
            if self.time() >= until {
                return Heard::Nothing;
            }
            self.step(until);
        }
    }

    fn cts(&self) -> Option<bool> {
        self.station.borrow().cts()
    }

    fn patience(&self) -> TimeSpan {
        PATIENCE
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        self.connect()
    }

    fn real_time(&self) -> Duration {
        Duration::from_secs_f64((self.time() - Timestamp::ZERO).as_s())
    }
}

/// The same line when the guardian uses it.
impl WillLine for FaultyLine<'_> {
    fn is_open(&self) -> bool {
        self.is_open
    }

    fn open(&mut self) -> Result<(), Lost> {
        self.connect()
    }

    fn close(&mut self) {
        self.is_open = false;
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        self.put(bytes)
    }

    fn cts(&self) -> Option<bool> {
        self.station.borrow().cts()
    }

    fn pause(&mut self, span: Duration) {
        let until = self.time() + TimeSpan::from_s(span.as_secs_f64());
        while self.time() < until {
            self.step(until);
            self.hang(Trouble::GuardianHang);
            while let Some(heard) = self.arrived() {
                self.has_answered |= matches!(heard, Heard::Byte(_) | Heard::Datagram(_));
            }
        }
    }

    fn has_answered(&self) -> bool {
        !self.cable.has_answers() || self.has_answered
    }

    fn expect_answer(&mut self) {
        self.has_answered = false;
    }

    fn gives_up(&self) -> bool {
        false
    }

    fn say(&self, _: &str) {}
}
