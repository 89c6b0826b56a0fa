//! The session with a station: stops first, one command at a time for each train, and everything confirmed.

mod commanding;
mod hearing;

use alloc::vec::Vec;

use footplate_core::{Command, DecoderSteps, SensorId, TimeSpan, Timestamp, TrainId};

use super::frame::hash_of;
use super::framing::Framing;
use super::inputs::Inputs;
use super::message::Message;
use super::opening::Question;
use super::outstanding::Awaited;
use super::roster::{ListedLocomotive, Roster};
use super::settings::{Settings, Transport};
use super::solenoid::Solenoid;
use super::uid::Uid;
use crate::dialogue::{Dialogue, Opening};
use crate::outstanding::Outgoing;
use crate::pacing::Pacing;
use crate::session::{Closing, CommandError, Session, Transmit};
use crate::silence::Checks;

/// A frame takes half a millisecond on the bus, and datagrams in quick succession get lost: 100 a second, four at once, and a stop
/// 2 ms after the frame before it.
const PACING: Pacing = Pacing::new(TimeSpan::from_ms(10), 4, TimeSpan::from_ms(2));

/// The interval between polls of all inputs, which find changes whose reports were lost and show that the station is alive.
const POLL_EVERY: TimeSpan = TimeSpan::from_ms(1_000);

/// The rest of a frame arrives within this time.
const FRAME_WITHIN: TimeSpan = TimeSpan::from_ms(200);

/// Opens an adapter: end a half-written line, close, 250 kbit/s, open.
const OPEN_ADAPTER: &[u8] = b"\r\rC\rS5\rO\r";

/// What the user should check on a network.
const NETWORK_CHECKS: Checks = Checks {
    nothing_heard: "check its power and network cable, that CAN is switched on in the station's settings, and that a CS2 sends to this \
                    computer's address",
    nothing_whole: "check that the address belongs to a CS2 or CS3 (port 15731)",
    noise: "check that the address belongs to a CS2 or CS3 (port 15731)",
};

/// The same behind an adapter.
const ADAPTER_CHECKS: Checks = Checks {
    nothing_heard: "check the power of the track box, the CAN cable and the port",
    nothing_whole: "check that the port belongs to a CAN adapter that understands slcan (Lawicel)",
    noise: "check that the port belongs to a CAN adapter that understands slcan (Lawicel), and that no other program uses it",
};

/// The client's session with a station.
#[derive(Debug, Clone)]
pub struct Client {
    settings: Settings,
    hash: u16,
    dialogue: Dialogue<Awaited>,
    framing: Framing,
    opening: Opening<Question>,
    /// Whether to halt all locomotives next, whatever their numbers.
    halts_all: bool,
    roster: Roster,
    inputs: Inputs,
    /// Participants that have identified themselves.
    participants: Vec<Uid>,
    solenoid: Option<Solenoid>,
    /// Locomotives whose state must be read, and those whose reported state does not fit the commands.
    unverified: Vec<(TrainId, Query)>,
    suspected: Vec<TrainId>,
    /// Whether the station answers polls of its modules, and when it was polled last.
    has_modules: bool,
    polled: Timestamp,
    /// When the last byte arrived.
    arrived: Timestamp,
    /// Whether the station was silent and its states have not been read since.
    is_blind: bool,
}

/// A question about a locomotive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Query {
    Speed,
    Direction,
}

impl Client {
    /// A session over a line that has just been opened.
    #[must_use]
    pub fn new(now: Timestamp, settings: Settings) -> Self {
        let checks = match settings.transport {
            Transport::Network => NETWORK_CHECKS,
            Transport::Adapter => ADAPTER_CHECKS,
        };
        let mut client = Self {
            settings,
            hash: hash_of(settings.uid.0),
            dialogue: Dialogue::new(now, PACING, checks),
            framing: Framing::new(settings.transport),
            opening: Opening::asking(Question::ALL),
            halts_all: false,
            roster: Roster::default(),
            inputs: Inputs::default(),
            participants: Vec::new(),
            solenoid: None,
            unverified: Vec::new(),
            suspected: Vec::new(),
            has_modules: true,
            polled: now,
            arrived: now,
            is_blind: false,
        };
        client.open_adapter();
        client.go_on(now);
        client
    }

    /// What it was opened with.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The locomotives that the station has listed.
    #[must_use]
    pub fn listed_locomotives(&self) -> &[ListedLocomotive] {
        self.roster.list()
    }

    /// Opens an adapter, and starts a track box behind it that may wait in its loader.
    fn open_adapter(&mut self) {
        if self.settings.transport == Transport::Adapter {
            self.dialogue.write(OPEN_ADAPTER.to_vec());
            self.write(Message::Start(Uid::ALL), false);
        }
    }

    /// Sends what is due.
    fn go_on(&mut self, now: Timestamp) {
        self.is_blind |= self.dialogue.watch(now);
        while let Some(next) = self.next(now) {
            self.send(now, next);
        }
    }

    /// Returns the next request, if one may be written now.
    fn next(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        if !self.dialogue.may_write(now) {
            return None;
        }
        if core::mem::take(&mut self.halts_all) {
            return Some(Outgoing::says(Message::Halt(Uid::ALL)));
        }
        // A speed contains no direction, so a train can be stopped before its direction is known.
        if let Some(command) = self.dialogue.next_stop(now, false) {
            return Some(self.outgoing(now, command));
        }
        if let Some(repeat) = self.next_repeat(now, true) {
            return Some(repeat);
        }
        if let Some(release) = self.next_release(now) {
            return Some(release);
        }
        if self.dialogue.switch_off_is_due(now) {
            return Some(self.outgoing(now, Command::PowerOff));
        }
        if now < self.dialogue.pacing.usual_at() || self.dialogue.farewell.has_begun() {
            return None;
        }
        self.next_repeat(now, false).or_else(|| self.next_usual(now))
    }

    fn next_usual(&mut self, now: Timestamp) -> Option<Outgoing<Awaited>> {
        let has_question = self.dialogue.outstanding.any(Awaited::is_question);
        if let Opening::Asking(questions) = &mut self.opening {
            if has_question {
                return None;
            }
            match questions.pop_front() {
                Some(question) => return Some(self.asking(now, question)),
                None => self.opened(),
            }
        }
        if let Some((train, query)) = self.unverified.pop() {
            return Some(self.query(train, query));
        }
        let outstanding = &self.dialogue.outstanding;
        let is_asked = |train| outstanding.has(&Awaited::AnyDirection(train, Uid::ALL));
        if let Some(train) = self.dialogue.undirected(is_asked) {
            return Some(self.query(train, Query::Direction));
        }
        if let Some(command) = self.dialogue.next_command(self.solenoid.is_none()) {
            return Some(self.outgoing(now, command));
        }
        let question = if self.has_modules { Question::Modules } else { Question::Ping };
        (now >= self.poll_due() && !has_question).then(|| self.asking(now, question))
    }

    fn poll_due(&self) -> Timestamp {
        self.polled + POLL_EVERY
    }
}

/// The position of a turnout on the bus: 0 is round, 1 is straight.
const fn position_of(curved: bool) -> u8 {
    if curved { 0 } else { 1 }
}

impl Session for Client {
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        self.dialogue.now = now;
        if self.dialogue.farewell.is_over() {
            return;
        }
        if now - self.arrived > FRAME_WITHIN {
            self.framing.give_up();
        }
        self.arrived = now;
        for byte in bytes {
            self.hear(now, *byte);
        }
        self.go_on(now);
    }

    fn handle_reopened(&mut self, now: Timestamp) {
        self.framing = Framing::new(self.settings.transport);
        self.is_blind = true;
        self.open_adapter();
        self.verify();
        self.dialogue.reopened();
        self.go_on(now);
    }

    fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) -> Result<(), CommandError> {
        // A train may be in the station's list, which comes later: its commands are checked then.
        self.dialogue.set_decoder(train, &(0..=u16::MAX), steps)
    }

    fn set_direction(&mut self, train: TrainId, forward: bool) {
        self.dialogue.locomotives.keep_direction(train, forward);
    }

    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError> {
        self.dialogue.check_step(&command)?;
        match command {
            Command::Speed { train, .. } | Command::Reverse { train } | Command::Function { train, .. }
                if self.roster.uid(train).is_none() =>
            {
                CommandError::check_train(train, &self.settings.locomotives.addresses())?;
            }
            Command::Turnout { turnout, .. } => {
                CommandError::check_turnout(turnout, &self.settings.turnouts.addresses())?;
            }
            _ => {}
        }
        self.dialogue.push(command)?;
        self.go_on(now);
        Ok(())
    }

    fn report_releases(&mut self, of: &[SensorId]) {
        self.dialogue.released = of.to_vec();
    }

    fn expect_delays(&mut self, excess: TimeSpan) {
        self.dialogue.excess = excess;
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.go_on(now);
    }

    fn poll_output(&mut self) -> Option<Transmit> {
        self.dialogue.output.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        let paced = self.dialogue.pacing.usual_at();
        let usual = match &self.opening {
            _ if self.dialogue.farewell.has_begun() => None,
            Opening::Asking(_) => (!self.dialogue.outstanding.any(Awaited::is_question)).then_some(paced),
            Opening::Open => Some(self.poll_due().max(paced)),
        };
        let release = self.solenoid.map(|powered| powered.release_at);
        self.dialogue.next_timeout(usual, release, !self.unverified.is_empty())
    }

    fn close(&mut self, now: Timestamp) {
        if self.dialogue.close(now, false) {
            // Before the station's list is read, the number of a locomotive is only supposed: a stop may reach none.
            self.halts_all = matches!(self.opening, Opening::Asking(_));
            self.solenoid.iter_mut().for_each(|powered| powered.release_at = now);
        }
        self.go_on(now);
    }

    fn closing(&self) -> Closing {
        self.dialogue.closing()
    }
}
