//! The answers to requests to the station, and when to repeat them.

use footplate_core::{TimeSpan, TrainId, TurnoutId};

use super::functions::FunctionGroup;
use super::message::Message;
use super::request::Request;
use super::slot::SlotData;
use crate::outstanding::{Awaited as AwaitedAnswer, Repeats, Subject};

/// A request without an answer is repeated after this time: three messages with their reports take some 30 ms on an idle bus; a busy
/// bus and a wireless network are given ten times that.
pub(super) const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(300);

/// What the station or the server says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// A slot.
    Slot(SlotData),
    /// A message of this client was put on the bus.
    Sent(Message),
    /// A packet for the rails was accepted.
    Packet,
}

/// What an answer to a request looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Awaited {
    /// Any state of the station itself.
    Status,
    Power(bool),
    /// That the nth question for the states of detectors is on the bus.
    Interrogation(u8),
    /// The slot of a locomotive, however it is driven.
    Locomotive(TrainId),
    /// That it is driven so.
    Driven(TrainId, u8, bool),
    /// That these of a group of its functions are on, or that the packet which switches them was accepted.
    Functions(TrainId, FunctionGroup, u32),
    /// That a turnout's output was commanded on the bus: nothing else confirms it.
    Turnout(TurnoutId, Message),
    /// That the release of a turnout's output was put on the bus.
    Release(TurnoutId, Message),
}

impl Awaited {
    /// Whether trains may not run before the answer.
    pub(super) const fn is_question(&self) -> bool {
        matches!(self, Self::Status | Self::Power(_) | Self::Interrogation(_))
    }
}

impl AwaitedAnswer for Awaited {
    type Request = Request;
    type Reply = Answer;

    const REPEATS: Repeats = Repeats {
        after: REPEATED_AFTER,
        stop_after: REPEATED_AFTER,
        stop_waits: TimeSpan::from_ms(20),
        most_tries: 6,
        usual: 0,
    };

    fn is_answered_by(&self, answer: &Answer) -> bool {
        match (*self, answer) {
            (Self::Status, Answer::Slot(data)) => data.slot == 0,
            (Self::Power(on), Answer::Slot(data)) => data.is_powered() == on,
            (Self::Locomotive(train), Answer::Slot(data)) => train.0 == data.address && data.slot > 0,
            (Self::Driven(train, speed, forward), Answer::Slot(data)) => {
                (train.0, speed, forward) == (data.address, data.speed, data.forward) && data.slot > 0
            }
            (Self::Functions(train, group, functions), Answer::Slot(data)) => {
                let is_so = (functions ^ data.functions) & group.mask() == 0;
                group.is_in_slot() && is_so && train.0 == data.address && data.slot > 0
            }
            (Self::Functions(_, group, _), Answer::Packet) => !group.is_in_slot(),
            (Self::Interrogation(nth), Answer::Sent(message)) => {
                Request::Interrogate(nth).messages().contains(message)
            }
            (Self::Turnout(_, awaited) | Self::Release(_, awaited), Answer::Sent(message)) => {
                awaited == *message
            }
            _ => false,
        }
    }

    fn subject(&self) -> Subject {
        match *self {
            Self::Status | Self::Interrogation(_) | Self::Release(..) => Subject::Other,
            Self::Locomotive(train) | Self::Driven(train, ..) => Subject::Train(train),
            Self::Functions(train, group, _) => Subject::Function(train, group as u8),
            Self::Power(_) => Subject::Power,
            Self::Turnout(turnout, _) => Subject::Turnout(turnout),
        }
    }

    /// A turnout is not thrown again before its output is released.
    fn turnout(&self) -> Option<TurnoutId> {
        match *self {
            Self::Turnout(turnout, _) | Self::Release(turnout, _) => Some(turnout),
            _ => None,
        }
    }

    fn may_be_given_up(&self, is_command: bool) -> bool {
        is_command || matches!(self, Self::Interrogation(_) | Self::Release(..))
    }
}
