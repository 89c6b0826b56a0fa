//! Requests that the station has not answered yet, and when to repeat them.

use alloc::vec::Vec;

use footplate_core::{Command, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::message::{Direction, Message};
use super::speed::step_of;
use super::uid::Uid;

/// A request is repeated when it was not answered for so long (stations answer within some milliseconds; 250 to 500 ms are advised).
const REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(250);

/// What stops something is repeated sooner: a train at 500 mm/s runs 50 mm meanwhile, and a stop that comes twice does no harm.
const STOP_REPEATED_AFTER: TimeSpan = TimeSpan::from_ms(100);

/// What stops a train does not wait for the answer to an earlier command for longer than this.
const STOP_WAITS: TimeSpan = TimeSpan::from_ms(20);

/// How often a request is written in all before it is given up: three repetitions. What stops something is never given up.
pub(super) const MOST_TRIES: u8 = 4;

/// The same for the list of locomotives once the station has begun to send it: one frame in fifty lost still leaves it whole soon.
pub(super) const LIST_TRIES: u8 = 16;

/// What an answer to a request looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Awaited {
    /// Any participant.
    Participant,
    /// Any module.
    Modules,
    Power(bool),
    Roster,
    /// How fast a locomotive runs, whatever that is.
    AnySpeed(TrainId, Uid),
    /// That it runs at a step.
    Speed(TrainId, Uid, SpeedStep),
    /// Which end leads, whichever that is.
    AnyDirection(TrainId, Uid),
    Direction(TrainId, Uid, bool),
    /// That a turnout's coil is powered, or not.
    Accessory(TurnoutId, Uid, u8, u8),
}

/// One request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Outstanding {
    pub(super) message: Message,
    pub(super) awaited: Awaited,
    pub(super) command: Option<Command>,
    pub(super) sent: Timestamp,
    pub(super) tries: u8,
}

impl Outstanding {
    pub(super) const fn is_urgent(&self) -> bool {
        matches!(self.command, Some(Command::PowerOff | Command::Speed { step: SpeedStep::STAND, .. }))
    }

    /// Whether it may be given up: trains can be driven without its answer.
    pub(super) const fn may_be_given_up(&self) -> bool {
        !self.is_urgent() && !matches!(self.awaited, Awaited::Participant | Awaited::Power(_))
    }

    fn due(&self) -> Timestamp {
        self.sent + if self.is_urgent() { STOP_REPEATED_AFTER } else { REPEATED_AFTER }
    }
}

/// All of them: at most one of each kind for a train or turnout, and one of each of the rest.
#[derive(Debug, Clone, Default)]
pub(super) struct AllOutstanding(Vec<Outstanding>);

impl AllOutstanding {
    /// A request was written; it takes the place of an earlier one for the same.
    pub(super) fn push(&mut self, outstanding: Outstanding) {
        self.0.retain(|other| !is_same(other.awaited, outstanding.awaited));
        self.0.push(outstanding);
    }

    /// Takes out what a response answers.
    pub(super) fn answered(&mut self, message: Message) -> Option<Outstanding> {
        let answers = |outstanding: &Outstanding| match (outstanding.awaited, message) {
            (Awaited::Participant, Message::Participant { .. })
            | (Awaited::Modules, Message::ModuleState { .. })
            | (Awaited::Power(true), Message::Go(_))
            | (Awaited::Power(false), Message::Stop(_)) => true,
            (Awaited::AnySpeed(_, uid), Message::Speed { uid: of, speed: Some(_) })
            | (Awaited::AnyDirection(_, uid), Message::Direction { uid: of, direction: Some(_) }) => {
                uid == of
            }
            (Awaited::Speed(_, uid, step), Message::Speed { uid: of, speed: Some(speed) }) => {
                uid == of && step_of(speed) == step
            }
            (Awaited::Direction(_, uid, forward), Message::Direction { uid: of, direction: Some(to) }) => {
                uid == of && to == Direction::of(forward)
            }
            (
                Awaited::Accessory(_, uid, position, current),
                Message::Accessory { uid: of, position: to, current: flows, .. },
            ) => uid == of && (position, current) == (to, flows),
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

    /// The answer to one comes in parts, of which one has come.
    pub(super) fn goes_on(&mut self, awaited: Awaited, now: Timestamp) {
        let found = self.0.iter_mut().find(|outstanding| is_same(outstanding.awaited, awaited));
        found.into_iter().for_each(|outstanding| outstanding.sent = now);
    }

    /// Takes out one that has to be repeated by now.
    pub(super) fn take_due(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outstanding> {
        let is_due =
            |outstanding: &Outstanding| now >= outstanding.due() && (!only_urgent || outstanding.is_urgent());
        let at = self.0.iter().position(is_due)?;
        Some(self.0.remove(at))
    }

    /// When the next has to be repeated, of those that stop something and of the rest.
    pub(super) fn due(&self, urgent: bool) -> Option<Timestamp> {
        self.0.iter().filter(|outstanding| outstanding.is_urgent() == urgent).map(Outstanding::due).min()
    }

    /// Until when a command to a train waits for the answer to an earlier one.
    pub(super) fn blocks(&self, train: TrainId, stops: bool) -> Option<Timestamp> {
        let of_train = |outstanding: &&Outstanding| matches!(outstanding.awaited, Awaited::Speed(other, ..) | Awaited::Direction(other, ..) if other == train);
        let until =
            |outstanding: &Outstanding| outstanding.sent + if stops { STOP_WAITS } else { REPEATED_AFTER };
        self.0.iter().filter(of_train).map(until).max()
    }

    pub(super) fn has(&self, awaited: Awaited) -> bool {
        self.0.iter().any(|outstanding| is_same(outstanding.awaited, awaited))
    }

    /// Whether something is asked that has to be known before trains are driven.
    pub(super) fn has_question(&self) -> bool {
        [Awaited::Participant, Awaited::Modules, Awaited::Power(true), Awaited::Roster]
            .into_iter()
            .any(|one| self.has(one))
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

fn is_same(one: Awaited, other: Awaited) -> bool {
    match (one, other) {
        (Awaited::Power(_), Awaited::Power(_)) => true,
        (Awaited::AnySpeed(one, _), Awaited::AnySpeed(other, _))
        | (Awaited::Speed(one, ..), Awaited::Speed(other, ..))
        | (Awaited::AnyDirection(one, _), Awaited::AnyDirection(other, _))
        | (Awaited::Direction(one, ..), Awaited::Direction(other, ..)) => one == other,
        (Awaited::Accessory(one, ..), Awaited::Accessory(other, ..)) => one == other,
        _ => one == other,
    }
}
