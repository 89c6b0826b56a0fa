//! Sends requests and commands as frames, and handles missing answers.

use footplate_core::{SpeedStep, TimeSpan, Timestamp, TrainId};

use super::super::frame::Frame;
use super::super::message::{Direction, Message};
use super::super::outstanding::{Awaited, REPEATED_AFTER};
use super::super::roster::LOCOMOTIVES_FILE;
use super::super::session::Question;
use super::super::settings::Transport;
use super::super::uid::Uid;
use super::{Client, Query};
use crate::outstanding::{Outgoing, Outstanding};
use crate::protocol::Protocol as _;

impl Client {
    pub(super) fn asking(&mut self, now: Timestamp, question: Question) -> Outgoing<Awaited> {
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
            Question::Power => self.wanted_power(),
            Question::Roster => Outgoing::asks(
                Message::File(LOCOMOTIVES_FILE),
                Awaited::Roster { has_begun: self.roster.has_begun() },
            ),
        }
    }

    pub(super) fn querying(&self, train: TrainId, query: Query) -> Outgoing<Awaited> {
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

    /// Returns the number of a train on the bus, from the station's list or its address.
    pub(super) fn uid(&self, train: TrainId) -> Uid {
        self.roster.uid(train).unwrap_or_else(|| self.settings.locomotives.uid(train.0))
    }

    /// Handles a request that the station does not answer; returns a request to send instead.
    pub(super) fn instead_of(&mut self, given_up: &Outstanding<Awaited>) -> Option<Outgoing<Awaited>> {
        let asked_for = REPEATED_AFTER.as_ns() * i64::from(given_up.tries.saturating_sub(1));
        let asked = given_up.sent - TimeSpan::from_ns(asked_for);
        match given_up.awaited {
            Awaited::Modules => self.has_modules = false,
            // A station that has answered nothing at all since it was asked is asked again. From one that answers other questions
            // the direction cannot be read: it is commanded, so that it is known.
            Awaited::AnyDirection(train, uid) if self.dialogue.heard >= asked => {
                self.dialogue.locomotives.know(train);
                if !self.dialogue.locomotives.has_direction(train) {
                    let forward = self.dialogue.locomotives.last_direction(train).unwrap_or(true);
                    self.dialogue.faces(train, forward);
                    let message = Message::Direction { uid, direction: Some(Direction::of(forward)) };
                    return Some(Outgoing::asks(message, Awaited::Direction(train, uid, forward)));
                }
            }
            _ => {}
        }
        None
    }

    /// Notes the commanded step of a train, reversed or not; returns whether it then runs forward.
    pub(super) fn commanded(&mut self, train: TrainId, step: SpeedStep, reverses: bool) -> bool {
        self.suspected.retain(|other| *other != train);
        self.dialogue.commanded(train, step, reverses)
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
        self.dialogue.write(bytes);
    }
}
