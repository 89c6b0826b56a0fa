//! Requests and commands as frames, and what is done when they are not answered.

use footplate_core::{Command, EventKind, SpeedStep, Timestamp, TrainId};

use super::super::frame::Frame;
use super::super::message::{Direction, Message};
use super::super::opening::Question;
use super::super::outstanding::{Awaited, LIST_TRIES, MOST_TRIES, Outstanding};
use super::super::roster::LOCOMOTIVES_FILE;
use super::super::settings::Transport;
use super::super::solenoid::Solenoid;
use super::super::speed::speed_of;
use super::super::uid::Uid;
use super::{Client, Outgoing, Query, position_of};
use crate::queue::entry_of;
use crate::session::{LinkNotice, Transmit};

impl Client {
    pub(super) fn asking(&mut self, now: Timestamp, question: Question) -> Outgoing {
        match question {
            Question::Ping => {
                self.polled = now;
                Outgoing::asks(Message::Ping, Awaited::Participant)
            }
            Question::Modules => {
                self.polled = now;
                let modules = self.settings.modules;
                Outgoing::asks(Message::ModulePoll { uid: Uid::ALL, modules }, Awaited::Modules)
            }
            Question::Power => {
                let message = if self.power { Message::Go(Uid::ALL) } else { Message::Stop(Uid::ALL) };
                Outgoing::asks(message, Awaited::Power(self.power))
            }
            Question::Roster => Outgoing::asks(Message::File(LOCOMOTIVES_FILE), Awaited::Roster),
        }
    }

    pub(super) fn query(&self, train: TrainId, query: Query) -> Outgoing {
        let uid = self.uid(train);
        match query {
            Query::Speed => {
                Outgoing::asks(Message::Speed { uid, speed: None }, Awaited::AnySpeed(train, uid))
            }
            Query::Direction => {
                Outgoing::asks(Message::Direction { uid, direction: None }, Awaited::AnyDirection(train, uid))
            }
        }
    }

    /// The number of a train on the bus: by the station's list, or by its address.
    pub(super) fn uid(&self, train: TrainId) -> Uid {
        self.roster.uid(train).unwrap_or_else(|| self.settings.locomotives.uid(train.0))
    }

    /// The coil that has been powered for long enough is released.
    pub(super) fn next_release(&mut self, now: Timestamp) -> Option<Outgoing> {
        let Solenoid { turnout, curved, .. } = self.solenoid.take_if(|powered| now >= powered.release_at)?;
        let (uid, position) = (self.settings.turnout(turnout), position_of(curved));
        let message = Message::Accessory { uid, position, current: 0, time: None };
        Some(Outgoing::asks(message, Awaited::Accessory(turnout, uid, position, 0)))
    }

    /// A request that was not answered in time, unless something newer waits or it was repeated often enough.
    pub(super) fn next_repeat(&mut self, now: Timestamp, only_urgent: bool) -> Option<Outgoing> {
        while let Some(due) = self.outstanding.take_due(now, only_urgent) {
            let Outstanding { message, awaited, command, tries, .. } = due;
            if command.is_some_and(|command| self.waiting.outdates(command)) {
                continue;
            }
            // A list that was damaged on its way comes whole another time.
            let most =
                if awaited == Awaited::Roster && self.roster.has_begun() { LIST_TRIES } else { MOST_TRIES };
            if tries >= most && due.may_be_given_up() {
                if let Some(given_up) = self.given_up(awaited, command) {
                    return Some(given_up);
                }
                continue;
            }
            // Once is no news on a network that loses datagrams.
            if let Some(command) = command.filter(|_| tries > 1) {
                self.notify(LinkNotice::Repeated { command });
            }
            return Some(Outgoing {
                message,
                awaited: Some(awaited),
                command,
                tries: tries.saturating_add(1),
            });
        }
        None
    }

    /// The station does not answer this; what is done instead.
    pub(super) fn given_up(&mut self, awaited: Awaited, command: Option<Command>) -> Option<Outgoing> {
        if let Some(command) = command {
            self.notify(LinkNotice::Unconfirmed { command });
        }
        match awaited {
            Awaited::Modules => self.has_modules = false,
            Awaited::AnyDirection(train, uid) => {
                // It cannot be asked which end leads: it is commanded, so that it is known.
                self.locomotives.know(train);
                let locomotive = self.locomotives.get_mut(train)?;
                if locomotive.forward.is_none() {
                    locomotive.forward = Some(true);
                    let message = Message::Direction { uid, direction: Some(Direction::Forward) };
                    return Some(Outgoing::asks(message, Awaited::Direction(train, uid, true)));
                }
            }
            _ => {}
        }
        None
    }

    /// The request of a command, and what was commanded by it.
    pub(super) fn outgoing(&mut self, now: Timestamp, command: Command) -> Outgoing {
        let (message, awaited) = match command {
            Command::Speed { train, step } => {
                let uid = self.uid(train);
                self.commanded(train, step, false);
                let speed = Some(speed_of(step).unwrap_or_default());
                (Message::Speed { uid, speed }, Awaited::Speed(train, uid, step))
            }
            Command::Reverse { train } => {
                let uid = self.uid(train);
                let forward = self.commanded(train, SpeedStep::STAND, true);
                let direction = Some(Direction::of(forward));
                (Message::Direction { uid, direction }, Awaited::Direction(train, uid, forward))
            }
            Command::Turnout { turnout, curved } => {
                self.solenoid = Some(Solenoid::powered(turnout, curved, now));
                let (uid, position) = (self.settings.turnout(turnout), position_of(curved));
                let message = Message::Accessory { uid, position, current: 1, time: None };
                (message, Awaited::Accessory(turnout, uid, position, 1))
            }
            Command::PowerOff | Command::PowerOn => {
                let on = command == Command::PowerOn;
                self.power = on;
                let message = if on { Message::Go(Uid::ALL) } else { Message::Stop(Uid::ALL) };
                (message, Awaited::Power(on))
            }
        };
        Outgoing { message, awaited: Some(awaited), command: Some(command), tries: 1 }
    }

    /// A train is commanded to run at a step, and the other way if it is reversed; returns whether its front end leads then.
    pub(super) fn commanded(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> bool {
        self.locomotives.know(train);
        self.suspected.retain(|other| *other != train);
        let Some(locomotive) = self.locomotives.get_mut(train) else { return true };
        if reverses {
            locomotive.forward = Some(!locomotive.forward.unwrap_or(true));
        }
        (locomotive.step, locomotive.is_driven, locomotive.is_stopped) = (step, true, false);
        locomotive.forward.unwrap_or(true)
    }

    pub(super) fn write(&mut self, message: Message, is_response: bool) {
        let frame: Frame = message.frame(is_response, self.hash);
        let bytes = match self.settings.transport {
            Transport::Network => frame.encode().to_vec(),
            Transport::Adapter => {
                let mut line = frame.to_text().into_bytes();
                line.push(b'\r');
                line
            }
        };
        self.output.push_back(Transmit::Message(bytes));
    }

    pub(super) fn send(&mut self, now: Timestamp, outgoing: Outgoing) {
        let Outgoing { message, awaited, command, tries } = outgoing;
        self.pacing.sent(now);
        self.write(message, false);
        if let Some(awaited) = awaited {
            self.outstanding.push(Outstanding { message, awaited, command, sent: now, tries });
            self.silence.asked(now);
        }
        let Some(kind) = command.and_then(|command| entry_of(&command, tries)) else { return };
        if let EventKind::Turnout { turnout, curved } = kind {
            self.solenoid = Some(Solenoid::powered(turnout, curved, now));
        }
        self.enter(now, kind);
    }
}
