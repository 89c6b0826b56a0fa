//! Requests that a station has not answered yet, and when to repeat them.

use alloc::vec::Vec;
use core::fmt::Debug;

use footplate_core::{Command, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

/// When requests to a kind of station are repeated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Repeats {
    /// A request without an answer is repeated after this time.
    pub(crate) after: TimeSpan,
    /// A request that stops something is repeated after this time.
    pub(crate) stop_after: TimeSpan,
    /// A request that stops a train waits at most this long for the answer to an earlier request for that train.
    pub(crate) stop_waits: TimeSpan,
    /// How often a request is written in all before it is given up.
    pub(crate) most_tries: u8,
    /// How many repetitions of a command are usual on this link and not reported.
    pub(crate) usual: u8,
}

/// What a question is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Subject {
    /// The power of the track.
    Power,
    /// How a train is driven.
    Train(TrainId),
    /// A function of a train, or a group of them.
    Function(TrainId, u8),
    /// A turnout.
    Turnout(TurnoutId),
    /// Anything else: the question itself.
    Other,
}

/// What an answer to a request looks like.
pub(crate) trait Awaited: Copy + Debug + PartialEq {
    /// What is written to the station.
    type Request: Clone + Debug;
    /// What the station says.
    type Reply;
    const REPEATS: Repeats;

    fn is_answered_by(&self, reply: &Self::Reply) -> bool;

    fn subject(&self) -> Subject;

    /// Whether both await the answer to the same question, so that only the newer one counts.
    fn is_same(&self, other: &Self) -> bool {
        match self.subject() {
            Subject::Other => self == other,
            subject => subject == other.subject(),
        }
    }

    /// The train whose next command must wait for this answer.
    fn train(&self) -> Option<TrainId> {
        match self.subject() {
            Subject::Train(train) => Some(train),
            _ => None,
        }
    }

    /// The turnout that is not thrown again before this answer.
    fn turnout(&self) -> Option<TurnoutId> {
        match self.subject() {
            Subject::Turnout(turnout) => Some(turnout),
            _ => None,
        }
    }

    /// The train of which it awaits a function.
    fn switched(&self) -> Option<TrainId> {
        match self.subject() {
            Subject::Function(train, _) => Some(train),
            _ => None,
        }
    }

    /// Whether trains can be driven without the answer, so that the request is given up in the end.
    fn may_be_given_up(&self, is_command: bool) -> bool;

    /// Whether the command is added to the recording when it is answered, instead of when it is written.
    fn is_entered_when_answered(&self) -> bool {
        false
    }

    /// How often the request is written in all before it is given up.
    fn most_tries(&self) -> u8 {
        Self::REPEATS.most_tries
    }
}

/// A request that is about to be written.
#[derive(Debug, Clone)]
pub(crate) struct Outgoing<A: Awaited> {
    pub(crate) request: A::Request,
    pub(crate) awaited: Option<A>,
    pub(crate) command: Option<Command>,
    /// How often it was written, this time included.
    pub(crate) tries: u8,
}

impl<A: Awaited> Outgoing<A> {
    /// A question.
    pub(crate) const fn asks(request: A::Request, awaited: A) -> Self {
        Self { request, awaited: Some(awaited), command: None, tries: 1 }
    }

    /// A request that the station does not answer.
    pub(crate) const fn says(request: A::Request) -> Self {
        Self { request, awaited: None, command: None, tries: 1 }
    }

    /// A request that carries out a command.
    pub(crate) const fn commands(command: Command, request: A::Request, awaited: Option<A>) -> Self {
        Self { request, awaited, command: Some(command), tries: 1 }
    }
}

/// A request that was written and not answered yet.
#[derive(Debug, Clone)]
pub(crate) struct Outstanding<A: Awaited> {
    pub(crate) request: A::Request,
    pub(crate) awaited: A,
    pub(crate) command: Option<Command>,
    pub(crate) sent: Timestamp,
    pub(crate) tries: u8,
}

impl<A: Awaited> Outstanding<A> {
    fn is_urgent(&self) -> bool {
        matches!(self.command, Some(Command::PowerOff | Command::Speed { step: SpeedStep::STAND, .. }))
    }

    /// Whether it was repeated often enough. Requests that stop something are never given up.
    pub(crate) fn is_exhausted(&self) -> bool {
        let may_end = !self.is_urgent() && self.awaited.may_be_given_up(self.command.is_some());
        may_end && self.tries >= self.awaited.most_tries()
    }

    fn due(&self) -> Timestamp {
        self.sent + if self.is_urgent() { A::REPEATS.stop_after } else { A::REPEATS.after }
    }
}

/// All requests without an answer, at most one for each question.
#[derive(Debug, Clone)]
pub(crate) struct AllOutstanding<A: Awaited>(Vec<Outstanding<A>>);

impl<A: Awaited> AllOutstanding<A> {
    pub(crate) const fn new() -> Self {
        Self(Vec::new())
    }

    /// Adds a request that was written; it replaces an earlier one for the same question.
    pub(crate) fn push(&mut self, outstanding: Outstanding<A>) {
        self.0.retain(|other| !other.awaited.is_same(&outstanding.awaited));
        self.0.push(outstanding);
    }

    /// Removes and returns the request that a reply answers.
    pub(crate) fn answered(&mut self, reply: &A::Reply) -> Option<Outstanding<A>> {
        self.take_first(|outstanding| outstanding.awaited.is_answered_by(reply))
    }

    /// Removes and returns the request with the same question.
    pub(crate) fn take(&mut self, awaited: &A) -> Option<Outstanding<A>> {
        self.take_first(|outstanding| outstanding.awaited.is_same(awaited))
    }

    /// Removes and returns the oldest request with a property.
    pub(crate) fn take_first(
        &mut self,
        has_property: impl FnMut(&Outstanding<A>) -> bool,
    ) -> Option<Outstanding<A>> {
        let at = self.0.iter().position(has_property)?;
        Some(self.0.remove(at))
    }

    /// Notes that a part of an answer arrived, and awaits the rest anew.
    pub(crate) fn goes_on(&mut self, awaited: A, now: Timestamp) {
        if let Some(found) = self.0.iter_mut().find(|outstanding| outstanding.awaited.is_same(&awaited)) {
            (found.awaited, found.sent) = (awaited, now);
        }
    }

    /// Removes and returns a request whose answer is overdue. `may_throw`: whether a turnout may be thrown now.
    pub(crate) fn take_due(
        &mut self,
        now: Timestamp,
        only_urgent: bool,
        may_throw: bool,
    ) -> Option<Outstanding<A>> {
        self.take_first(|outstanding| {
            let may_go = may_throw || !matches!(outstanding.command, Some(Command::Turnout { .. }));
            now >= outstanding.due() && may_go && (!only_urgent || outstanding.is_urgent())
        })
    }

    /// Returns when requests are overdue, of those that stop something or of the rest.
    pub(crate) fn due(&self, urgent: bool) -> impl Iterator<Item = Timestamp> {
        self.0.iter().filter(move |outstanding| outstanding.is_urgent() == urgent).map(Outstanding::due)
    }

    /// Until when a command to a train waits for the answer to an earlier one.
    pub(crate) fn blocks(&self, train: TrainId, stops: bool) -> Option<Timestamp> {
        let waits = if stops { A::REPEATS.stop_waits } else { A::REPEATS.after };
        let of_train = self.0.iter().filter(|outstanding| outstanding.awaited.train() == Some(train));
        of_train.map(|outstanding| outstanding.sent + waits).max()
    }

    pub(crate) fn has(&self, awaited: &A) -> bool {
        self.any(|outstanding| outstanding.is_same(awaited))
    }

    pub(crate) fn any(&self, has_property: impl Fn(&A) -> bool) -> bool {
        self.0.iter().any(|outstanding| has_property(&outstanding.awaited))
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}
