//! The answers to requests to the board, and when to repeat them.

use footplate_core::{FunctionNumber, TimeSpan, TrainId, TurnoutId};

use super::definition_number::number_of;
use super::reply::Reply;
use super::request::{Request, Throttle};
use super::time_model::ANSWER_LONGEST;
use crate::outstanding::{Awaited as AwaitedAnswer, Repeats, Subject};

/// A request without an answer is repeated after this time: many times the longest answer (9.1 ms), as the project's own
/// client library asks of clients.
pub(super) const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(250);

/// What an answer to a request looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Awaited {
    Identity,
    Slots,
    /// The state of a train, whatever it is.
    Locomotive(TrainId),
    /// That a train has this state.
    Driven(TrainId, Throttle, bool),
    /// That a function of a train is on, or off.
    Function(TrainId, FunctionNumber, bool),
    Power(bool),
    /// That a turnout which its owner has defined lies so.
    Turnout(TurnoutId, bool),
    /// What the board has under the number of the session's definition of a turnout.
    Definition(TurnoutId),
    /// That a turnout which the session has defined lies so.
    Thrown(TurnoutId, bool),
}

impl AwaitedAnswer for Awaited {
    type Request = Request;
    type Reply = Reply;

    const REPEATS: Repeats = Repeats {
        after: REPEATED_AFTER,
        stop_after: REPEATED_AFTER,
        stop_waits: TimeSpan::from_ns(2 * ANSWER_LONGEST.as_ns()),
        most_tries: 4,
        usual: 0,
    };

    fn is_answered_by(&self, reply: &Reply) -> bool {
        match (*self, reply) {
            (Self::Identity, Reply::Identity(_)) | (Self::Slots, Reply::Slots(_)) => true,
            (Self::Locomotive(train), Reply::Locomotive { cab, .. }) => train.0 == *cab,
            (
                Self::Driven(train, throttle, forward),
                Reply::Locomotive { cab, throttle: at, forward: to, .. },
            ) => train.0 == *cab && throttle == *at && forward == *to,
            (Self::Function(train, function, on), Reply::Locomotive { cab, functions, .. }) => {
                train.0 == *cab && function.is_in(*functions) == on
            }
            (Self::Power(on), reply) => reply.main_power() == Some(on),
            (Self::Turnout(turnout, curved), Reply::Turnout { id, thrown }) => {
                turnout.0 == *id && curved == *thrown
            }
            (Self::Definition(turnout), Reply::Definition { id, .. }) => number_of(turnout) == *id,
            (Self::Thrown(turnout, curved), Reply::Turnout { id, thrown }) => {
                number_of(turnout) == *id && curved == *thrown
            }
            (Self::Thrown(turnout, curved), Reply::Definition { id, address, thrown }) => {
                number_of(turnout) == *id && Some(turnout.0) == *address && curved == *thrown
            }
            _ => false,
        }
    }

    /// Until the board says so, no train may count on a turnout.
    fn is_entered_when_answered(&self) -> bool {
        matches!(self, Self::Definition(_) | Self::Thrown(..))
    }

    /// Over a line that loses bytes, an answer comes to one request in three, or fewer.
    fn most_tries(&self) -> u8 {
        let usual = Self::REPEATS.most_tries;
        if self.is_entered_when_answered() { 2 * usual } else { usual }
    }

    fn subject(&self) -> Subject {
        match *self {
            Self::Identity | Self::Slots => Subject::Other,
            Self::Locomotive(train) | Self::Driven(train, ..) => Subject::Train(train),
            Self::Function(train, function, _) => Subject::Function(train, function.get()),
            Self::Power(_) => Subject::Power,
            Self::Turnout(turnout, _) | Self::Definition(turnout) | Self::Thrown(turnout, _) => {
                Subject::Turnout(turnout)
            }
        }
    }

    fn may_be_given_up(&self, is_command: bool) -> bool {
        is_command
    }
}
