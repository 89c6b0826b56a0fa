//! The state that every session with a confirming station shares.
//!
//! Commands wait in a queue that sends stops first. Each train has at most one request without an answer, which is repeated until
//! the station confirms it. A session adds its codec, its questions while the line opens, and the meaning of the station's messages.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use footplate_core::{
    Command, DecoderSteps, Event, EventKind, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId,
    TurnoutId,
};

use crate::farewell::Farewell;
use crate::locomotives::{Locomotive, Locomotives};
use crate::outstanding::{AllOutstanding, Awaited, Outgoing, Outstanding};
use crate::pacing::Pacing;
use crate::queue::{Queue, entry_of, train_of};
use crate::reported_functions::ReportedFunctions;
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
    /// Decoders that do not have 14 steps.
    decoders: BTreeMap<TrainId, DecoderSteps>,
    /// Whether each turnout is set to its curved leg, as the station reported.
    turnouts: BTreeMap<TurnoutId, bool>,
    /// Whether the track should have power, and whether the station reported that it has.
    pub(crate) power: bool,
    pub(crate) is_powered: bool,
    /// How much longer than usual for this station the line may delay a report.
    pub(crate) excess: TimeSpan,
    /// The sensors that are also reported when they become free.
    pub(crate) released: Vec<SensorId>,
    /// When the last message arrived.
    pub(crate) heard: Timestamp,
    /// Since when the station was silent, until its states have been read again.
    pub(crate) blind_since: Option<Timestamp>,
    /// Time of the last entry in the recording; entries stay in order.
    pub(crate) last_entry: Timestamp,
    pub(crate) farewell: Farewell,
    /// Whether to stop all locomotives next, including those that cannot be commanded yet.
    stops_all: bool,
    pub(crate) output: VecDeque<Transmit>,
}

/// What to do with a request whose answer is overdue.
pub(crate) enum Repeat<A: Awaited> {
    /// Write it again.
    Again(Outgoing<A>),
    /// Give it up: it was written often enough.
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
            decoders: BTreeMap::new(),
            turnouts: BTreeMap::new(),
            power: true,
            is_powered: false,
            excess: TimeSpan::ZERO,
            released: Vec::new(),
            heard: now,
            blind_since: None,
            last_entry: now,
            farewell: Farewell::default(),
            stops_all: false,
            output: VecDeque::new(),
        }
    }

    /// Advances the clock.
    pub(crate) fn watch(&mut self, now: Timestamp) {
        self.now = now;
        if let Some(notice) = self.silence.watch(now) {
            self.notify(notice);
            self.blind_since.get_or_insert(self.heard);
        }
    }

    /// Resets what was on the line after it was opened again.
    pub(crate) fn reopened(&mut self, directed: bool) {
        self.silence = Silence::new(self.checks);
        self.outstanding.clear();
        if self.farewell.has_begun() {
            self.stop_driven(directed);
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

    /// A sensor became free within a span that ends at `latest`.
    pub(crate) fn report_free(&mut self, sensor: SensorId, latest: Timestamp, width: TimeSpan) {
        if self.released.contains(&sensor) {
            let poll_interval = Some(width + self.excess);
            self.enter(latest, EventKind::Freed(Report { sensor, poll_interval }));
        }
    }

    pub(crate) fn write(&mut self, bytes: Vec<u8>) {
        self.output.push_back(Transmit::Message(bytes));
    }

    /// Notes that a message arrived; returns whether the station was silent before.
    pub(crate) fn hear(&mut self, now: Timestamp) -> bool {
        self.heard = now;
        self.silence.heard()
    }

    /// Counts bytes that form no message.
    pub(crate) fn hear_noise(&mut self, bytes: usize) {
        if bytes > 0
            && let Some(notice) = self.silence.heard_noise(self.now, bytes)
        {
            self.notify(notice);
        }
    }

    /// Whether the line may garble what is sent now.
    pub(crate) fn is_noisy(&self) -> bool {
        self.silence.is_noisy(self.now)
    }

    // What is written next.

    /// Whether anything may be written now.
    pub(crate) fn may_write(&self, now: Timestamp) -> bool {
        !self.farewell.is_over() && now >= self.pacing.urgent_at()
    }

    /// Stops all locomotives next, whatever is known of them.
    pub(crate) const fn stop_all_next(&mut self) {
        self.stops_all = true;
    }

    /// Whether to stop all locomotives now; true once.
    pub(crate) fn take_stop_of_all(&mut self) -> bool {
        core::mem::take(&mut self.stops_all)
    }

    /// Returns the next command that stops something. With `directed`, a stop needs a known direction, because it would set one.
    pub(crate) fn next_stop(&mut self, now: Timestamp, directed: bool) -> Option<Command> {
        let (locomotives, outstanding) = (&self.locomotives, &self.outstanding);
        self.waiting.next_urgent(|command| {
            train_of(command).is_none_or(|train| {
                let is_free = outstanding.blocks(train, true).is_none_or(|until| now >= until);
                is_free && (!directed || locomotives.has_direction(train))
            })
        })
    }

    /// Returns a request whose answer is overdue, unless a newer command replaces it. `may_throw`: whether a turnout may be thrown now.
    pub(crate) fn next_repeat(
        &mut self,
        now: Timestamp,
        only_urgent: bool,
        may_throw: bool,
    ) -> Option<Repeat<A>> {
        loop {
            let due = self.outstanding.take_due(now, only_urgent, may_throw)?;
            let (command, tries) = (due.command, due.tries);
            if command.is_some_and(|command| self.waiting.outdates(command)) {
                continue;
            }
            if due.is_exhausted() {
                if let Some(command) = command {
                    self.notify(LinkNotice::Unconfirmed(command));
                }
                // The station may have heard it or not: it is asked before the train is commanded again.
                if let Some(Command::Reverse { train }) = command {
                    self.forget_direction(train);
                }
                return Some(Repeat::GivenUp(due));
            }
            if let Some(command) = command.filter(|_| tries > A::REPEATS.usual) {
                self.notify(LinkNotice::Repeated(command));
            }
            let tries = tries.saturating_add(1);
            let Outstanding { request, awaited, .. } = due;
            return Some(Repeat::Again(Outgoing { request, awaited: Some(awaited), command, tries }));
        }
    }

    /// Returns the next request to write again; those that were given up are dropped.
    pub(crate) fn next_again(
        &mut self,
        now: Timestamp,
        only_urgent: bool,
        may_throw: bool,
    ) -> Option<Outgoing<A>> {
        loop {
            if let Repeat::Again(outgoing) = self.next_repeat(now, only_urgent, may_throw)? {
                return Some(outgoing);
            }
        }
    }

    /// Returns, at the end, a train to stop whose direction is unknown and not asked for yet.
    pub(crate) fn undirected_at_end(&self) -> Option<TrainId> {
        let waits = matches!(self.farewell, Farewell::Stopping { .. });
        let is_unasked = |train: &TrainId| {
            !self.locomotives.has_direction(*train) && self.outstanding.blocks(*train, false).is_none()
        };
        self.locomotives.driven(false).into_iter().filter(|_| waits).find(is_unasked)
    }

    /// Whether to switch the power off now; true once.
    pub(crate) fn switch_off_is_due(&mut self, now: Timestamp) -> bool {
        self.farewell.switch_off_is_due(now, &self.locomotives)
    }

    /// Returns a train with a waiting command whose direction must be asked for first, or one whose direction is unchecked.
    pub(crate) fn undirected(&self, is_asked: impl Fn(TrainId) -> bool) -> Option<TrainId> {
        let asks = |train: &TrainId| !self.locomotives.has_direction(*train) && !is_asked(*train);
        self.waiting.iter().filter_map(train_of).chain(self.locomotives.unchecked()).find(asks)
    }

    /// Removes and returns a train whose state may be asked for. A question would replace the request of a train that is not confirmed
    /// yet, which would not be repeated then.
    pub(crate) fn take_unblocked(&self, trains: &mut Vec<TrainId>) -> Option<TrainId> {
        let at = trains.iter().rposition(|train| self.outstanding.blocks(*train, false).is_none())?;
        Some(trains.remove(at))
    }

    /// Returns the next command that is not urgent; `may_throw`: whether a turnout may be thrown now.
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

    /// Notes that a request was written; adds its command to the recording, unless that waits for the answer, and returns the entry.
    pub(crate) fn sent(&mut self, now: Timestamp, outgoing: Outgoing<A>) -> Option<EventKind> {
        let Outgoing { request, awaited, command, tries } = outgoing;
        self.pacing.sent(now);
        let is_entered = awaited.is_none_or(|awaited| !awaited.is_entered_when_answered());
        if let Some(awaited) = awaited {
            self.outstanding.push(Outstanding { request, awaited, command, sent: now, tries });
            self.silence.asked(now);
        }
        let kind = command.filter(|_| is_entered).and_then(|command| entry_of(&command, tries))?;
        self.enter(now, kind);
        Some(kind)
    }

    /// Puts a command in the queue.
    pub(crate) fn push(&mut self, command: Command) -> Result<(), CommandError> {
        if self.farewell.has_begun() {
            return Err(CommandError::Closed);
        }
        self.waiting.push(command).map_err(CommandError::TooManyWaiting)?;
        // What a session asks from now on must not switch the power on again.
        self.power &= command != Command::PowerOff;
        Ok(())
    }

    /// Returns when to continue. `usual`: the session's next question; `release`: when to switch a coil off; `asks`: whether more
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
        // What is due and held back by something else must not hide what comes next.
        let is_coming = |at: &Timestamp| *at > self.now;
        let times = [
            usual,
            release.map(|due| due.max(urgent)),
            asks.then_some(paced),
            self.waiting.iter().map(of_command).filter(is_coming).min(),
            self.outstanding.due(true).map(|due| due.max(urgent)).filter(is_coming).min(),
            self.outstanding.due(false).map(|due| due.max(paced)).filter(is_coming).min(),
            self.silence.due(),
            self.farewell.due(),
        ];
        times.into_iter().flatten().filter(is_coming).min()
    }

    // What the station says.

    /// The steps of a train's decoder.
    pub(crate) fn decoder(&self, train: TrainId) -> DecoderSteps {
        self.decoders.get(&train).copied().unwrap_or(DecoderSteps::Fourteen)
    }

    /// Notes the steps of a train's decoder.
    pub(crate) fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) {
        self.decoders.insert(train, steps);
    }

    /// Refuses a step that the train's decoder does not have.
    pub(crate) fn check_step(&self, command: &Command) -> Result<(), CommandError> {
        match *command {
            Command::Speed { train, step } if step > self.decoder(train).highest() => {
                Err(CommandError::Step { step, highest: self.decoder(train).highest().get() })
            }
            _ => Ok(()),
        }
    }

    /// Returns the locomotive of a train that was commanded or is about to be.
    pub(crate) fn locomotive(&mut self, train: TrainId) -> Option<&mut Locomotive> {
        if self.waiting.iter().any(|command| train_of(command) == Some(train)) {
            self.locomotives.know(train);
        }
        self.locomotives.get_mut(train)
    }

    /// Returns the trains whose direction is known.
    pub(crate) fn directed(&self) -> Vec<TrainId> {
        let known = self.locomotives.iter().filter(|locomotive| locomotive.forward.is_some());
        known.map(|locomotive| locomotive.train).collect()
    }

    /// Notes what the station reports of a train's functions. They are this program's own if the report answered its switch, or while
    /// it awaits the answer to one.
    pub(crate) fn hear_of_functions(
        &mut self,
        train: TrainId,
        newer: ReportedFunctions,
        answered: Option<&A>,
    ) {
        let switches = |awaited: &A| awaited.switched() == Some(train);
        let is_own = answered.is_some_and(switches) || self.outstanding.any(switches);
        let Some(locomotive) = self.locomotive(train) else { return };
        let before = locomotive.functions;
        let functions = before.with(newer);
        if functions == before {
            return;
        }
        locomotive.functions = functions;
        self.output.push_back(Transmit::Functions(train, functions));
        if (functions.on ^ before.on) & before.known != 0 && !is_own {
            self.notify(LinkNotice::OtherFunctions { train, functions });
        }
    }

    /// Notes a turnout's position from the station; returns the position before.
    pub(crate) fn hear_of_turnout(&mut self, turnout: TurnoutId, curved: bool) -> Option<bool> {
        self.turnouts.insert(turnout, curved)
    }

    /// Whether a turnout is known to be in this position.
    pub(crate) fn lies(&self, turnout: TurnoutId, curved: bool) -> bool {
        self.turnouts.get(&turnout) == Some(&curved)
    }

    /// Whether the track lost its power unexpectedly; `request`: what this program awaits after switching it itself.
    pub(crate) fn is_power_lost(&self, on: bool, request: &A) -> bool {
        self.is_powered && !on && self.power && !self.outstanding.has(request)
    }

    /// Notes whether the track has power, as the station reports.
    pub(crate) fn hear_power(&mut self, on: bool, is_lost: bool) {
        if is_lost {
            self.notify(LinkNotice::PowerLost);
        }
        self.is_powered = on;
        if !on {
            self.farewell.power_went_off();
        }
    }

    /// Notes that all locomotives are stopped while the track has power.
    pub(crate) fn hear_of_stop(&mut self, is_lost: bool) {
        if is_lost {
            self.notify(LinkNotice::PowerLost);
        }
        self.is_powered = false;
    }

    /// Handles a station that was reset: trains have stopped, and their directions are written again.
    pub(crate) fn restarted(&mut self) {
        self.notify(LinkNotice::Restarted);
        self.outstanding.clear();
        let is_switched_off = self.waiting.iter().any(|command| *command == Command::PowerOff);
        self.waiting.clear();
        if is_switched_off {
            // An emergency stop is written to the station whatever it has forgotten.
            let _ = self.waiting.push(Command::PowerOff);
        }
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

    /// Stops a train again if the session is ending.
    pub(crate) fn stop_at_end(&mut self, train: TrainId) {
        if self.farewell.has_begun() {
            self.stop(train);
        }
    }

    /// Begins the end, once: stops every train that was driven, then switches the power off.
    ///
    /// Waiting stops are kept. With `directed`, a train of unknown direction, such as one that an earlier session left running, cannot be
    /// commanded yet; it is stopped together with all others first.
    pub(crate) fn close(&mut self, now: Timestamp, directed: bool) -> bool {
        let begins = !self.farewell.has_begun();
        if begins {
            self.farewell.begin(now);
            for train in self.waiting.stops() {
                self.locomotives.know_driven(train);
            }
            self.waiting.clear();
            self.outstanding.clear();
            self.locomotives.withdraw_reversals();
            self.stop_driven(directed);
        }
        begins
    }

    /// Stops every train that was driven.
    fn stop_driven(&mut self, directed: bool) {
        self.locomotives.stop_driven(&mut self.waiting);
        let is_blocked = |train: TrainId| directed && !self.locomotives.has_direction(train);
        self.stops_all |= self.locomotives.driven(false).into_iter().any(is_blocked);
        self.farewell.begin_again(self.now);
    }

    /// Returns how far the end has come.
    pub(crate) fn closing(&self) -> Closing {
        self.farewell.statement(&self.locomotives)
    }

    /// Ends the session when everything is confirmed; returns whether it has just ended.
    pub(crate) fn end_if_confirmed(&mut self) -> bool {
        let closing = self.farewell.end_if_confirmed(&self.locomotives);
        closing.into_iter().map(|closing| self.notify(LinkNotice::Closed(closing))).count() > 0
    }
}
