//! The session with the interface: commands before polls, one poll at a time, and every solenoid released.

mod hearing;

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;

use footplate_core::{Command, DecoderSteps, Event, EventKind, SensorId, TimeSpan, Timestamp, TrainId};

use super::codec::{EncodeError, Message, TRAINS};
use super::decoders::{Decoders, HIGHEST_FUNCTION};
use super::exchange::{Awaited, Exchange, Purpose, Quiet, Reply, SILENCE, Sending};
use super::farewell::Farewell;
use super::module_reads::ModuleReads;
use super::pacing::Pacing;
use super::polls::Polls;
use super::readings::Readings;
use super::recovery::Recovery;
use super::reply_time::ReplyTime;
use super::settings::Settings;
use super::silence::Silence;
use super::solenoid::Solenoid;
use super::unanswered::Unanswered;
use crate::queue::Queue;
use crate::session::{Closing, CommandError, LinkNotice, Session, Transmit};

/// CTS down for longer than this is reported: no message and no reply takes so long.
const NOT_READY_AFTER: TimeSpan = TimeSpan::from_ms(1_500);
/// What to check then.
const CHECK_OF_HAND_SHAKE: &str =
    "check its power and the cable, or try the timed mode if the adapter has no CTS";

/// The client's session with a 6050 or 6051.
///
/// It opens with what brings an interface into step that waits for a second byte: power on twice (the first may be
/// swallowed), solenoid off, reset mode on.
#[derive(Debug, Clone)]
pub struct Interface {
    settings: Settings,
    now: Timestamp,
    pacing: Pacing,
    exchange: Exchange,
    reply: Reply,
    waiting: Queue,
    solenoid: Solenoid,
    readings: Readings,
    polls: Polls,
    /// The sensors that are also reported when they become free.
    released: Vec<SensorId>,
    silence: Silence,
    reply_time: ReplyTime,
    recovery: Recovery,
    decoders: Decoders,
    /// A stop is said before the line has fallen silent; it goes on to wait for that afterwards.
    is_overtaken: bool,
    unanswered: Unanswered,
    farewell: Farewell,
    /// Whether the track should have power.
    power: bool,
    /// Unexpected bytes since the last report of them.
    stray: usize,
    /// Whether the line must fall silent before the next poll.
    disturbed: bool,
    said_not_ready: bool,
    /// Whether something was said to it without a time that may let it go on at once.
    nudged: bool,
    output: VecDeque<Transmit>,
}

impl Interface {
    /// A session over a line that has just been opened.
    ///
    /// # Errors
    ///
    /// When no bus has so many modules, or none.
    pub fn new(now: Timestamp, settings: Settings) -> Result<Self, EncodeError> {
        Message::ReadModules { count: settings.modules }.encode()?;
        let mut interface = Self {
            settings,
            now,
            pacing: Pacing::new(now, settings.pace),
            exchange: Exchange::Free,
            reply: Reply::empty(),
            waiting: Queue::default(),
            solenoid: Solenoid::default(),
            readings: Readings::new(settings.modules),
            polls: Polls::new(settings.modules),
            released: Vec::new(),
            silence: Silence::default(),
            reply_time: ReplyTime::new(settings.reply_allowance),
            recovery: Recovery::default(),
            decoders: Decoders::new(settings.light),
            is_overtaken: false,
            unanswered: Unanswered::default(),
            farewell: Farewell::default(),
            power: true,
            stray: 0,
            disturbed: false,
            said_not_ready: false,
            // Without a hand-shake line nothing else begins the first word.
            nudged: true,
            output: VecDeque::new(),
        };
        interface.recovery.begin_anew();
        Ok(interface)
    }

    /// How many sensor modules are read.
    pub const fn modules(&self) -> u8 {
        self.settings.modules
    }

    /// Which reads of sensor modules the interface answers; `None` until that has been tried.
    pub fn module_reads(&self) -> Option<ModuleReads> {
        self.polls.reads()
    }

    /// How much later than its bytes take a reply comes, the latest of late; `None` before the first.
    pub fn reply_lateness(&self) -> Option<TimeSpan> {
        self.reply_time.usual()
    }

    const fn power_word(&self) -> Message {
        if self.power { Message::Go } else { Message::Stop }
    }

    /// Sends what is due.
    fn go_on(&mut self, now: Timestamp) {
        self.now = now;
        self.nudged = false;
        self.watch_hand_shake(now);
        while match self.exchange {
            Exchange::Free => self.begin(now),
            Exchange::Sending(sending) => self.send(now, sending),
            Exchange::Awaiting(awaited) => now >= awaited.until && self.lose(now, awaited),
            Exchange::Settling(awaited) => now >= awaited.until && self.accept(awaited),
            Exchange::Quiet(quiet) => self.keep_quiet(now, quiet),
        } {}
    }

    fn watch_hand_shake(&mut self, now: Timestamp) {
        match self.pacing.down_since() {
            Some(since) if now - since >= NOT_READY_AFTER && !self.said_not_ready => {
                self.said_not_ready = true;
                self.notify(LinkNotice::NotReady { since: now - since, check: CHECK_OF_HAND_SHAKE });
            }
            None => {
                if core::mem::take(&mut self.said_not_ready) {
                    self.silence.suspect();
                }
            }
            Some(_) => {}
        }
    }

    /// Begins what is next, if the line may be used; returns whether it did.
    fn begin(&mut self, now: Timestamp) -> bool {
        if self.recovery.has_just_spoken() && self.waiting.has_urgent() {
            self.pacing.hurry();
        }
        if !self.pacing.is_ready(now) {
            return false;
        }
        let next = self.next_purpose(now);
        if let Some((message, purpose)) = next
            && let Ok(frame) = message.encode()
        {
            self.exchange = Exchange::Sending(Sending { frame, purpose, sent: 0, written: now });
            self.write(now);
            return true;
        }
        matches!(self.exchange, Exchange::Quiet(_))
    }

    fn next_purpose(&mut self, now: Timestamp) -> Option<(Message, Purpose)> {
        // Before the first word the interface may take any byte for the second of something.
        let in_step = !self.recovery.is_out_of_step();
        let hurries = in_step && self.solenoid.hurries(now);
        let stops = in_step && !hurries && self.waiting.has_urgent();
        if !(hurries || stops || in_step && self.is_overtaken)
            && let Some(word) = self.recovery.next(self.solenoid.is_powered(), self.power_word())
        {
            return Some((word, Purpose::Recovery));
        }
        if hurries {
            return Some((Message::SolenoidOff, Purpose::Release));
        }
        if let Some(command) = self.waiting.next_urgent(|_| true) {
            return Some((self.decoders.message(command), Purpose::Command(command)));
        }
        if core::mem::take(&mut self.is_overtaken) {
            self.recovery.cancel();
            self.distrust(now, self.pacing.gone().unwrap_or(now));
            return None;
        }
        if self.farewell.begun {
            return self.next_of_closing(now);
        }
        if self.solenoid.due().is_some_and(|due| now >= due) {
            return Some((Message::SolenoidOff, Purpose::Release));
        }
        if let Some(command) = self.waiting.next_usual(|waiting| self.solenoid.lets(waiting)) {
            return Some((self.decoders.message(command), Purpose::Command(command)));
        }
        if core::mem::take(&mut self.disturbed) {
            self.recovery.begin();
            self.exchange = Exchange::Quiet(Quiet::begin(now, now, false));
            return None;
        }
        // If the reply is lost, the solenoid is released after the silence and the word that follows it.
        let recovery = SILENCE + self.pacing.word_time();
        let request = self.polls.next(now, &self.readings, &self.solenoid, &self.reply_time, recovery)?;
        Some(match self.solenoid.repeat_is_due() {
            true => (Message::SolenoidOff, Purpose::Release),
            false => (request, Purpose::Poll(request)),
        })
    }

    fn next_of_closing(&self, now: Timestamp) -> Option<(Message, Purpose)> {
        if !self.farewell.released {
            let may_release = self.solenoid.earliest().is_none_or(|earliest| now >= earliest);
            return may_release.then_some((Message::SolenoidOff, Purpose::Release));
        }
        (!self.farewell.is_over()).then_some((Message::Stop, Purpose::PowerAtClose))
    }

    /// Writes the next byte of the frame in transit, if there is one.
    fn write(&mut self, now: Timestamp) {
        if let Exchange::Sending(sending) = &mut self.exchange
            && let Some(byte) = sending.next_byte()
        {
            sending.sent += 1;
            sending.written = now;
            let ends_frame = sending.next_byte().is_none();
            self.pacing.wrote(now, ends_frame);
            self.output.push_back(Transmit::Byte(byte));
        }
    }

    /// Goes on with a frame; returns whether something has changed.
    fn send(&mut self, now: Timestamp, sending: Sending) -> bool {
        if now < sending.gone() {
            return false;
        }
        if sending.next_byte().is_none() {
            self.left(sending);
            return true;
        }
        let ready = self.pacing.is_ready(now);
        if ready {
            self.write(now);
        }
        ready
    }

    /// The last bit of a frame has left.
    fn left(&mut self, sending: Sending) {
        let at = sending.gone();
        self.exchange = Exchange::Free;
        self.recovery.spoke(sending.purpose == Purpose::Recovery);
        match sending.purpose {
            Purpose::Recovery => {}
            Purpose::Release => {
                let is_noisy = self.silence.is_noisy(at);
                if let Some((turnout, held)) = self.solenoid.release(at, is_noisy) {
                    self.notify(LinkNotice::SolenoidLate { turnout, held });
                }
                self.farewell.released = self.farewell.begun;
            }
            Purpose::Command(command) => self.commanded(at, command),
            Purpose::Poll(request) => {
                self.reply.clear();
                self.silence.asked(at);
                self.polls.asked(at, request);
                self.exchange = Exchange::Awaiting(Awaited::new(request, at, self.reply_time.allowance()));
            }
            Purpose::PowerAtClose => {
                self.farewell.said_power_off();
                if self.farewell.is_over() {
                    let closing = self.closing();
                    self.notify(LinkNotice::Closed(closing));
                }
            }
        }
    }

    fn commanded(&mut self, at: Timestamp, command: Command) {
        self.decoders.sent(command);
        let kind = match command {
            Command::Speed { train, step } => {
                self.farewell.commanded(train, step);
                Some(EventKind::Speed { train, step })
            }
            Command::Reverse { train } => Some(EventKind::Reverse { train }),
            Command::Turnout { turnout, curved } => {
                self.solenoid.power(turnout, at);
                Some(EventKind::Turnout { turnout, curved })
            }
            Command::Function { .. } => None,
            Command::PowerOff | Command::PowerOn => {
                self.power = command == Command::PowerOn && !self.farewell.begun;
                None
            }
        };
        self.unanswered.push(command);
        self.output.extend(kind.map(|kind| Transmit::Event(Event { time: at, kind })));
    }

    fn notify(&mut self, notice: LinkNotice) {
        self.output.push_back(Transmit::Notice(notice));
    }

    /// The time at which there may be something to do while the line is free.
    fn free_timeout(&self) -> Option<Timestamp> {
        if let Some(ready) = self.pacing.ready_at().filter(|ready| *ready > self.now) {
            return Some(ready);
        }
        match &self.farewell {
            farewell if farewell.is_over() => None,
            farewell if farewell.begun => self.solenoid.earliest(),
            _ => [self.polls.hold_lapses(), self.solenoid.due()].into_iter().flatten().min(),
        }
    }
}

impl Session for Interface {
    fn copied(&self) -> Box<dyn Session> {
        Box::new(self.clone())
    }

    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        if let Exchange::Sending(sending) = self.exchange
            && sending.next_byte().is_none()
            && now >= sending.gone()
        {
            // The reply may come before the clock was looked at.
            self.left(sending);
        }
        for byte in bytes {
            self.hear(now, *byte);
        }
        self.go_on(now);
    }

    fn handle_cts(&mut self, now: Timestamp, up: bool) {
        self.pacing.cts(now, up);
        self.go_on(now);
    }

    fn handle_reopened(&mut self, now: Timestamp) {
        self.polls.forget_reads();
        self.reply_time.forget();
        // Its next answer is news: trains wait for it.
        self.silence = Silence::default();
        self.distrust(now, now);
        self.recovery.begin_anew();
        self.pacing = Pacing::new(now, self.settings.pace);
        self.go_on(now);
    }

    fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) -> Result<(), CommandError> {
        CommandError::check_train(train, &TRAINS)?;
        match steps {
            DecoderSteps::Fourteen => Ok(()),
            _ => Err(CommandError::Decoder { train, steps }),
        }
    }

    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError> {
        if self.farewell.begun {
            return Err(CommandError::Closed);
        }
        if let Command::Function { function, .. } = command
            && function.get() > HIGHEST_FUNCTION
        {
            return Err(CommandError::Function { function, highest: HIGHEST_FUNCTION });
        }
        self.decoders.message(command).encode()?;
        if let Command::Speed { train, step } = command {
            self.farewell.will_command(train, step);
        }
        self.waiting.push(command).map_err(CommandError::TooManyWaiting)?;
        // What brings it into step from now on must not switch the power on again.
        self.power &= command != Command::PowerOff;
        self.go_on(now);
        Ok(())
    }

    fn hold_line(&mut self, until: Option<Timestamp>) {
        self.polls.hold(until);
        self.nudged = true;
    }

    fn watch(&mut self, sensor: Option<SensorId>) {
        self.polls.watch(sensor);
    }

    fn report_releases(&mut self, of: &[SensorId]) {
        self.released = of.to_vec();
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.go_on(now);
    }

    fn poll_output(&mut self) -> Option<Transmit> {
        self.output.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        if self.nudged {
            return Some(self.now + TimeSpan::from_ns(1));
        }
        let next = match &self.exchange {
            Exchange::Free => self.free_timeout(),
            Exchange::Sending(sending) if self.now < sending.gone() => Some(sending.gone()),
            Exchange::Sending(_) => self.pacing.ready_at(),
            Exchange::Awaiting(awaited) | Exchange::Settling(awaited) => Some(awaited.until),
            Exchange::Quiet(quiet) => {
                let stops = (quiet.is_uncertain && self.waiting.has_urgent()).then(|| quiet.stops_may_go());
                let release = [self.solenoid.due(), self.solenoid.hurries_at(), stops];
                let coming = release.into_iter().flatten().filter(|at| *at > self.now);
                coming.chain([quiet.until]).min()
            }
        };
        let alarm = self.pacing.down_since().filter(|_| !self.said_not_ready);
        let alarm = alarm.map(|since| since + NOT_READY_AFTER);
        next.into_iter().chain(alarm).filter(|at| *at > self.now).min()
    }

    fn close(&mut self, now: Timestamp) {
        if !self.farewell.begun {
            self.waiting.clear();
            self.power = false;
            for stop in self.farewell.begin() {
                // Stops are always taken.
                let _ = self.waiting.push(stop);
            }
        }
        self.go_on(now);
    }

    fn closing(&self) -> Closing {
        self.farewell.statement(self.pacing.has_hand_shake())
    }
}
