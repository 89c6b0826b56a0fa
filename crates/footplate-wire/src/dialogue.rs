//! What all sessions share that speak with a station which confirms what it is commanded.
//!
//! Commands wait in a queue in which stops go first. At most one request for a train is without an answer; it is repeated until the
//! station confirms it. A session adds its codec, what it asks for while the line opens, and what the station's messages mean.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use footplate_core::{
    Command, Event, EventKind, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};

use crate::farewell::Farewell;
use crate::locomotives::{Locomotive, Locomotives};
use crate::outstanding::{AllOutstanding, Awaited, Outgoing, Outstanding};
use crate::pacing::Pacing;
use crate::queue::{Queue, entry_of, train_of};
use crate::session::{Closing, CommandError, LinkNotice, Transmit};
use crate::silence::{Checks, Silence};

/// The state of a session with one station.
#[derive(Debug, Clone)]
pub(crate) struct Dialogue<A: Awaited> {
    pub(crate) now: Timestamp,
    pub(crate) pacing: Pacing,
    pub(crate) silence: Silence,
    checks: Checks,
    pub(crate) waiting: Queue,
    pub(crate) outstanding: AllOutstanding<A>,
    pub(crate) locomotives: Locomotives,
    /// How turnouts lie, by the station's own messages.
    turnouts: Vec<(TurnoutId, bool)>,
    /// Whether the track is meant to have power, and whether the station has said that it has.
    pub(crate) power: bool,
    pub(crate) is_powered: bool,
    /// By how much the line may delay a report beyond what is usual for the station.
    pub(crate) excess: TimeSpan,
    /// When the last message came.
    pub(crate) heard: Timestamp,
    /// The time of the last entry of the recording: entries stay in order.
    pub(crate) last_entry: Timestamp,
    pub(crate) farewell: Farewell,
    /// Whether all locomotives are to be stopped next, those that cannot be commanded yet among them.
    stops_all: bool,
    pub(crate) output: VecDeque<Transmit>,
}

/// What becomes of a request that was not answered in time.
pub(crate) enum Repeat<A: Awaited> {
    /// It is written again.
    Again(Outgoing<A>),
    /// It was written often enough.
    GivenUp(Outstanding<A>),
}

impl<A: Awaited> Dialogue<A> {
    pub(crate) fn new(now: Timestamp, pacing: Pacing, checks: Checks) -> Self {
        Self {
            now,
            pacing,
            silence: Silence::new(checks),
            checks,
            waiting: Queue::default(),
            outstanding: AllOutstanding::new(),
            locomotives: Locomotives::default(),
            turnouts: Vec::new(),
            power: true,
            is_powered: false,
            excess: TimeSpan::ZERO,
            heard: now,
            last_entry: now,
            farewell: Farewell::default(),
            stops_all: false,
            output: VecDeque::new(),
        }
    }

    /// The clock has gone on; returns whether the station has just been found silent.
    pub(crate) fn watch(&mut self, now: Timestamp) -> bool {
        self.now = now;
        let notice = self.silence.watch(now);
        notice.into_iter().map(|notice| self.notify(notice)).count() > 0
    }

    /// The line was opened again.
    pub(crate) fn reopened(&mut self) {
        self.silence = Silence::new(self.checks);
        self.outstanding.clear();
        if self.farewell.has_begun() {
            self.stop_driven();
        }
    }

    pub(crate) fn notify(&mut self, notice: LinkNotice) {
        self.output.push_back(Transmit::Notice(notice));
    }

    /// Adds an entry to the recording.
    pub(crate) fn enter(&mut self, time: Timestamp, kind: EventKind) {
        self.last_entry = self.last_entry.max(time);
        self.output.push_back(Transmit::Event(Event { time, kind }));
    }

    /// A sensor became occupied within a span that ends at `latest`.
    pub(crate) fn report(&mut self, sensor: SensorId, latest: Timestamp, width: TimeSpan) {
        let poll_interval = Some(width + self.excess);
        self.enter(latest, EventKind::Sensor(Report { sensor, poll_interval }));
    }

    pub(crate) fn write(&mut self, bytes: Vec<u8>) {
        self.output.push_back(Transmit::Message(bytes));
    }

    /// A message has come; returns whether the station was silent before.
    pub(crate) fn hear(&mut self, now: Timestamp) -> bool {
        self.heard = now;
        self.silence.heard()
    }

    /// Bytes have come that are no message.
    pub(crate) fn hear_noise(&mut self, bytes: usize) {
        if bytes > 0
            && let Some(notice) = self.silence.heard_noise(bytes)
        {
            self.notify(notice);
        }
    }

    // What is written next.

    /// Whether anything may be written now.
    pub(crate) fn may_write(&self, now: Timestamp) -> bool {
        !self.farewell.is_over() && now >= self.pacing.urgent_at()
    }

    /// Whether all locomotives are to be stopped next; true once.
    pub(crate) fn take_stop_of_all(&mut self) -> bool {
        core::mem::take(&mut self.stops_all)
    }

    /// The next command that stops something. With `directed`, a train has to have a known direction: a stop would turn it otherwise.
    pub(crate) fn next_stop(&mut self, now: Timestamp, directed: bool) -> Option<Command> {
        let (locomotives, outstanding) = (&self.locomotives, &self.outstanding);
        self.waiting.next_urgent(|command| {
            train_of(command).is_none_or(|train| {
                let is_free = outstanding.blocks(train, true).is_none_or(|until| now >= until);
                is_free && (!directed || locomotives.has_direction(train))
            })
        })
    }

    /// A request that was not answered in time, unless a newer command for the same waits.
    pub(crate) fn next_repeat(&mut self, now: Timestamp, only_urgent: bool) -> Option<Repeat<A>> {
        loop {
            let due = self.outstanding.take_due(now, only_urgent)?;
            let Outstanding { request, awaited, command, tries, .. } = due;
            if command.is_some_and(|command| self.waiting.outdates(command)) {
                continue;
            }
            if due.is_exhausted() {
                if let Some(command) = command {
                    self.notify(LinkNotice::Unconfirmed { command });
                }
                return Some(Repeat::GivenUp(due));
            }
            if let Some(command) = command.filter(|_| tries > A::REPEATS.usual) {
                self.notify(LinkNotice::Repeated { command });
            }
            let tries = tries.saturating_add(1);
            return Some(Repeat::Again(Outgoing { request, awaited: Some(awaited), command, tries }));
        }
    }

    /// At the end, a train to be stopped whose direction is unknown and was not asked for.
    pub(crate) fn undirected_at_end(&self) -> Option<TrainId> {
        let is_unasked = |train: &TrainId| {
            !self.locomotives.has_direction(*train) && self.outstanding.blocks(*train, false).is_none()
        };
        let waits = matches!(self.farewell, Farewell::Stopping { .. });
        self.locomotives.driven(false).into_iter().filter(|_| waits).find(is_unasked)
    }

    /// Whether the power has to be switched off now; true once.
    pub(crate) fn switch_off_is_due(&mut self, now: Timestamp) -> bool {
        self.farewell.switch_off_is_due(now, &self.locomotives)
    }

    /// A train with a waiting command whose direction has to be asked for first.
    pub(crate) fn undirected(&self, is_asked: impl Fn(TrainId) -> bool) -> Option<TrainId> {
        let asks = |train: &TrainId| !self.locomotives.has_direction(*train) && !is_asked(*train);
        self.waiting.iter().filter_map(train_of).find(asks)
    }

    /// The next command of those that can wait; `may_throw`: whether a turnout may be thrown now.
    pub(crate) fn next_command(&mut self, may_throw: bool) -> Option<Command> {
        let (locomotives, outstanding) = (&self.locomotives, &self.outstanding);
        self.waiting.next_usual(|command| match command {
            Command::Turnout { turnout, .. } => {
                may_throw && !outstanding.any(|awaited| awaited.turnout() == Some(*turnout))
            }
            _ => train_of(command).is_none_or(|train| {
                locomotives.has_direction(train) && outstanding.blocks(train, false).is_none()
            }),
        })
    }

    /// A train is commanded to run at a step, reversed or not; returns whether it runs forward then.
    pub(crate) fn commanded(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> bool {
        self.locomotives.know(train);
        let Some(locomotive) = self.locomotives.get_mut(train) else { return true };
        if reverses {
            locomotive.forward = Some(!locomotive.forward.unwrap_or(true));
        }
        (locomotive.step, locomotive.is_driven, locomotive.is_stopped) = (step, true, false);
        locomotive.forward.unwrap_or(true)
    }

    /// A request has been written; enters its command in the recording and returns the entry.
    pub(crate) fn sent(&mut self, now: Timestamp, outgoing: Outgoing<A>) -> Option<EventKind> {
        let Outgoing { request, awaited, command, tries } = outgoing;
        self.pacing.sent(now);
        if let Some(awaited) = awaited {
            self.outstanding.push(Outstanding { request, awaited, command, sent: now, tries });
            self.silence.asked(now);
        }
        let kind = command.and_then(|command| entry_of(&command, tries))?;
        self.enter(now, kind);
        Some(kind)
    }

    /// Puts a command in the queue.
    pub(crate) fn push(&mut self, command: Command) -> Result<(), CommandError> {
        if self.farewell.has_begun() {
            return Err(CommandError::Closed);
        }
        self.waiting.push(command).map_err(CommandError::TooManyWaiting)
    }

    /// When to go on: `usual`, the next question of the session itself, `release`, a coil to be switched off, and `asks`, whether more
    /// questions wait.
    pub(crate) fn next_timeout(
        &self,
        usual: Option<Timestamp>,
        release: Option<Timestamp>,
        asks: bool,
    ) -> Option<Timestamp> {
        if self.farewell.is_over() {
            return None;
        }
        let (urgent, paced) = (self.pacing.urgent_at(), self.pacing.usual_at());
        let of_command = |command: &Command| {
            let stops = matches!(command, Command::PowerOff | Command::Speed { step: SpeedStep::STAND, .. });
            let free = train_of(command).and_then(|train| self.outstanding.blocks(train, stops));
            free.unwrap_or(Timestamp::ZERO).max(if stops { urgent } else { paced })
        };
        let times = [
            usual,
            release.map(|due| due.max(urgent)),
            asks.then_some(paced),
            self.waiting.iter().map(of_command).min(),
            self.outstanding.due(true).map(|due| due.max(urgent)),
            self.outstanding.due(false).map(|due| due.max(paced)),
            self.silence.due(),
            self.farewell.due(),
        ];
        times.into_iter().flatten().filter(|at| *at > self.now).min()
    }

    // What the station says.

    /// The locomotive of a train that was ever commanded or is about to be.
    pub(crate) fn locomotive(&mut self, train: TrainId) -> Option<&mut Locomotive> {
        if self.waiting.iter().any(|command| train_of(command) == Some(train)) {
            self.locomotives.know(train);
        }
        self.locomotives.get_mut(train)
    }

    /// The trains whose direction the station has said.
    pub(crate) fn directed(&self) -> Vec<TrainId> {
        let known = self.locomotives.iter().filter(|locomotive| locomotive.forward.is_some());
        known.map(|locomotive| locomotive.train).collect()
    }

    /// The station says how a turnout lies; returns how it was said to lie before.
    pub(crate) fn hear_of_turnout(&mut self, turnout: TurnoutId, curved: bool) -> Option<bool> {
        if let Some((_, lies)) = self.turnouts.iter_mut().find(|(known, _)| *known == turnout) {
            return Some(core::mem::replace(lies, curved));
        }
        self.turnouts.push((turnout, curved));
        None
    }

    /// Whether a turnout is known to lie so.
    pub(crate) fn lies(&self, turnout: TurnoutId, curved: bool) -> bool {
        self.turnouts.contains(&(turnout, curved))
    }

    /// Whether power that is off was meant to be on; `request`: what this program awaits when it has just switched it itself.
    pub(crate) fn is_power_lost(&self, on: bool, request: &A) -> bool {
        self.is_powered && !on && self.power && !self.outstanding.has(request)
    }

    /// The station says whether the track has power.
    pub(crate) fn hear_power(&mut self, on: bool, is_lost: bool) {
        if is_lost {
            self.notify(LinkNotice::PowerLost);
        }
        self.is_powered = on;
        if !on {
            self.farewell.power_went_off();
        }
    }

    /// The station has forgotten everything: trains have stopped, and their directions are written again.
    pub(crate) fn restarted(&mut self) {
        self.notify(LinkNotice::Restarted);
        self.outstanding.clear();
        self.waiting.clear();
        for locomotive in self.locomotives.iter_mut() {
            locomotive.step = SpeedStep::STAND;
        }
        let driven: Vec<TrainId> =
            self.locomotives.iter().filter(|known| known.is_driven).map(|known| known.train).collect();
        for train in driven {
            self.stop(train);
        }
    }

    // The end.

    /// Stops a train next.
    pub(crate) fn stop(&mut self, train: TrainId) {
        // Stops are always taken.
        let _ = self.waiting.push(Command::Speed { train, step: SpeedStep::STAND });
    }

    /// Stops a train again that was found running while the session ends.
    pub(crate) fn stop_at_end(&mut self, train: TrainId) {
        if self.farewell.has_begun() {
            self.stop(train);
        }
    }

    /// Begins the end, once: every train that ever had a speed is stopped, then the power goes off.
    ///
    /// Stops that wait are kept. With `directed`, a train that was never driven here, such as one that an earlier session left running,
    /// cannot be commanded before the station has said how it faces: it is stopped together with all others first.
    pub(crate) fn close(&mut self, now: Timestamp, directed: bool) -> bool {
        let begins = !self.farewell.has_begun();
        if begins {
            self.farewell.begin(now);
            for train in self.waiting.stops() {
                self.locomotives.know_driven(train);
                self.stops_all |= directed && !self.locomotives.has_direction(train);
            }
            self.waiting.clear();
            self.outstanding.clear();
            self.stop_driven();
        }
        begins
    }

    /// Stops every train that ever had a speed.
    fn stop_driven(&mut self) {
        self.locomotives.stop_driven(&mut self.waiting);
        self.farewell.begin_again(self.now);
    }

    /// How far the end has come.
    pub(crate) fn closing(&self) -> Closing {
        self.farewell.statement(&self.locomotives)
    }

    /// Ends the session when everything is confirmed; returns whether it has just ended.
    pub(crate) fn end_if_confirmed(&mut self) -> bool {
        let closing = self.farewell.end_if_confirmed(&self.locomotives);
        closing.into_iter().map(|closing| self.notify(LinkNotice::Closed(closing))).count() > 0
    }
}
