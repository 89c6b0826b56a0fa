//! Requests that the station has not answered yet, and when to repeat them.

use alloc::vec::Vec;

use footplate_core::{Command, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::broadcasts::Broadcasts;
use super::reply::Reply;
use super::request::Request;
use super::speed::{Steps, Throttle};

/// A request is repeated when it was not answered for so long: a datagram may be lost, and stations answer within some
/// milliseconds. Over a busy wireless network answers take longer now and then; a repetition then does no harm.
pub(super) const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(100);

/// What stops a train does not wait for the answer to an earlier command for longer than this.
const STOP_WAITS: TimeSpan = TimeSpan::from_ms(20);

/// How often a request is written in all before it is given up. What stops something is never given up.
pub(super) const MOST_TRIES: u8 = 10;

/// What an answer to a request looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Awaited {
    SerialNumber,
    Hardware,
    LockCode,
    /// That at least this is told.
    Broadcasts(Broadcasts),
    Status,
    /// The inputs of a group.
    Feedback(u8),
    Power(bool),
    /// How a train is driven, whatever that is.
    Locomotive(TrainId),
    /// That a train is driven so.
    Driven(TrainId, Steps, Throttle, bool),
    /// That a turnout at an address lies by its second output, or its first.
    Turnout(TurnoutId, u16, bool),
}

/// One request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Outstanding {
    pub(super) request: Request,
    pub(super) awaited: Awaited,
    pub(super) command: Option<Command>,
    pub(super) sent: Timestamp,
    pub(super) tries: u8,
}

impl Outstanding {
    pub(super) const fn is_urgent(&self) -> bool {
        matches!(self.command, Some(Command::PowerOff | Command::Speed { step: SpeedStep::STAND, .. }))
    }

    /// Whether it may be given up: what older stations do not know, and what is asked again anyway.
    pub(super) const fn may_be_given_up(&self) -> bool {
        let is_extra = matches!(
            self.awaited,
            Awaited::Hardware | Awaited::LockCode | Awaited::Feedback(_) | Awaited::Status
        );
        is_extra || self.command.is_some() && !self.is_urgent()
    }
}

/// All of them: at most one a train, a turnout, and each of the rest.
#[derive(Debug, Clone, Default)]
pub(super) struct AllOutstanding(Vec<Outstanding>);

impl AllOutstanding {
    /// A request was written; it takes the place of an earlier one for the same.
    pub(super) fn push(&mut self, outstanding: Outstanding) {
        self.0.retain(|other| !is_same(other.awaited, outstanding.awaited));
        self.0.push(outstanding);
    }

    /// Takes out what a message answers.
    pub(super) fn answered(&mut self, reply: &Reply) -> Option<Outstanding> {
        let answers = |outstanding: &Outstanding| match (outstanding.awaited, reply) {
            (Awaited::SerialNumber, Reply::SerialNumber(_))
            | (Awaited::Hardware, Reply::Hardware { .. })
            | (Awaited::LockCode, Reply::LockCode(_))
            | (Awaited::Status, Reply::Status(_)) => true,
            (Awaited::Broadcasts(wanted), Reply::Broadcasts(told)) => told.has(wanted),
            (Awaited::Feedback(group), Reply::Feedback { group: of, .. }) => group == *of,
            (Awaited::Locomotive(train), Reply::Locomotive(state)) => train.0 == state.address,
            (Awaited::Driven(train, steps, throttle, forward), Reply::Locomotive(state)) => {
                let as_fast = state.throttle.is_like(state.steps, throttle, steps);
                train.0 == state.address && as_fast && forward == state.forward
            }
            (Awaited::Power(on), reply) => reply.power() == Some(on),
            (Awaited::Turnout(_, address, second), Reply::Turnout { address: of, position }) => {
                address == *of && *position == super::states::TurnoutPosition::Output { second }
            }
            _ => false,
        };
        let at = self.0.iter().position(answers)?;
        Some(self.0.remove(at))
    }

    /// Takes out the one that is the same as another.
    pub(super) fn take(&mut self, awaited: Awaited) -> Option<Outstanding> {
        let at = self.0.iter().position(|outstanding| is_same(outstanding.awaited, awaited))?;
        Some(self.0.remove(at))
    }

    /// Takes out one that has to be repeated by now.
    pub(super) fn take_due(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outstanding> {
        let is_due = |outstanding: &Outstanding| {
            now >= outstanding.sent + REPEATED_AFTER && (!only_urgent || outstanding.is_urgent())
        };
        let at = self.0.iter().position(is_due)?;
        Some(self.0.remove(at))
    }

    /// When the next has to be repeated.
    pub(super) fn due(&self) -> Option<Timestamp> {
        self.0.iter().map(|outstanding| outstanding.sent + REPEATED_AFTER).min()
    }

    /// Until when a command to a train waits for the answer to an earlier one.
    pub(super) fn blocks(&self, train: TrainId, stops: bool) -> Option<Timestamp> {
        let of_train = |outstanding: &&Outstanding| matches!(outstanding.awaited, Awaited::Driven(other, ..) | Awaited::Locomotive(other) if other == train);
        let waits = if stops { STOP_WAITS } else { REPEATED_AFTER };
        self.0.iter().find(of_train).map(|outstanding| outstanding.sent + waits)
    }

    pub(super) fn has(&self, awaited: Awaited) -> bool {
        self.0.iter().any(|outstanding| is_same(outstanding.awaited, awaited))
    }

    /// Whether something is asked that has to be known before trains are driven.
    pub(super) fn has_question(&self) -> bool {
        let concerns_one =
            |awaited| matches!(awaited, Awaited::Locomotive(_) | Awaited::Driven(..) | Awaited::Turnout(..));
        self.0.iter().any(|outstanding| !concerns_one(outstanding.awaited))
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

fn is_same(one: Awaited, other: Awaited) -> bool {
    match (one, other) {
        (
            Awaited::Driven(one, ..) | Awaited::Locomotive(one),
            Awaited::Driven(other, ..) | Awaited::Locomotive(other),
        ) => one == other,
        (Awaited::Power(_), Awaited::Power(_)) | (Awaited::Broadcasts(_), Awaited::Broadcasts(_)) => true,
        (Awaited::Turnout(one, ..), Awaited::Turnout(other, ..)) => one == other,
        _ => one == other,
    }
}
