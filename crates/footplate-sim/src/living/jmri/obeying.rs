//! What the virtual JMRI does with a request, and what it answers.

use footplate_core::track::Leg;
use footplate_core::{SensorId, TrainId, TurnoutId};
use footplate_wire::ReportedFunctions;
use footplate_wire::dcc_ex::Throttle;
use footplate_wire::jmri::{Reply, Request, ThrottleMessage};

use super::{Locomotive, Order, VirtualJmri};
use crate::living::decoder::DecoderSpeed;

/// The steps of a decoder.
const HIGHEST: u8 = 126;
/// JMRI's code for a throttle that it did not get.
const NO_THROTTLE: u16 = 512;

impl VirtualJmri<'_> {
    pub(super) fn obey(&mut self, request: Request) {
        match request {
            Request::Ping => self.answer(Reply::Pong),
            Request::Powers => {
                let power = self.power_as_known();
                self.answer(Reply::List(vec![power]));
            }
            Request::Power { on, .. } => {
                // The answer comes before the hardware has switched it.
                let Reply::Power { system, prefix, is_default, .. } = self.power_as_known() else { return };
                self.answer(Reply::Power { system, prefix, is_default, on: None });
                self.order(Order::Power(on));
            }
            Request::Sensors => {
                let all = self.sensors.keys().map(|sensor| self.state_of(*sensor)).collect();
                self.answer(Reply::List(all));
            }
            Request::Sensor { name } => {
                let number = self.system.number_of_sensor(&name).and_then(|number| number.checked_sub(1));
                match number.map(SensorId).filter(|sensor| self.sensors.contains_key(sensor)) {
                    Some(sensor) => {
                        self.listened.insert(sensor);
                        let reply = self.state_of(sensor);
                        self.answer(reply);
                    }
                    None => self.refuse(404, &format!("Object type sensor named \"{name}\" not found.")),
                }
            }
            Request::Turnout { name, thrown } => {
                let layout = self.world.layout();
                let is_known = |turnout: &TurnoutId| layout.turnouts().any(|(known, _)| known == *turnout);
                match self.system.number_of_turnout(&name).map(TurnoutId).filter(is_known) {
                    Some(turnout) => {
                        self.answer(Reply::Turnout { name, thrown: Some(thrown) });
                        self.order(Order::Turnout(turnout, thrown));
                    }
                    None => self.refuse(404, &format!("Object type turnout named \"{name}\" not found.")),
                }
            }
            Request::Throttle(message) => self.obey_throttle(message),
        }
    }

    fn obey_throttle(&mut self, message: ThrottleMessage) {
        let named = |known: &Locomotive| known.name.as_ref() == Some(&message.name);
        let (at, is_new) = match (self.locomotives.iter().position(named), message.address) {
            (Some(at), _) => (at, false),
            (None, Some(address)) => match self.throttle_for(TrainId(address)) {
                Some(at) => (at, true),
                None => return self.refuse(NO_THROTTLE, &format!("Unable to get throttle for {address}.")),
            },
            (None, None) => return self.refuse(400, "Throttles must be requested with an address."),
        };
        if is_new {
            self.locomotives[at].name = Some(message.name.clone());
            self.answer_whole(at);
        }
        let before = self.locomotives[at].clone();
        let known = &mut self.locomotives[at];
        known.throttle = message.throttle.unwrap_or(known.throttle);
        known.forward = message.forward.unwrap_or(known.forward);
        known.functions = known.functions & !message.functions.known | message.functions.on;
        let changed = ThrottleMessage {
            name: message.name.clone(),
            throttle: message.throttle.filter(|throttle| *throttle != before.throttle),
            forward: message.forward.filter(|forward| *forward != before.forward),
            ..ThrottleMessage::default()
        };
        if changed.throttle.is_some() || changed.forward.is_some() {
            self.answer(Reply::Throttle(changed));
            self.order(Order::Drive(before.train));
        }
        if message.is_released {
            self.locomotives[at].name = None;
            let released =
                ThrottleMessage { name: message.name, is_released: true, ..ThrottleMessage::default() };
            self.answer(Reply::Throttle(released));
        } else if message.asks {
            self.answer_whole(at);
        }
    }

    /// The place of a locomotive in JMRI's memory; `None` if its hardware drives no more.
    fn throttle_for(&mut self, train: TrainId) -> Option<usize> {
        let used =
            self.locomotives.iter().filter(|known| known.name.is_some() && known.train != train).count();
        if used >= self.switches.throttles {
            return None;
        }
        if let Some(at) = self.locomotives.iter().position(|known| known.train == train) {
            return Some(at);
        }
        let (name, throttle, forward, functions) = (None, Throttle::Speed(0), true, 0);
        self.locomotives.push(Locomotive { train, name, throttle, forward, functions });
        Some(self.locomotives.len() - 1)
    }

    fn answer_whole(&mut self, at: usize) {
        let Locomotive { train, name, throttle, forward, functions } = self.locomotives[at].clone();
        let Some(name) = name else { return };
        self.answer(Reply::Throttle(ThrottleMessage {
            name,
            address: Some(train.0),
            throttle: Some(throttle),
            forward: Some(forward),
            functions: ReportedFunctions::all(functions),
            ..ThrottleMessage::default()
        }));
    }

    pub(super) fn state_of(&self, sensor: SensorId) -> Reply {
        let name = self.system.sensor(sensor.0.saturating_add(1));
        Reply::Sensor { name, active: self.sensors.get(&sensor).copied() }
    }

    fn power_as_known(&self) -> Reply {
        Reply::Power {
            system: self.system.name.clone().unwrap_or_default(),
            prefix: self.switches.has_prefix.then(|| self.system.prefix.clone()),
            is_default: true,
            on: self.switches.knows_power.then(|| self.world.is_powered()),
        }
    }

    /// An order has come through the hardware.
    pub(super) fn carry_out(&mut self, order: Order) {
        match order {
            Order::Drive(train) => self.carry(train),
            Order::Turnout(turnout, thrown) => {
                // The decoder of a turnout powers its coil for long enough and lets go by itself.
                if self.world.is_powered() {
                    self.world.points.power(turnout, Leg::from_curved(thrown), self.now);
                }
            }
            Order::Power(on) => {
                self.world.power(on, self.now);
                if on {
                    // The track carries every locomotive's speed and direction again.
                    let trains: Vec<TrainId> = self.locomotives.iter().map(|known| known.train).collect();
                    trains.into_iter().for_each(|train| self.carry(train));
                }
                if self.switches.knows_power {
                    let power = self.power_as_known();
                    self.say(&power);
                }
            }
        }
    }

    /// The track carries the speed and direction of a locomotive.
    fn carry(&mut self, train: TrainId) {
        let Some(known) = self.locomotives.iter().find(|known| known.train == train) else { return };
        let speed = match known.throttle {
            Throttle::Speed(step) => DecoderSpeed::Step { step, highest: HIGHEST },
            Throttle::EmergencyStop => DecoderSpeed::EmergencyStop,
        };
        self.world.carry(train, known.forward, speed, self.now);
    }
}
