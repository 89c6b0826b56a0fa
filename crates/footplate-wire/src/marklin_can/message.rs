//! Messages of the bus, and their data. Requests and responses have the same form; the frame tells which it is.

use super::frame::{Frame, MOST_DATA, Payload};
use super::uid::Uid;

/// Commands of frames.
mod command {
    pub(super) const SYSTEM: u8 = 0x00;
    pub(super) const SPEED: u8 = 0x04;
    pub(super) const DIRECTION: u8 = 0x05;
    pub(super) const FUNCTION: u8 = 0x06;
    pub(super) const ACCESSORY: u8 = 0x0B;
    pub(super) const MODULES: u8 = 0x10;
    pub(super) const INPUT: u8 = 0x11;
    pub(super) const PING: u8 = 0x18;
    pub(super) const BOOT: u8 = 0x1B;
    pub(super) const FILE: u8 = 0x20;
    pub(super) const STREAM: u8 = 0x21;
}

/// What system commands begin with after the number of the device.
mod system {
    pub(super) const STOP: u8 = 0x00;
    pub(super) const GO: u8 = 0x01;
    pub(super) const HALT: u8 = 0x02;
    pub(super) const EMERGENCY_STOP: u8 = 0x03;
    pub(super) const FORGET: u8 = 0x04;
    pub(super) const OVERLOAD: u8 = 0x0A;
}

/// What starts the program of a track box that waits in its loader.
const START: u8 = 0x11;

/// Which end of a locomotive leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// As it is.
    Kept,
    /// The front end.
    Forward,
    /// The rear end.
    Backward,
    /// The other one.
    Toggled,
}

impl Direction {
    /// Forward or backward.
    pub const fn of(forward: bool) -> Self {
        if forward { Self::Forward } else { Self::Backward }
    }

    const fn code(self) -> u8 {
        match self {
            Self::Kept => 0,
            Self::Forward => 1,
            Self::Backward => 2,
            Self::Toggled => 3,
        }
    }

    const fn of_code(code: u8) -> Option<Self> {
        Some(match code {
            0 => Self::Kept,
            1 => Self::Forward,
            2 => Self::Backward,
            3 => Self::Toggled,
            _ => return None,
        })
    }
}

/// How an input has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InputChange {
    /// Whether it was occupied.
    pub was_occupied: bool,
    /// Whether it is.
    pub is_occupied: bool,
    /// For how long it was in the state before, in units of 10 ms; 65535 is that long or longer. `None`: the station does not
    /// say it.
    pub lasted: Option<u16>,
}

/// What a frame says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message {
    /// Take the power from the track.
    Stop(Uid),
    /// Give power to the track.
    Go(Uid),
    /// Stop all locomotives; the power stays.
    Halt(Uid),
    /// Stop one locomotive at once.
    EmergencyStop(Uid),
    /// Remind a locomotive no longer of its speed.
    Forget(Uid),
    /// A booster had too much current on a channel.
    Overload {
        /// The booster.
        uid: Uid,
        /// Its channel.
        channel: u8,
    },
    /// The speed of a locomotive, 0 to 1000; `None` asks for it.
    Speed {
        /// The locomotive.
        uid: Uid,
        /// Its speed.
        speed: Option<u16>,
    },
    /// The direction of a locomotive; `None` asks for it.
    Direction {
        /// The locomotive.
        uid: Uid,
        /// The end.
        direction: Option<Direction>,
    },
    /// A function of a locomotive; `None` asks for it.
    Function {
        /// The locomotive.
        uid: Uid,
        /// Its number, from 0.
        function: u8,
        /// 0 is off.
        value: Option<u8>,
    },
    /// An output of an accessory decoder.
    Accessory {
        /// The accessory.
        uid: Uid,
        /// 0 is round or red, 1 straight or green.
        position: u8,
        /// Whether current flows.
        current: u8,
        /// For how long, in units of 10 ms; `None`: as the station has it.
        time: Option<u16>,
    },
    /// How many modules are to be read.
    ModulePoll {
        /// The device that they are behind.
        uid: Uid,
        /// From the first to this one.
        modules: u8,
    },
    /// The inputs of a module.
    ModuleState {
        /// The device that it is behind.
        uid: Uid,
        /// From 1.
        module: u8,
        /// Input 1 in the lowest bit.
        inputs: u16,
    },
    /// An input: what has become of it; `None` asks.
    Input {
        /// The device that it is behind.
        device: u16,
        /// Its number there, from 1.
        input: u16,
        /// What has become of it.
        change: Option<InputChange>,
    },
    /// Who is there?
    Ping,
    /// I am.
    Participant {
        /// Its number.
        uid: Uid,
        /// Its version, before and after the point.
        version: (u8, u8),
        /// What kind of device it is.
        kind: u16,
    },
    /// Start a track box that waits in its loader.
    Start(Uid),
    /// A request for a file of the station: its name, padded with zeros.
    File([u8; MOST_DATA]),
    /// A file comes: its length and check sum.
    StreamBegins {
        /// Bytes without the padding of the last frame.
        length: u32,
        /// The check sum of all frames.
        check: u16,
    },
    /// Eight more bytes of it.
    StreamGoesOn([u8; MOST_DATA]),
    /// Something else, or something that was changed in transit.
    Unknown {
        /// The command of the frame.
        command: u8,
        /// Its data.
        data: Payload,
    },
}

impl Message {
    /// What a frame says.
    pub fn of(frame: &Frame) -> Self {
        let unknown = Self::Unknown { command: frame.command, data: frame.data };
        Self::known(frame.command, frame.data.as_slice()).unwrap_or(unknown)
    }

    fn known(command: u8, data: &[u8]) -> Option<Self> {
        match (command, data) {
            (command::PING, []) => return Some(Self::Ping),
            (command::FILE, data) => return data.try_into().ok().map(Self::File),
            (command::STREAM, [a, b, c, d, high, low] | [a, b, c, d, high, low, _]) => {
                let (length, check) =
                    (u32::from_be_bytes([*a, *b, *c, *d]), u16::from_be_bytes([*high, *low]));
                return Some(Self::StreamBegins { length, check });
            }
            (command::STREAM, data) => return data.try_into().ok().map(Self::StreamGoesOn),
            _ => {}
        }
        let (first, rest) = data.split_first_chunk::<4>()?;
        let uid = Uid(u32::from_be_bytes(*first));
        let word = |high: &u8, low: &u8| u16::from_be_bytes([*high, *low]);
        let flag = |byte: &u8| (*byte < 2).then_some(*byte == 1);
        Some(match (command, rest) {
            (command::SYSTEM, [system::STOP]) => Self::Stop(uid),
            (command::SYSTEM, [system::GO]) => Self::Go(uid),
            (command::SYSTEM, [system::HALT]) => Self::Halt(uid),
            (command::SYSTEM, [system::EMERGENCY_STOP]) => Self::EmergencyStop(uid),
            (command::SYSTEM, [system::FORGET]) => Self::Forget(uid),
            (command::SYSTEM, [system::OVERLOAD, channel]) => Self::Overload { uid, channel: *channel },
            (command::SPEED, []) => Self::Speed { uid, speed: None },
            (command::SPEED, [high, low]) => Self::Speed { uid, speed: Some(word(high, low)) },
            (command::DIRECTION, []) => Self::Direction { uid, direction: None },
            (command::DIRECTION, [code]) => {
                Self::Direction { uid, direction: Some(Direction::of_code(*code)?) }
            }
            (command::FUNCTION, [function]) => Self::Function { uid, function: *function, value: None },
            (command::FUNCTION, [function, value]) => {
                Self::Function { uid, function: *function, value: Some(*value) }
            }
            (command::ACCESSORY, [position, current]) => {
                Self::Accessory { uid, position: *position, current: *current, time: None }
            }
            (command::ACCESSORY, [position, current, high, low]) => {
                Self::Accessory { uid, position: *position, current: *current, time: Some(word(high, low)) }
            }
            (command::MODULES, [modules]) => Self::ModulePoll { uid, modules: *modules },
            (command::MODULES, [module, high, low]) => {
                Self::ModuleState { uid, module: *module, inputs: word(high, low) }
            }
            (command::INPUT, rest) => {
                let [d0, d1, c0, c1] = first;
                let lasted = match rest {
                    [] => {
                        return Some(Self::Input { device: word(d0, d1), input: word(c0, c1), change: None });
                    }
                    [_, _] => None,
                    [_, _, high, low] => Some(word(high, low)),
                    _ => return None,
                };
                let (was_occupied, is_occupied) = (flag(rest.first()?)?, flag(rest.get(1)?)?);
                let change = Some(InputChange { was_occupied, is_occupied, lasted });
                Self::Input { device: word(d0, d1), input: word(c0, c1), change }
            }
            (command::PING, [major, minor, high, low]) => {
                Self::Participant { uid, version: (*major, *minor), kind: word(high, low) }
            }
            (command::BOOT, [START]) => Self::Start(uid),
            _ => return None,
        })
    }

    /// The frame that says it.
    #[must_use]
    pub fn frame(self, is_response: bool, hash: u16) -> Frame {
        let (command, data) = self.parts();
        Frame { priority: 0, command, is_response, hash, data }
    }

    fn parts(self) -> (u8, Payload) {
        let with = |uid: Uid, rest: &[u8]| {
            let mut data = alloc::vec::Vec::with_capacity(MOST_DATA);
            data.extend(uid.0.to_be_bytes());
            data.extend(rest);
            Payload::of(&data).unwrap_or_default()
        };
        match self {
            Self::Stop(uid) => (command::SYSTEM, with(uid, &[system::STOP])),
            Self::Go(uid) => (command::SYSTEM, with(uid, &[system::GO])),
            Self::Halt(uid) => (command::SYSTEM, with(uid, &[system::HALT])),
            Self::EmergencyStop(uid) => (command::SYSTEM, with(uid, &[system::EMERGENCY_STOP])),
            Self::Forget(uid) => (command::SYSTEM, with(uid, &[system::FORGET])),
            Self::Overload { uid, channel } => (command::SYSTEM, with(uid, &[system::OVERLOAD, channel])),
            Self::Speed { uid, speed } => {
                (command::SPEED, with(uid, speed.map(u16::to_be_bytes).as_ref().map_or(&[], |bytes| bytes)))
            }
            Self::Direction { uid, direction } => {
                let code = direction.map(Direction::code);
                (command::DIRECTION, with(uid, code.as_slice()))
            }
            Self::Function { uid, function, value: None } => (command::FUNCTION, with(uid, &[function])),
            Self::Function { uid, function, value: Some(value) } => {
                (command::FUNCTION, with(uid, &[function, value]))
            }
            Self::Accessory { uid, position, current, time: None } => {
                (command::ACCESSORY, with(uid, &[position, current]))
            }
            Self::Accessory { uid, position, current, time: Some(time) } => {
                let [high, low] = time.to_be_bytes();
                (command::ACCESSORY, with(uid, &[position, current, high, low]))
            }
            Self::ModulePoll { uid, modules } => (command::MODULES, with(uid, &[modules])),
            Self::ModuleState { uid, module, inputs } => {
                let [high, low] = inputs.to_be_bytes();
                (command::MODULES, with(uid, &[module, high, low]))
            }
            Self::Input { device, input, change } => {
                let place = Uid(u32::from(device) << 16 | u32::from(input));
                let data = match change {
                    None => with(place, &[]),
                    Some(InputChange { was_occupied, is_occupied, lasted }) => {
                        let (old, new) = (u8::from(was_occupied), u8::from(is_occupied));
                        match lasted.map(u16::to_be_bytes) {
                            None => with(place, &[old, new]),
                            Some([high, low]) => with(place, &[old, new, high, low]),
                        }
                    }
                };
                (command::INPUT, data)
            }
            Self::Ping => (command::PING, Payload::default()),
            Self::Participant { uid, version: (major, minor), kind } => {
                let [high, low] = kind.to_be_bytes();
                (command::PING, with(uid, &[major, minor, high, low]))
            }
            Self::Start(uid) => (command::BOOT, with(uid, &[START])),
            Self::File(name) => (command::FILE, Payload::of(&name).unwrap_or_default()),
            Self::StreamBegins { length, check } => {
                let [high, low] = check.to_be_bytes();
                (command::STREAM, with(Uid(length), &[high, low]))
            }
            Self::StreamGoesOn(bytes) => (command::STREAM, Payload::of(&bytes).unwrap_or_default()),
            Self::Unknown { command, data } => (command, data),
        }
    }
}

/// A kind of device in words, as stations were seen to name themselves.
pub const fn kind_in_words(kind: u16) -> &'static str {
    match kind {
        0x0000 => "a track processor",
        0x0010 | 0x0011 => "a track box (Gleisbox)",
        0x0020 => "a Connect 6021",
        0x0030..=0x0033 => "a Mobile Station 2",
        0x0040 => "a Link S88",
        0xFFE0 => "a wireless device",
        0xFFFF => "a Central Station",
        _ => "a device of another kind",
    }
}
