//! What the virtual board does with a request, and what it answers.

use footplate_core::track::Leg;
use footplate_core::{SensorId, Timestamp, TrainId, TurnoutId};
use footplate_wire::dcc_ex::{Power, Reply, Request, Throttle};

use super::{Defined, IDENTITY, Slot, VirtualBoard, line};
use crate::living::decoder::DecoderSpeed;

/// Locomotives that it can drive: as many as a Mega.
const SLOTS: usize = 50;
/// The steps of a decoder.
const HIGHEST: u8 = 126;

impl VirtualBoard<'_> {
    /// Does what a request asks for; returns the answer.
    pub(super) fn obey(&mut self, at: Timestamp, request: Request) -> String {
        match request {
            Request::Status => {
                let power = ["A", "MAIN"].map(|track| self.power_of(track));
                line(&Reply::Identity(IDENTITY.into())) + &power.concat()
            }
            Request::Slots => line(&Reply::Slots(SLOTS as u16)),
            Request::Power { tracks: Power::Programming, on } => {
                line(&Reply::Power { on, track: "PROG".into() })
            }
            Request::Power { on, tracks } => {
                self.power(on, at);
                let whole = if tracks == Power::Main { "MAIN" } else { "" };
                self.power_of("A")
                    + &line(&Reply::Power { on: false, track: "B".into() })
                    + &self.power_of(whole)
            }
            Request::Drive { cab, throttle, forward } => self.drive(at, cab, throttle, forward),
            Request::DriveByRegister { register, cab, throttle, forward } => {
                self.drive(at, cab, throttle, forward)
                    + &line(&Reply::Register { register, throttle, forward })
            }
            Request::Locomotive { cab } => self.state_of(cab),
            Request::Function { cab, function, on } => {
                let Some(slot) = self.slot(cab) else { return line(&Reply::Failed) };
                let bit = 1_u32.checked_shl(u32::from(function)).unwrap_or(0);
                let functions = &mut self.slots[slot].functions;
                *functions = if on { *functions | bit } else { *functions & !bit };
                self.state_of(cab)
            }
            Request::StopAll => {
                let cabs: Vec<(u16, bool)> = self.slots.iter().map(|slot| (slot.cab, slot.forward)).collect();
                cabs.iter()
                    .map(|(cab, forward)| self.drive(at, *cab, Throttle::EmergencyStop, *forward))
                    .collect()
            }
            Request::Forget { cab } => {
                let forgotten = |slot: &Slot| cab.is_none_or(|cab| cab == slot.cab);
                let cabs: Vec<u16> =
                    self.slots.iter().filter(|slot| forgotten(slot)).map(|slot| slot.cab).collect();
                self.slots.retain(|slot| !cabs.contains(&slot.cab));
                cabs.iter().map(|cab| line(&Reply::Forgotten { cab: *cab })).collect()
            }
            Request::Turnout { id, thrown } => self.throw(at, id, thrown),
            Request::Turnouts if self.turnouts.is_empty() => line(&Reply::Failed),
            Request::Turnouts => {
                let of = |defined: &Defined| Reply::Turnout { id: defined.id, thrown: defined.thrown };
                self.turnouts.iter().map(|turnout| line(&of(turnout))).collect()
            }
            Request::Examine { .. } | Request::Define { .. } if !self.switches.defines => {
                line(&Reply::Failed)
            }
            Request::Examine { id } => self.show(id),
            Request::Define { id, address } => self.define(id, TurnoutId(address)),
            Request::Undefine { id } => {
                let before = self.turnouts.len();
                self.turnouts.retain(|defined| defined.id != id);
                line(if self.turnouts.len() < before { &Reply::Done } else { &Reply::Failed })
            }
            Request::Accessory { address, on } => {
                self.lay(at, TurnoutId(address), on);
                String::new()
            }
            Request::SensorStates => {
                let state = |sensor: &SensorId| {
                    let active = self.world.s88.is_occupied(*sensor).unwrap_or(false);
                    line(&Reply::Sensor { id: sensor.0, active })
                };
                self.world.s88.sensors().iter().map(state).collect()
            }
            Request::Sensors => {
                let defined =
                    |sensor: &SensorId| Reply::SensorDefined { id: sensor.0, pin: sensor.0, pull_up: true };
                self.world.s88.sensors().iter().map(|sensor| line(&defined(sensor))).collect()
            }
        }
    }

    fn power_of(&self, track: &str) -> String {
        line(&Reply::Power { on: self.world.is_powered(), track: track.into() })
    }

    fn power(&mut self, on: bool, at: Timestamp) {
        self.world.power(on, at);
        if on {
            // The track carries every locomotive's speed and direction again.
            for slot in self.slots.clone() {
                self.command(at, slot);
            }
        }
    }

    /// The place of a locomotive among those that are driven; `None` when there is no room for another.
    fn slot(&mut self, cab: u16) -> Option<usize> {
        if let Some(found) = self.slots.iter().position(|slot| slot.cab == cab) {
            return Some(found);
        }
        if self.slots.len() >= SLOTS {
            return None;
        }
        self.slots.push(Slot { cab, throttle: Throttle::Speed(0), forward: true, functions: 0 });
        Some(self.slots.len() - 1)
    }

    fn drive(&mut self, at: Timestamp, cab: u16, throttle: Throttle, forward: bool) -> String {
        let Some(slot) = self.slot(cab) else { return line(&Reply::Failed) };
        self.slots[slot].throttle = throttle;
        self.slots[slot].forward = forward;
        self.command(at, self.slots[slot]);
        self.state_of(cab)
    }

    /// The track carries a locomotive's speed and direction.
    fn command(&mut self, at: Timestamp, slot: Slot) {
        let speed = match slot.throttle {
            Throttle::Speed(step) => DecoderSpeed::Step { step, highest: HIGHEST },
            Throttle::EmergencyStop => DecoderSpeed::EmergencyStop,
        };
        self.world.carry(TrainId(slot.cab), slot.forward, speed, at);
    }

    fn state_of(&self, cab: u16) -> String {
        let found = self.slots.iter().position(|slot| slot.cab == cab);
        let (register, slot) = match found {
            Some(at) => (at as i16, self.slots[at]),
            None => (-1, Slot { cab, throttle: Throttle::Speed(0), forward: true, functions: 0 }),
        };
        let Slot { throttle, forward, functions, .. } = slot;
        line(&Reply::Locomotive { cab, register, throttle, forward, functions })
    }

    fn show(&self, id: u16) -> String {
        let found = self.turnouts.iter().find(|defined| defined.id == id);
        let Some(Defined { turnout, thrown, .. }) = found else { return line(&Reply::Failed) };
        let shown = line(&Reply::Definition { id, address: Some(turnout.0), thrown: *thrown });
        // A second time in the form of DCC++.
        shown.clone() + &shown.replace(" DCC", "")
    }

    /// A definition that is there already keeps its position; a new one counts as thrown.
    fn define(&mut self, id: u16, turnout: TurnoutId) -> String {
        match self.turnouts.iter_mut().find(|defined| defined.id == id) {
            Some(defined) => defined.turnout = turnout,
            None => self.turnouts.push(Defined { id, turnout, thrown: true, is_stored: false }),
        }
        line(&Reply::Done)
    }

    fn throw(&mut self, at: Timestamp, id: u16, thrown: bool) -> String {
        let known = self.turnouts.iter_mut().find(|known| known.id == id);
        let Some(defined) = known else { return line(&Reply::Failed) };
        let changes = std::mem::replace(&mut defined.thrown, thrown) != thrown;
        let turnout = defined.turnout;
        self.lay(at, turnout, thrown);
        if changes || self.switches.answers_unchanged {
            line(&Reply::Turnout { id, thrown })
        } else {
            String::new()
        }
    }

    /// The decoder of a turnout powers its coil for long enough and lets go by itself.
    fn lay(&mut self, at: Timestamp, turnout: TurnoutId, curved: bool) {
        if self.world.is_powered() {
            self.world.points.power(turnout, Leg::from_curved(curved), at);
        }
    }
}
