//! The answers to requests to the station, and when to repeat them.

use footplate_core::{DecoderSteps, FunctionNumber, TimeSpan, TrainId, TurnoutId};

use super::broadcasts::Broadcasts;
use super::reply::Reply;
use super::request::Request;
use super::speed::Throttle;
use super::states::TurnoutPosition;
use crate::outstanding::{Awaited as AwaitedAnswer, Repeats, Subject};

/// A request without an answer is repeated after this time: a datagram may be lost, and stations answer within some
/// milliseconds. Over a busy wireless network answers take longer now and then; a repetition then does no harm.
pub(super) const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(100);

/// What an answer to a request looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Awaited {
    SerialNumber,
    Hardware,
    LockCode,
    /// At least these broadcasts.
    Broadcasts(Broadcasts),
    Status,
    /// The inputs of a group.
    Feedback(u8),
    Power(bool),
    /// The state of a train, whatever it is.
    Locomotive(TrainId),
    /// That a train has this state.
    Driven(TrainId, DecoderSteps, Throttle, bool),
    /// That a function of a train is on, or off.
    Function(TrainId, FunctionNumber, bool),
    /// That a turnout at an address lies by its second output, or its first.
    Turnout(TurnoutId, u16, bool),
}

impl Awaited {
    /// Whether trains may not run before the answer.
    pub(super) const fn is_question(&self) -> bool {
        !matches!(self, Self::Locomotive(_) | Self::Driven(..) | Self::Function(..) | Self::Turnout(..))
    }
}

impl AwaitedAnswer for Awaited {
    type Request = Request;
    type Reply = Reply;

    const REPEATS: Repeats = Repeats {
        after: REPEATED_AFTER,
        stop_after: REPEATED_AFTER,
        stop_waits: TimeSpan::from_ms(20),
        most_tries: 10,
        usual: 1,
    };

    fn is_answered_by(&self, reply: &Reply) -> bool {
        match (*self, reply) {
            (Self::SerialNumber, Reply::SerialNumber(_))
            | (Self::Hardware, Reply::Hardware { .. })
            | (Self::LockCode, Reply::LockCode(_))
            | (Self::Status, Reply::Status(_)) => true,
            (Self::Broadcasts(wanted), Reply::Broadcasts(reported)) => reported.has(wanted),
            (Self::Feedback(group), Reply::Feedback { group: of, .. }) => group == *of,
            (Self::Locomotive(train), Reply::Locomotive(state)) => train.0 == state.address,
            (Self::Driven(train, steps, throttle, forward), Reply::Locomotive(state)) => {
                let as_fast = state.throttle.is_like(state.steps, throttle, steps);
                train.0 == state.address && as_fast && forward == state.forward
            }
            (Self::Function(train, function, on), Reply::Locomotive(state)) => {
                train.0 == state.address && function.is_in(state.functions) == on
            }
            (Self::Power(on), reply) => reply.confirms_power(on),
            (Self::Turnout(_, address, second), Reply::Turnout { address: of, position }) => {
                address == *of && *position == TurnoutPosition::Output { second }
            }
            _ => false,
        }
    }

    fn subject(&self) -> Subject {
        match *self {
            Self::Locomotive(train) | Self::Driven(train, ..) => Subject::Train(train),
            Self::Function(train, function, _) => Subject::Function(train, function.get()),
            Self::Power(_) => Subject::Power,
            Self::Turnout(turnout, ..) => Subject::Turnout(turnout),
            _ => Subject::Other,
        }
    }

    /// Older stations do not know some questions, and some are asked again anyway.
    fn may_be_given_up(&self, is_command: bool) -> bool {
        is_command || matches!(self, Self::Hardware | Self::LockCode | Self::Feedback(_) | Self::Status)
    }
}
