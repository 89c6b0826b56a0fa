//! What the virtual Z21 does with a datagram, and what it says to whom.

use footplate_core::{DecoderSteps, TimeSpan, Timestamp, TrainId};
use footplate_wire::z21::{
    Broadcasts, CentralState, Dataset, Datasets, Feedback, Firmware, FunctionSwitch, Lock, LocomotiveState,
    Reply, Request, SystemState, Throttle, TurnoutPosition,
};

use super::{ANSWER_S, Connected, FORGOTTEN_AFTER, MOST_CLIENTS, MOST_SUBSCRIBED, Slot, VirtualZ21};
use crate::living::decoder::DecoderSpeed;

/// What it says it is: a Z21, with firmware 1.42.
const KIND: u32 = 0x0201;
const FIRMWARE: Firmware = Firmware { major: 1, minor: 0x42 };
/// A z21start.
const KIND_START: u32 = 0x0204;
const SERIAL_NUMBER: u32 = 101_953;
/// On the X-BUS.
const X_BUS_VERSION: u8 = 0x40;
const X_BUS_STATION: u8 = 0x12;

impl VirtualZ21<'_> {
    /// Does what a datagram asks for.
    pub(super) fn read(&mut self, id: usize, datagram: &[u8]) {
        if !self.knows(id) {
            return;
        }
        let most = if self.switches.first_only { 1 } else { usize::MAX };
        for dataset in Datasets::of(datagram).take(most) {
            if self.switches.strict_xor && !dataset.is_sound() {
                self.say(id, &Reply::Unknown);
                continue;
            }
            match Request::read(&dataset) {
                Some(request) => self.obey(id, request),
                None if is_x_bus(&dataset) => self.say(id, &Reply::Unknown),
                None => {}
            }
        }
    }

    /// Whether there is room for a client; those that said nothing for a minute are forgotten.
    fn knows(&mut self, id: usize) -> bool {
        let now = self.now;
        self.clients.retain(|client| now - client.heard < FORGOTTEN_AFTER);
        if let Some(client) = self.clients.iter_mut().find(|client| client.id == id) {
            client.heard = now;
            return true;
        }
        if self.clients.len() >= MOST_CLIENTS {
            return false;
        }
        let (broadcasts, subscribed) = (Broadcasts::NONE, std::collections::VecDeque::new());
        self.clients.push(Connected { id, broadcasts, subscribed, heard: now });
        true
    }

    fn client(&mut self, id: usize) -> Option<&mut Connected> {
        self.clients.iter_mut().find(|client| client.id == id)
    }

    fn obey(&mut self, id: usize, request: Request) {
        let at = self.now;
        match request {
            Request::SerialNumber => self.say(id, &Reply::SerialNumber(SERIAL_NUMBER)),
            Request::Hardware => {
                let kind = if self.switches.is_locked { KIND_START } else { KIND };
                self.say(id, &Reply::Hardware { kind, firmware: FIRMWARE });
            }
            Request::LockCode => {
                let lock = if self.switches.is_locked { Lock::Locked } else { Lock::None };
                self.say(id, &Reply::LockCode(lock));
            }
            Request::LogOff => self.clients.retain(|client| client.id != id),
            Request::SetBroadcasts(broadcasts) => {
                if !std::mem::take(&mut self.loses_next_subscription)
                    && let Some(client) = self.client(id)
                {
                    client.broadcasts = broadcasts;
                }
            }
            Request::Broadcasts => {
                let broadcasts = self.client(id).map_or(Broadcasts::NONE, |client| client.broadcasts);
                self.say(id, &Reply::Broadcasts(broadcasts));
            }
            Request::SystemState => self.say(id, &Reply::SystemState(self.system_state())),
            Request::XBusVersion => {
                self.say(id, &Reply::XBusVersion { version: X_BUS_VERSION, station: X_BUS_STATION });
            }
            Request::Status => self.say(id, &Reply::Status(self.central)),
            Request::Firmware => self.say(id, &Reply::Firmware(FIRMWARE)),
            Request::Power { on } => {
                self.power(on, at);
                self.answer_all(id, &Reply::Power { on });
            }
            Request::StopAll => {
                self.central.0 |= CentralState::STOPPED;
                for at_slot in 0..self.slots.len() {
                    self.slots[at_slot].throttle = Throttle::EmergencyStop;
                    self.command(at, self.slots[at_slot]);
                }
                self.answer_all(id, &Reply::Stopped);
            }
            Request::Locomotive { address } => {
                self.subscribe(id, address);
                let state = self.state_of(address);
                self.say(id, &Reply::Locomotive(state));
            }
            Request::Drive { .. } | Request::Function { .. } | Request::SetTurnout { .. }
                if self.switches.is_locked => {}
            Request::Drive { address, steps, throttle, forward } => {
                let slot = self.slot(address);
                let driven = &mut self.slots[slot];
                (driven.steps, driven.throttle, driven.forward) = (steps, throttle, forward);
                let slot = *driven;
                self.command(at, slot);
                self.report_locomotive(address);
            }
            Request::Function { address, function, switch } => {
                let slot = self.slot(address);
                let functions = &mut self.slots[slot].functions;
                let bit = 1_u32.checked_shl(u32::from(function)).unwrap_or(0);
                match switch {
                    FunctionSwitch::Off => *functions &= !bit,
                    FunctionSwitch::On => *functions |= bit,
                    FunctionSwitch::Toggle => *functions ^= bit,
                }
                self.report_locomotive(address);
            }
            Request::Turnout { address } => {
                self.say(id, &Reply::Turnout { address, position: self.position(address) });
            }
            Request::SetTurnout { address, second, activate, .. } => {
                self.set_turnout(id, address, second, activate);
            }
            Request::Feedback { group } => {
                if self.switches.feedback == Feedback::RBus {
                    let inputs = self.group(u16::from(group));
                    self.say(id, &inputs);
                } else {
                    self.say(id, &Reply::Feedback { group, inputs: Default::default() });
                }
            }
            Request::CanDetectors { .. } if self.switches.feedback == Feedback::Can => {
                let sensors = self.world.s88.sensors().to_vec();
                for sensor in sensors {
                    self.say(id, &Reply::Can(self.can_detection(sensor)));
                }
            }
            Request::LocoNetDetectors { .. } if self.switches.feedback == Feedback::LocoNet => {
                let sensors = self.world.s88.sensors().to_vec();
                for sensor in sensors {
                    let info = u16::from(self.occupied.contains(&sensor));
                    let detection =
                        footplate_wire::z21::LocoNetDetection { kind: 1, address: sensor.0 + 1, info };
                    self.say(id, &Reply::LocoNet(detection));
                }
            }
            Request::RailCom { address } => {
                if let Some(slot) = self.slots.iter().find(|slot| slot.address == address).copied() {
                    let rail_com = Reply::RailCom(self.rail_com(&slot));
                    self.say(id, &rail_com);
                }
            }
            Request::CanDetectors { .. } | Request::LocoNetDetectors { .. } => {}
        }
    }

    /// Powers a turnout's output or lets go of it; a decoder lets go by itself, too, and the same again changes nothing.
    fn set_turnout(&mut self, id: usize, address: u16, second: bool, activate: bool) {
        if activate {
            let position = TurnoutPosition::Output { second };
            self.turnouts.retain(|(known, _)| *known != address);
            self.turnouts.push((address, position));
            self.lay(self.now, address, second);
            self.answer_all(id, &Reply::Turnout { address, position });
        } else {
            let turnout = footplate_core::TurnoutId(address.saturating_add(1));
            self.world.points.release(turnout, self.now);
        }
    }

    pub(super) fn power(&mut self, on: bool, at: Timestamp) {
        self.central = CentralState(if on { 0 } else { CentralState::POWER_OFF });
        self.world.power(on, at);
        if on {
            // The track carries every locomotive's speed and direction again.
            for slot in self.slots.clone() {
                self.command(at, slot);
            }
        }
        self.broadcast(Broadcasts::SYSTEM_STATE, &Reply::SystemState(self.system_state()));
    }

    fn system_state(&self) -> SystemState {
        let is_on = self.central.0 & CentralState::POWER_OFF == 0;
        SystemState {
            main_ma: if is_on { 120 } else { 0 },
            filtered_ma: if is_on { 120 } else { 0 },
            temperature_c: 31,
            supply_mv: 19_600,
            track_mv: if is_on { 18_400 } else { 0 },
            central: self.central,
            // DCC, RailCom, locomotives and accessories over the network.
            capabilities: 0x79,
            ..SystemState::default()
        }
    }

    /// The place of a locomotive among those that are driven.
    fn slot(&mut self, address: u16) -> usize {
        if let Some(found) = self.slots.iter().position(|slot| slot.address == address) {
            return found;
        }
        let (steps, throttle) = (DecoderSteps::All, Throttle::Stop);
        self.slots.push(Slot { address, steps, throttle, forward: true, functions: 0, received: 0 });
        self.slots.len() - 1
    }

    /// The track carries a locomotive's speed and direction, unless all are stopped.
    fn command(&mut self, at: Timestamp, slot: Slot) {
        let is_stopped = self.central.0 & CentralState::STOPPED != 0;
        let highest = slot.steps.highest().get();
        let speed = match slot.throttle {
            Throttle::Stop => DecoderSpeed::Step { step: 0, highest },
            Throttle::Step(step) if !is_stopped => DecoderSpeed::Step { step, highest },
            Throttle::Step(_) | Throttle::EmergencyStop => DecoderSpeed::EmergencyStop,
        };
        self.world.carry(TrainId(slot.address), slot.forward, speed, at);
    }

    fn state_of(&self, address: u16) -> LocomotiveState {
        let found = self.slots.iter().find(|slot| slot.address == address);
        let (steps, throttle, forward, functions) = found
            .map_or((DecoderSteps::All, Throttle::Stop, true, 0), |slot| {
                (slot.steps, slot.throttle, slot.forward, slot.functions)
            });
        LocomotiveState { address, busy: false, steps, throttle, forward, functions }
    }

    /// Subscribes a client to a locomotive; beyond the limit, the oldest subscription ends.
    fn subscribe(&mut self, id: usize, address: u16) {
        if let Some(client) = self.client(id) {
            client.subscribed.retain(|known| *known != address);
            client.subscribed.push_back(address);
            if client.subscribed.len() > MOST_SUBSCRIBED {
                client.subscribed.pop_front();
            }
        }
    }

    fn report_locomotive(&mut self, address: u16) {
        let state = Reply::Locomotive(self.state_of(address));
        let wants = |client: &Connected| {
            client.broadcasts.has(Broadcasts::ALL_LOCOMOTIVES)
                || client.broadcasts.has(Broadcasts::STATES) && client.subscribed.contains(&address)
        };
        let ids: Vec<usize> =
            self.clients.iter().filter(|client| wants(client)).map(|client| client.id).collect();
        ids.into_iter().for_each(|id| self.say(id, &state));
    }

    /// Answers the client that caused a change, and informs those that have subscribed to states.
    fn answer_all(&mut self, id: usize, reply: &Reply) {
        let is_subscribed = self.client(id).is_some_and(|client| client.broadcasts.has(Broadcasts::STATES));
        if !is_subscribed {
            self.say(id, reply);
        }
        self.broadcast(Broadcasts::STATES, reply);
    }

    pub(super) fn broadcast(&mut self, kind: Broadcasts, reply: &Reply) {
        let now = self.now;
        self.clients.retain(|client| now - client.heard < FORGOTTEN_AFTER);
        let subscribed = self.clients.iter().filter(|client| client.broadcasts.has(kind));
        let ids: Vec<usize> = subscribed.map(|client| client.id).collect();
        ids.into_iter().for_each(|id| self.say(id, reply));
    }

    /// Sends a message in a datagram of its own.
    pub(super) fn say(&mut self, id: usize, reply: &Reply) {
        if self.dark_until.is_some() {
            return;
        }
        let mut bytes = Vec::new();
        reply.write_as(!self.switches.short_states, &mut bytes);
        let is_x_bus = Datasets::of(&bytes).next().is_some_and(|dataset| is_x_bus(&dataset));
        if let Some(xor) = bytes.last_mut().filter(|_| self.switches.wrong_xor && is_x_bus) {
            *xor ^= 0xff;
        }
        let leaves = self.now + TimeSpan::from_s(self.draws.uniform(ANSWER_S));
        self.network.send_to_client(leaves, id, &bytes);
    }
}

fn is_x_bus(dataset: &Dataset<'_>) -> bool {
    dataset.x_bus().is_some()
}
