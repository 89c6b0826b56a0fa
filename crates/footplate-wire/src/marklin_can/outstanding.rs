//! The answers to requests to the station, and when to repeat them.

use core::mem::discriminant;

use footplate_core::{DecoderSteps, FunctionNumber, SpeedStep, TimeSpan, TrainId, TurnoutId};

use super::message::{Direction, Message};
use super::speed::step_of;
use super::uid::Uid;
use crate::outstanding::{Awaited as AwaitedAnswer, Repeats, Subject};

/// Stations answer within some milliseconds; 250 to 500 ms are advised.
pub(super) const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(250);

/// A train at 500 mm/s runs 50 mm in this time, and a stop that comes twice does no harm.
const STOP_REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(100);

/// How often the list of locomotives is asked for once the station has begun to send it: with one frame in fifty lost it still
/// comes whole soon.
const LIST_TRIES: u8 = 16;

/// What an answer to a request looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Awaited {
    /// Any participant.
    Participant,
    /// Any module.
    Modules,
    Power(bool),
    /// The list of locomotives, and whether the station has ever begun to send it.
    Roster {
        has_begun: bool,
    },
    /// The speed of a locomotive, whatever it is.
    AnySpeed(TrainId, Uid),
    /// That it runs at a step of its decoder.
    Speed(TrainId, Uid, SpeedStep, DecoderSteps),
    /// The direction of a locomotive, whatever it is.
    AnyDirection(TrainId, Uid),
    Direction(TrainId, Uid, bool),
    /// That a function of a locomotive is on, or off.
    Function(TrainId, Uid, FunctionNumber, bool),
    /// That a turnout's coil is powered, or not.
    Accessory(TurnoutId, Uid, u8, u8),
}

impl Awaited {
    /// Whether trains may not run before the answer.
    pub(super) const fn is_question(&self) -> bool {
        matches!(self, Self::Participant | Self::Modules | Self::Power(_) | Self::Roster { .. })
    }
}

impl AwaitedAnswer for Awaited {
    type Request = Message;
    type Reply = Message;

    const REPEATS: Repeats = Repeats {
        after: REPEATED_AFTER,
        stop_after: STOP_REPEATED_AFTER,
        stop_waits: TimeSpan::from_ms(20),
        most_tries: 4,
        usual: 1,
    };

    fn is_answered_by(&self, message: &Message) -> bool {
        match (*self, *message) {
            (Self::Participant, Message::Participant { .. })
            | (Self::Modules, Message::ModuleState { .. })
            | (Self::Power(true), Message::Go(_))
            | (Self::Power(false), Message::Stop(_)) => true,
            (Self::AnySpeed(_, uid), Message::Speed { uid: of, speed: Some(_) })
            | (Self::AnyDirection(_, uid), Message::Direction { uid: of, direction: Some(_) }) => uid == of,
            (Self::Speed(_, uid, step, decoder), Message::Speed { uid: of, speed: Some(speed) }) => {
                uid == of && step_of(speed, decoder) == step
            }
            (Self::Direction(_, uid, forward), Message::Direction { uid: of, direction: Some(to) }) => {
                uid == of && to == Direction::of(forward)
            }
            (
                Self::Function(_, uid, function, on),
                Message::Function { uid: of, function: number, value: Some(value) },
            ) => uid == of && function.get() == number && (value != 0) == on,
            (
                Self::Accessory(_, uid, position, current),
                Message::Accessory { uid: of, position: to, current: flows, .. },
            ) => uid == of && (position, current) == (to, flows),
            _ => false,
        }
    }

    fn subject(&self) -> Subject {
        match *self {
            Self::Speed(train, ..) | Self::Direction(train, ..) => Subject::Train(train),
            Self::Function(train, _, function, _) => Subject::Function(train, function.get()),
            Self::Power(_) => Subject::Power,
            Self::Accessory(turnout, ..) => Subject::Turnout(turnout),
            _ => Subject::Other,
        }
    }

    /// Speed and direction are questions of their own, and a number on the bus names the same train as any other.
    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::AnySpeed(one, _), Self::AnySpeed(other, _))
            | (Self::AnyDirection(one, _), Self::AnyDirection(other, _)) => one == other,
            // The release of a coil does not end the repeats of the throw.
            (Self::Accessory(one, .., current), Self::Accessory(other, .., of_other)) => {
                (one, current) == (other, of_other)
            }
            _ => discriminant(self) == discriminant(other) && self.subject() == other.subject(),
        }
    }

    fn may_be_given_up(&self, _: bool) -> bool {
        !matches!(self, Self::Participant | Self::Power(_))
    }

    fn most_tries(&self) -> u8 {
        match self {
            // A damaged list arrives whole another time.
            Self::Roster { has_begun: true } => LIST_TRIES,
            _ => Self::REPEATS.most_tries,
        }
    }
}
