//! Requests that the board has not answered yet, and when to repeat them.

use alloc::vec::Vec;

use footplate_core::{Command, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::reply::Reply;
use super::request::{Request, Throttle};
use super::time_model::ANSWER_LONGEST;

/// A request is repeated when it was not answered for so long: many times the longest answer (9.1 ms), as the project's own
/// client library asks of clients.
pub(super) const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(250);

/// What stops a train does not wait for the answer to an earlier command for longer than this.
const STOP_WAITS: TimeSpan = TimeSpan::from_ns(2 * ANSWER_LONGEST.as_ns());

/// How often a request is written in all before it is given up. What stops something is never given up.
pub(super) const MOST_TRIES: u8 = 4;

/// What an answer to a request looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Awaited {
    Identity,
    Slots,
    /// How a train is driven, whatever that is.
    Locomotive(TrainId),
    /// That a train is driven so.
    Driven(TrainId, Throttle, bool),
    Power(bool),
    Turnout(TurnoutId, bool),
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
        let at = self.0.iter().position(|outstanding| match (outstanding.awaited, reply) {
            (Awaited::Identity, Reply::Identity(_)) | (Awaited::Slots, Reply::Slots(_)) => true,
            (Awaited::Locomotive(train), Reply::Locomotive { cab, .. }) => train.0 == *cab,
            (
                Awaited::Driven(train, throttle, forward),
                Reply::Locomotive { cab, throttle: at, forward: to, .. },
            ) => train.0 == *cab && throttle == *at && forward == *to,
            (Awaited::Power(on), reply) => reply.main_power() == Some(on),
            (Awaited::Turnout(turnout, curved), Reply::Turnout { id, thrown }) => {
                turnout.0 == *id && curved == *thrown
            }
            _ => false,
        })?;
        Some(self.0.remove(at))
    }

    /// Takes out the one that has waited longest for an answer of a kind that `<X>` may be.
    pub(super) fn refused(&mut self) -> Option<TurnoutId> {
        let turnout = |outstanding: &Outstanding| match outstanding.awaited {
            Awaited::Turnout(turnout, _) => Some(turnout),
            _ => None,
        };
        let at = self.0.iter().position(|outstanding| turnout(outstanding).is_some())?;
        turnout(&self.0.remove(at))
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
        (Awaited::Power(_), Awaited::Power(_)) => true,
        (Awaited::Turnout(one, _), Awaited::Turnout(other, _)) => one == other,
        _ => one == other,
    }
}
