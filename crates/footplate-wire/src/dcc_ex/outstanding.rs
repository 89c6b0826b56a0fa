//! The answers to requests to the board, and when to repeat them.

use footplate_core::{FunctionNumber, TimeSpan, TrainId, TurnoutId};

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
    Turnout(TurnoutId, bool),
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
            _ => false,
        }
    }

    fn subject(&self) -> Subject {
        match *self {
            Self::Identity | Self::Slots => Subject::Other,
            Self::Locomotive(train) | Self::Driven(train, ..) => Subject::Train(train),
            Self::Function(train, function, _) => Subject::Function(train, function.get()),
            Self::Power(_) => Subject::Power,
            Self::Turnout(turnout, _) => Subject::Turnout(turnout),
        }
    }

    fn may_be_given_up(&self, is_command: bool) -> bool {
        is_command
    }
}
