//! Handles messages from JMRI.

use alloc::format;
use alloc::vec::Vec;

use footplate_core::{EventKind, SensorId, SpeedStep, Timestamp, TrainId};

use super::super::json::Malformed;
use super::super::outstanding::{Answer, Awaited};
use super::super::reply::Reply;
use super::super::request::Request;
use super::super::settings::System;
use super::super::throttle::ThrottleMessage;
use super::super::time_model::SENSOR_DELAY_SHORTEST;
use super::Client;
use crate::dcc_ex::Throttle;
use crate::outstanding::Awaited as _;
use crate::protocol::Opening;
use crate::sensors::occupied;
use crate::session::LinkNotice;

/// JMRI's code for an object that is not in its tables; of those that are asked for here, only turnouts may be missing.
const NOT_FOUND: u16 = 404;

impl Client {
    pub(super) fn hear_byte(&mut self, now: Timestamp, byte: u8) {
        let line = self.lines.push(byte).map(|text| (text.len(), Reply::read(text)));
        let unread = self.lines.take_unread();
        self.dialogue.hear_noise(unread);
        match line {
            Some((_, Ok(reply))) => {
                let was_silent = self.dialogue.hear(now);
                if let Some(reply) = reply {
                    self.take(now, reply);
                }
                if was_silent && self.opening.is_open() {
                    self.verify();
                }
                self.dialogue.end_if_confirmed();
            }
            Some((length, Err(Malformed))) => self.dialogue.hear_noise(length),
            None => {}
        }
    }

    fn take(&mut self, now: Timestamp, reply: Reply) {
        match reply {
            Reply::Hello { version, railroad } => self.identified(&version, &railroad),
            Reply::Pong => {
                let is_last = self.dialogue.outstanding.answered(&Answer::Pong).is_some();
                if is_last && matches!(&self.opening, Opening::Asking(requests) if requests.is_empty()) {
                    self.opened();
                }
            }
            Reply::Power { system, on, .. } => {
                if self.system.name.as_ref().is_none_or(|name| *name == system) {
                    self.hear_power(on);
                }
            }
            Reply::Sensor { name, active } => self.hear_of_sensor(now, &name, active),
            Reply::Turnout { name, thrown } => self.hear_of_turnout(now, &name, thrown),
            Reply::Throttle(message) => self.hear_of_throttle(&message),
            Reply::Error { code, message } => {
                if code == NOT_FOUND {
                    // No repetition makes JMRI know it.
                    self.dialogue.outstanding.take_first(|one| one.awaited.turnout().is_some());
                }
                if self.refusal.as_ref() != Some(&message) {
                    self.refusal = Some(message.clone());
                    self.dialogue.notify(LinkNotice::Refused(message));
                }
            }
            Reply::List(all) => self.take_list(now, all),
            Reply::Goodbye => {}
        }
    }

    fn identified(&mut self, version: &str, railroad: &str) {
        let identity = match railroad {
            "" => format!("JMRI {version}"),
            _ => format!("JMRI {version}, {railroad}"),
        };
        if self.identity.as_ref() != Some(&identity) {
            self.identity = Some(identity.clone());
            self.dialogue.notify(LinkNotice::Identified(identity));
        }
    }

    /// Takes a list; continues the opening if it asked for it.
    fn take_list(&mut self, now: Timestamp, all: Vec<Reply>) {
        let is_of = |is: fn(&Reply) -> bool| all.iter().all(is);
        if is_of(|one| matches!(one, Reply::Power { .. }))
            && self.dialogue.outstanding.answered(&Answer::Powers).is_some()
        {
            self.system = self.system_among(&all);
            self.opening = Opening::asking([self.power(true), Request::Sensors]);
        } else if is_of(|one| matches!(one, Reply::Sensor { .. }))
            && self.dialogue.outstanding.answered(&Answer::Sensors).is_some()
        {
            let of_layout = |one: &Reply| match one {
                Reply::Sensor { name, .. } => {
                    self.sensor_named(name).map(|_| Request::Sensor { name: name.clone() })
                }
                _ => None,
            };
            let asked: Vec<Request> = all.iter().filter_map(of_layout).collect();
            self.opening = Opening::asking(asked.into_iter().chain([Request::Ping]));
        }
        all.into_iter().for_each(|one| self.take(now, one));
    }

    /// The system with the prefix of the settings, or JMRI's default.
    fn system_among(&self, all: &[Reply]) -> System {
        let wanted = self.settings.prefix.as_ref();
        let is_wanted = |one: &&Reply| match one {
            Reply::Power { prefix, is_default, .. } => match wanted {
                Some(_) if prefix.is_some() => prefix.as_ref() == wanted,
                _ => *is_default,
            },
            _ => false,
        };
        let (name, prefix) = match all.iter().find(is_wanted) {
            Some(Reply::Power { system, prefix, .. }) => (Some(system.clone()), prefix.clone()),
            _ => (None, None),
        };
        System { name, prefix: wanted.cloned().or(prefix).unwrap_or_default() }
    }

    /// Ends the opening: trains may run.
    fn opened(&mut self) {
        self.opening = Opening::Open;
        self.dialogue.blind_since = None;
        self.dialogue.notify(LinkNotice::Answers);
    }

    fn hear_power(&mut self, on: Option<bool>) {
        self.dialogue.outstanding.answered(&Answer::Power(on));
        if let Some(on) = on {
            let is_lost = self.dialogue.is_power_lost(on, &Awaited::Power(false));
            self.dialogue.hear_power(on, is_lost);
        }
    }

    fn hear_of_throttle(&mut self, message: &ThrottleMessage) {
        let Some(train) = message.name.parse().ok().map(TrainId) else { return };
        let ThrottleMessage { throttle, forward, functions, .. } = *message;
        if message.is_released {
            self.lost_throttle(train);
            self.dialogue.outstanding.take_first(|outstanding| outstanding.awaited.train() == Some(train));
            return self.unverified.push(train);
        }
        let whole = throttle.zip(forward).filter(|_| message.address.is_some());
        let answered = whole.and_then(|(throttle, forward)| {
            let answer = Answer::Locomotive { train, throttle, forward, functions };
            self.dialogue.outstanding.answered(&answer).map(|answered| answered.awaited)
        });
        self.dialogue.hear_of_functions(train, functions, answered.as_ref());
        match whole {
            Some(driven) => self.hear_of_locomotive(train, driven, answered),
            // Another throttle changed a part of it: the whole state tells the rest.
            None if throttle.is_some() || forward.is_some() => self.ask_again(train),
            None => {}
        }
    }

    fn ask_again(&mut self, train: TrainId) {
        let is_awaited = self.dialogue.outstanding.blocks(train, false).is_some();
        let is_known = self.dialogue.locomotives.has_direction(train);
        if is_known && !is_awaited && !self.unverified.contains(&train) {
            self.unverified.push(train);
        }
    }

    /// Compares a train's state with the commanded one.
    fn hear_of_locomotive(&mut self, train: TrainId, driven: (Throttle, bool), answered: Option<Awaited>) {
        let is_outstanding = self.dialogue.outstanding.blocks(train, false).is_some();
        let step = self.dialogue.locomotives.get(train).map_or(SpeedStep::STAND, |known| known.step);
        let wanted = self.throttle(train, step);
        let Some(locomotive) = self.dialogue.locomotive(train) else { return };
        if matches!(answered, Some(Awaited::Driven(..))) {
            if !self.obeyed.contains(&train) {
                self.obeyed.push(train);
            }
            return self.dialogue.obeyed(train);
        }
        let (throttle, faces) = match driven {
            (Throttle::EmergencyStop, faces) => (Throttle::Speed(0), faces),
            driven => driven,
        };
        let Some(forward) = locomotive.forward else {
            // JMRI may have been restarted and not know: the direction is written with the next speed.
            return self.dialogue.hear_first_direction(train, faces, throttle == Throttle::Speed(0));
        };
        if is_outstanding || (throttle == wanted && faces == forward) {
            return;
        }
        if !locomotive.is_driven {
            return self.dialogue.faces(train, faces);
        }
        locomotive.is_stopped = false;
        self.dialogue.faces(train, faces);
        self.dialogue.stop_at_end(train);
        self.dialogue.notify(LinkNotice::OtherThrottle { train, reversed: faces != forward });
    }

    /// JMRI has stopped a train and given up its throttle, which must be asked for again.
    pub(super) fn lost_throttle(&mut self, train: TrainId) {
        self.obeyed.retain(|obeyed| *obeyed != train);
        self.dialogue.forget_direction(train);
        let Some(locomotive) = self.dialogue.locomotives.get_mut(train) else { return };
        locomotive.step = SpeedStep::STAND;
        if locomotive.is_driven {
            self.dialogue.stop(train);
        }
    }

    fn hear_of_turnout(&mut self, now: Timestamp, name: &str, thrown: Option<bool>) {
        let number = self.system.number_of_turnout(name);
        let Some((turnout, thrown)) = number.and_then(|number| self.settings.turnout_of(number)).zip(thrown)
        else {
            return;
        };
        let curved = thrown == self.settings.closed_is_straight;
        let is_answer = self.dialogue.outstanding.answered(&Answer::Turnout(turnout, curved)).is_some();
        let before = self.dialogue.hear_of_turnout(turnout, curved);
        let is_own = is_answer || self.dialogue.outstanding.any(|one| one.turnout() == Some(turnout));
        if !is_own && before == Some(!curved) {
            // Another throttle has thrown it.
            self.dialogue.enter(now, EventKind::Turnout { turnout, curved });
        }
    }

    fn sensor_named(&self, name: &str) -> Option<(u16, SensorId)> {
        let number = self.system.number_of_sensor(name)?;
        Some((number, self.settings.sensor_of(number)?))
    }

    fn hear_of_sensor(&mut self, now: Timestamp, name: &str, active: Option<bool>) {
        let Some(((number, sensor), active)) = self.sensor_named(name).zip(active) else { return };
        let change = self.sensors.heard(number, active, !self.opening.is_open());
        let span = occupied(
            now,
            self.dialogue.last_entry,
            [SENSOR_DELAY_SHORTEST, self.settings.sensor_delay],
            None,
        );
        self.dialogue.hear_of_change(sensor, change, span);
    }
}
