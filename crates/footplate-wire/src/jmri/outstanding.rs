//! The answers to requests to JMRI, and when to repeat them.

use footplate_core::{FunctionNumber, TimeSpan, TrainId, TurnoutId};

use super::request::Request;
use crate::dcc_ex::Throttle;
use crate::outstanding::{Awaited as AwaitedAnswer, Repeats, Subject};
use crate::reported_functions::ReportedFunctions;

/// A request without an answer is repeated after this time: JMRI answers at once, but may collect garbage or draw panels meanwhile.
pub(super) const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(500);

/// What JMRI says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    Pong,
    Powers,
    Sensors,
    /// Whether the track has power; `None` if JMRI does not know.
    Power(Option<bool>),
    /// The whole state of a locomotive.
    Locomotive {
        train: TrainId,
        throttle: Throttle,
        forward: bool,
        functions: ReportedFunctions,
    },
    Turnout(TurnoutId, bool),
}

/// What an answer to a request looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Awaited {
    Pong,
    Powers,
    Sensors,
    Power(bool),
    /// The state of a locomotive, whatever it is.
    Locomotive(TrainId),
    /// That it is driven so.
    Driven(TrainId, Throttle, bool),
    /// That a function of it is on, or off.
    Function(TrainId, FunctionNumber, bool),
    Turnout(TurnoutId, bool),
}

impl Awaited {
    /// Whether trains may not run before the answer.
    pub(super) const fn is_question(&self) -> bool {
        matches!(self, Self::Pong | Self::Powers | Self::Sensors | Self::Power(_))
    }
}

impl AwaitedAnswer for Awaited {
    type Request = Request;
    type Reply = Answer;

    const REPEATS: Repeats = Repeats {
        after: REPEATED_AFTER,
        stop_after: REPEATED_AFTER,
        stop_waits: TimeSpan::from_ms(20),
        most_tries: 4,
        usual: 0,
    };

    fn is_answered_by(&self, answer: &Answer) -> bool {
        match (*self, *answer) {
            (Self::Pong, Answer::Pong)
            | (Self::Powers, Answer::Powers)
            | (Self::Sensors, Answer::Sensors)
            // Some hardware cannot say, so trains are driven without knowing; a power that is to go off is asked for again.
            | (Self::Power(true), Answer::Power(None)) => true,
            (Self::Power(on), Answer::Power(is)) => is == Some(on),
            (Self::Locomotive(train), Answer::Locomotive { train: of, .. }) => train == of,
            (Self::Driven(train, at, to), Answer::Locomotive { train: of, throttle, forward, .. }) => {
                (train, at, to) == (of, throttle, forward)
            }
            (Self::Function(train, function, on), Answer::Locomotive { train: of, functions, .. }) => {
                train == of && functions.is_on(function) == Some(on)
            }
            (Self::Turnout(turnout, curved), Answer::Turnout(of, lies)) => (turnout, curved) == (of, lies),
            _ => false,
        }
    }

    fn subject(&self) -> Subject {
        match *self {
            Self::Pong | Self::Powers | Self::Sensors => Subject::Other,
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
