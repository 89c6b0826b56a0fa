//! What the virtual Central Station does with a frame, and what it answers.

use footplate_core::TrainId;
use footplate_wire::marklin_can::{
    Direction, Frame, LOCOMOTIVES_FILE, MOST_DATA, Message, Uid, check_sum, step_of,
};
use miniz_oxide::deflate::compress_to_vec_zlib;

use super::{CanTransport, Slot, VirtualCentralStation};

/// The parts of a Central Station: its track processor and its screen.
const PROCESSOR: Message = Message::Participant { uid: Uid(0x4353_0001), version: (4, 6), kind: 0x0000 };
const SCREEN: Message = Message::Participant { uid: Uid(0x4353_0000), version: (4, 2), kind: 0xFFFF };
/// What is behind an adapter: a track box. Its number and hash were seen on a real one.
const TRACK_BOX: Message = Message::Participant { uid: Uid(0x4746_81D4), version: (1, 39), kind: 0x0010 };
/// How hard the list of locomotives is compressed; what is read is the same.
const COMPRESSION: u8 = 6;

impl VirtualCentralStation<'_> {
    /// Does what a frame asks for.
    pub(super) fn obey(&mut self, frame: &Frame) {
        let message = Message::of(frame);
        if frame.is_response {
            return;
        }
        match message {
            Message::Stop(_) | Message::Go(_) => {
                self.power(matches!(message, Message::Go(_)));
                self.say(message);
            }
            Message::Halt(_) => {
                for slot in self.slots.clone() {
                    self.drive(slot.uid, 0);
                }
                self.say(message);
            }
            Message::EmergencyStop(uid) => {
                let slot = self.slot(uid);
                self.slots[slot].speed = 0;
                if let Some(train) = self.train(uid) {
                    // What is turned around twice while it runs stops at once and leads with the same end.
                    (0..2).for_each(|_| self.world.reverse(train, self.now));
                }
                self.say(message);
            }
            Message::Speed { uid, speed: Some(speed) } => {
                self.drive(uid, speed);
                self.confirm(message);
            }
            Message::Speed { uid, speed: None } => {
                let slot = self.slot(uid);
                self.say(Message::Speed { uid, speed: Some(self.slots[slot].speed) });
            }
            Message::Direction { uid, direction } => self.turn(uid, direction),
            Message::Function { uid, function, value } => {
                let slot = self.slot(uid);
                let bit = 1_u32.checked_shl(u32::from(function)).unwrap_or(0);
                let functions = &mut self.slots[slot].functions;
                match value {
                    Some(0) => *functions &= !bit,
                    Some(_) => *functions |= bit,
                    None => {}
                }
                let is_on = u8::from(*functions & bit != 0);
                let state = Message::Function { uid, function, value: value.or(Some(is_on)) };
                if value.is_some() { self.confirm(state) } else { self.say(state) }
            }
            Message::Accessory { uid, position, current, .. } => {
                if current > 0 && position < 2 {
                    self.lay(uid, position == 0);
                }
                self.confirm(message);
            }
            Message::ModulePoll { modules, .. } if self.switches.answers_polls => {
                for module in 1..=modules {
                    let state = self.scanning.module(module);
                    self.say(Message::ModuleState { uid: Uid::ALL, module, inputs: state });
                }
            }
            Message::Input { device: 0, input, change: None } => {
                let change = self.scanning.input(input, self.now);
                if change.is_some() {
                    self.say(Message::Input { device: 0, input, change });
                }
            }
            Message::Ping => match self.switches.transport {
                CanTransport::Adapter => self.say(TRACK_BOX),
                CanTransport::Datagrams | CanTransport::Stream => {
                    self.say(PROCESSOR);
                    self.say(SCREEN);
                }
            },
            Message::File(LOCOMOTIVES_FILE) if self.switches.has_list => {
                self.say(message);
                self.send_list();
            }
            _ => {}
        }
    }

    /// Says that something was done, unless it is a station that does not.
    fn confirm(&mut self, message: Message) {
        if !self.switches.is_mute {
            self.say(message);
        }
    }

    fn power(&mut self, on: bool) {
        self.world.power(on, self.now);
        if on {
            // The track carries every locomotive's speed and direction again.
            for slot in self.slots.clone() {
                self.command(slot);
            }
        }
    }

    /// The index of a locomotive; a new one leads with its front end.
    fn slot(&mut self, uid: Uid) -> usize {
        if let Some(found) = self.slots.iter().position(|slot| slot.uid == uid) {
            return found;
        }
        self.slots.push(Slot { uid, speed: 0, forward: true, functions: 0 });
        self.slots.len() - 1
    }

    /// The train whose decoder hears what is said to a number.
    fn train(&self, uid: Uid) -> Option<TrainId> {
        self.world.train_ids().find(|train| self.switches.locomotives.uid(train.0) == uid)
    }

    fn drive(&mut self, uid: Uid, speed: u16) {
        let slot = self.slot(uid);
        self.slots[slot].speed = speed;
        self.command(self.slots[slot]);
    }

    /// A locomotive that is turned stops first.
    fn turn(&mut self, uid: Uid, direction: Option<Direction>) {
        let slot = self.slot(uid);
        let before = self.slots[slot].forward;
        let forward = match direction {
            Some(Direction::Forward) => true,
            Some(Direction::Backward) => false,
            Some(Direction::Toggled) => !before,
            Some(Direction::Kept) | None => before,
        };
        if forward != before {
            (self.slots[slot].forward, self.slots[slot].speed) = (forward, 0);
            self.command(self.slots[slot]);
        }
        let state = Message::Direction { uid, direction: Some(Direction::of(forward)) };
        if direction.is_some() { self.confirm(state) } else { self.say(state) }
    }

    /// The track carries a locomotive's speed and direction.
    fn command(&mut self, slot: Slot) {
        let Some(train) = self.train(slot.uid) else { return };
        self.world.face(train, slot.forward, self.now);
        let step = step_of(slot.speed, self.world.decoder(train));
        self.world.command(train, step, self.now);
    }

    /// Sends the list of the locomotives on the layout.
    fn send_list(&mut self) {
        let entry = |train: TrainId| {
            let uid = self.switches.locomotives.uid(train.0).0;
            format!("lokomotive\n .name=Train {train}\n .uid={uid:#x}\n .adresse={:#x}\n", train.0)
        };
        let entries: String = self.world.train_ids().map(entry).collect();
        let text = format!("[lokomotive]\nversion\n .minor=3\n{entries}");
        let mut stream = (text.len() as u32).to_be_bytes().to_vec();
        stream.extend(compress_to_vec_zlib(text.as_bytes(), COMPRESSION));
        self.say(Message::StreamBegins { length: stream.len() as u32, check: check_sum(&stream) });
        for bytes in stream.chunks(MOST_DATA) {
            let mut padded = [0; MOST_DATA];
            padded[..bytes.len()].copy_from_slice(bytes);
            self.say(Message::StreamGoesOn(padded));
        }
    }
}
