//! What the protocol of a confirming station adds to the [`Dialogue`] that all of them share; a [`Session`] follows from it.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use core::ops::{ControlFlow, RangeInclusive};

use footplate_core::{
    Command, DecoderSteps, FunctionNumber, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};

use crate::dialogue::Dialogue;
use crate::outstanding::{Awaited, Outgoing};
use crate::session::{Closing, CommandError, Session, Transmit};

/// A request of a protocol, and the answer that it awaits.
type Next<P> = Outgoing<<P as Protocol>::Awaited>;

/// A request of a protocol, and the answer that confirms it, if one does.
type Confirmed<P> = (<<P as Protocol>::Awaited as Awaited>::Request, Option<<P as Protocol>::Awaited>);

/// The protocol of a station that confirms what it does.
pub(crate) trait Protocol {
    type Awaited: Awaited;

    /// Whether a stop sets a direction, too: one that is unknown is then asked for first, or all locomotives are stopped together.
    const STOPS_SET_DIRECTIONS: bool = true;

    fn dialogue(&self) -> &Dialogue<Self::Awaited>;

    fn dialogue_mut(&mut self) -> &mut Dialogue<Self::Awaited>;

    // The line.

    /// Takes bytes from the station.
    fn hear(&mut self, now: Timestamp, bytes: &[u8]);

    /// Does what is due at this time, before anything is written.
    fn advance(&mut self, _now: Timestamp) {}

    /// Forgets what was on the line that was opened again, and reads all states anew.
    fn begin_again(&mut self, now: Timestamp);

    /// Writes a request.
    fn send(&mut self, now: Timestamp, next: Next<Self>);

    /// Whether anything may be written now.
    fn may_write(&self, now: Timestamp) -> bool {
        self.dialogue().may_write(now)
    }

    // What a command may name.

    /// The addresses of which this train's has to be one.
    fn addresses(&self, train: TrainId) -> RangeInclusive<u16>;

    /// Whether a train may have a decoder. Its commands are checked once more.
    fn check_decoder(&self, train: TrainId) -> Result<(), CommandError> {
        CommandError::check_train(train, &self.addresses(train))
    }

    /// The turnouts that exist here.
    fn turnouts(&self) -> RangeInclusive<u16>;

    // What is written.

    /// The request that stops all locomotives.
    fn stop_of_all(&self) -> <Self::Awaited as Awaited>::Request;

    /// What has to be written before a stop can be.
    fn before_stops(&mut self) -> Option<Next<Self>> {
        None
    }

    /// Returns the request that drives a train at a step, reversed or not, and notes what it commands.
    fn drive(&mut self, now: Timestamp, train: TrainId, step: SpeedStep, reverses: bool) -> Confirmed<Self>;

    /// Returns the request that throws a turnout, and notes what it powers.
    fn throw(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) -> Confirmed<Self>;

    /// Returns the request that switches a function of a train.
    fn switch(&mut self, train: TrainId, function: FunctionNumber, on: bool) -> Confirmed<Self>;

    /// Returns the request that switches the power of the track.
    fn switch_power(&self, on: bool) -> Confirmed<Self>;

    /// Whether a turnout may be thrown now. While a coil is powered, its pulse would not end.
    fn may_throw(&self) -> bool {
        self.release_at().is_none()
    }

    /// Returns the next request to write again.
    fn next_again(&mut self, now: Timestamp, only_urgent: bool) -> Option<Next<Self>> {
        let may_throw = self.may_throw();
        self.dialogue_mut().next_again(now, only_urgent, may_throw)
    }

    /// Switches off the coil that was powered for long enough.
    fn next_release(&mut self, _now: Timestamp) -> Option<Next<Self>> {
        None
    }

    /// When the next coil is to be switched off.
    fn release_at(&self) -> Option<Timestamp> {
        None
    }

    /// Asks how a train is driven.
    fn query(&self, train: TrainId) -> Next<Self>;

    /// Whether the direction of a train is asked for, or will be known when another of its requests is answered.
    fn is_asked(&self, train: TrainId) -> bool {
        self.dialogue().outstanding.blocks(train, false).is_some()
    }

    /// Returns the next question about states that have to be known first; breaks with `None` while the answer to one is awaited.
    fn next_question(&mut self, now: Timestamp) -> ControlFlow<Option<Next<Self>>>;

    /// Whether questions of [`next_question`](Self::next_question) wait after the opening.
    fn has_questions(&self) -> bool;

    /// Returns the question by which the station shows that it is there, if one is due.
    fn next_poll(&mut self, now: Timestamp) -> Option<Next<Self>>;

    /// When the next question of the opening or the next poll is due.
    fn asks_at(&self) -> Option<Timestamp>;

    /// When the line takes the next request at the latest, while it takes none.
    fn written_at(&self) -> Option<Timestamp> {
        None
    }

    /// The end has begun.
    fn end_begins(&mut self, _now: Timestamp) {}

    // What follows from the above.

    /// Returns the request for the power as it is wanted now. A question that is put in a list does not say which: an emergency stop
    /// may come before it is written.
    fn wanted_power(&self) -> Outgoing<Self::Awaited> {
        let (request, awaited) = self.switch_power(self.dialogue().power);
        Outgoing { request, awaited, command: None, tries: 1 }
    }

    /// Returns the request for a command, and notes what it commands.
    fn outgoing(&mut self, now: Timestamp, command: Command) -> Next<Self> {
        let (request, awaited) = match command {
            Command::Speed { train, step } => self.drive(now, train, step, false),
            Command::Reverse { train } => self.drive(now, train, SpeedStep::STAND, true),
            Command::Turnout { turnout, curved } => self.throw(now, turnout, curved),
            Command::Function { train, function, on } => self.switch(train, function, on),
            Command::PowerOff | Command::PowerOn => {
                let on = command == Command::PowerOn;
                self.dialogue_mut().power = on;
                self.switch_power(on)
            }
        };
        Outgoing::commands(command, request, awaited)
    }

    /// When to continue.
    fn continues_at(&self) -> Option<Timestamp> {
        let dialogue = self.dialogue();
        if let Some(written) = self.written_at().filter(|_| !dialogue.farewell.is_over()) {
            let times = [Some(written), dialogue.silence.due(), dialogue.farewell.due()];
            return times.into_iter().flatten().filter(|at| *at > dialogue.now).min();
        }
        let is_ending = dialogue.farewell.has_begun();
        let usual = if is_ending { Some(dialogue.pacing.urgent_at()) } else { self.asks_at() };
        let asks =
            self.has_questions() || dialogue.locomotives.unchecked().any(|train| !self.is_asked(train));
        dialogue.next_timeout(usual, self.release_at(), asks)
    }

    /// Sends what is due.
    fn go_on(&mut self, now: Timestamp) {
        self.dialogue_mut().watch(now);
        self.advance(now);
        while let Some(next) = self.next(now) {
            self.send(now, next);
        }
    }

    /// Returns the next request, if one may be written now.
    fn next(&mut self, now: Timestamp) -> Option<Next<Self>> {
        if !self.may_write(now) {
            return None;
        }
        if self.dialogue_mut().take_stop_of_all() {
            return Some(Outgoing::says(self.stop_of_all()));
        }
        if let Some(first) = self.before_stops() {
            return Some(first);
        }
        if let Some(command) = self.dialogue_mut().next_stop(now, Self::STOPS_SET_DIRECTIONS) {
            return Some(self.outgoing(now, command));
        }
        if let Some(again) = self.next_again(now, true) {
            return Some(again);
        }
        if let Some(release) = self.next_release(now) {
            return Some(release);
        }
        if Self::STOPS_SET_DIRECTIONS
            && let Some(train) = self.dialogue().undirected_at_end()
        {
            return Some(self.query(train));
        }
        if self.dialogue_mut().switch_off_is_due(now) {
            return Some(self.outgoing(now, Command::PowerOff));
        }
        if now < self.dialogue().pacing.usual_at() {
            return None;
        }
        // At the end, too: a train whose direction or slot is asked for can be stopped only when that is answered.
        let again = self.next_again(now, false);
        if self.dialogue().farewell.has_begun() { again } else { again.or_else(|| self.next_usual(now)) }
    }

    /// Returns the next request that is not urgent.
    fn next_usual(&mut self, now: Timestamp) -> Option<Next<Self>> {
        if let ControlFlow::Break(question) = self.next_question(now) {
            return question;
        }
        if let Some(train) = self.dialogue().undirected(|train| self.is_asked(train)) {
            return Some(self.query(train));
        }
        let may_throw = self.may_throw();
        if let Some(command) = self.dialogue_mut().next_command(may_throw) {
            return Some(self.outgoing(now, command));
        }
        self.next_poll(now)
    }
}

impl<P: Protocol + Clone + 'static> Session for P {
    fn copied(&self) -> Box<dyn Session> {
        Box::new(self.clone())
    }

    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]) {
        self.dialogue_mut().now = now;
        if self.dialogue().farewell.is_over() {
            return;
        }
        self.hear(now, bytes);
        self.go_on(now);
    }

    fn handle_reopened(&mut self, now: Timestamp) {
        let dialogue = self.dialogue_mut();
        dialogue.blind_since.get_or_insert(dialogue.heard);
        self.begin_again(now);
        self.dialogue_mut().reopened(Self::STOPS_SET_DIRECTIONS);
        self.go_on(now);
    }

    fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) -> Result<(), CommandError> {
        self.check_decoder(train)?;
        self.dialogue_mut().set_decoder(train, steps);
        Ok(())
    }

    fn set_direction(&mut self, train: TrainId, forward: bool) {
        self.dialogue_mut().locomotives.keep_direction(train, forward);
    }

    fn check_direction(&mut self, train: TrainId) {
        self.dialogue_mut().locomotives.check_direction(train);
    }

    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError> {
        self.dialogue().check_step(&command)?;
        match command {
            Command::Speed { train, .. } | Command::Reverse { train } | Command::Function { train, .. } => {
                CommandError::check_train(train, &self.addresses(train))?;
            }
            Command::Turnout { turnout, .. } => CommandError::check_turnout(turnout, &self.turnouts())?,
            Command::PowerOff | Command::PowerOn => {}
        }
        self.dialogue_mut().push(command)?;
        self.go_on(now);
        Ok(())
    }

    fn report_releases(&mut self, of: &[SensorId]) {
        self.dialogue_mut().released = of.to_vec();
    }

    fn expect_delays(&mut self, excess: TimeSpan) {
        self.dialogue_mut().excess = excess;
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.go_on(now);
    }

    fn poll_output(&mut self) -> Option<Transmit> {
        self.dialogue_mut().output.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        self.continues_at()
    }

    fn stop_all(&mut self) {
        self.dialogue_mut().stop_all_next();
    }

    fn close(&mut self, now: Timestamp) {
        if self.dialogue_mut().close(now, Self::STOPS_SET_DIRECTIONS) {
            self.end_begins(now);
        }
        self.go_on(now);
    }

    fn closing(&self) -> Closing {
        self.dialogue().closing()
    }
}

/// The state of the opening.
#[derive(Debug, Clone)]
pub(crate) enum Opening<Q> {
    /// These are still to be asked, each when the one before is answered.
    Asking(VecDeque<Q>),
    /// Trains may be driven.
    Open,
}

impl<Q> Opening<Q> {
    pub(crate) fn asking(questions: impl IntoIterator<Item = Q>) -> Self {
        Self::Asking(questions.into_iter().collect())
    }

    pub(crate) const fn is_open(&self) -> bool {
        matches!(self, Self::Open)
    }
}
