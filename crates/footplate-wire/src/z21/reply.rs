//! What the station says, as datasets and back: answers, and what it tells by itself.

use alloc::vec::Vec;

use super::broadcasts::Broadcasts;
use super::dataset::{Dataset, X_BUS};
use super::detectors::{CanDetection, GROUP_MODULES, LocoNetDetection, RailCom};
use super::states::{CentralState, Firmware, Lock, LocomotiveState, SystemState, TurnoutPosition};

/// One message of the station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reply {
    /// Its serial number.
    SerialNumber(u32),
    /// What it is, and its firmware.
    Hardware {
        /// 0x200 black Z21 of 2012, 0x201 of 2013, 0x202 SmartRail, 0x203 white z21, 0x204 z21start, 0x211 XL.
        kind: u32,
        /// The version of its program.
        firmware: Firmware,
    },
    /// Whether driving over the network is locked.
    LockCode(Lock),
    /// The subscription of this client.
    Broadcasts(Broadcasts),
    /// Currents, voltages, temperature.
    SystemState(SystemState),
    /// The track has power, or has none.
    Power {
        /// On or off.
        on: bool,
    },
    /// Decoders are programmed.
    Programming,
    /// There is a short circuit; the track has no power.
    ShortCircuit,
    /// It does not know what was asked.
    Unknown,
    /// All locomotives are stopped; the track has power.
    Stopped,
    /// Its bits of state.
    Status(CentralState),
    /// The version of the X-BUS, and what it is there (0x12 for a Z21, 0x13 for a z21).
    XBusVersion {
        /// The version: decimal digits as hexadecimal ones.
        version: u8,
        /// What it is.
        station: u8,
    },
    /// Its firmware, asked on the X-BUS.
    Firmware(Firmware),
    /// The state of a locomotive.
    Locomotive(LocomotiveState),
    /// The position of a turnout.
    Turnout {
        /// Its address, from 0.
        address: u16,
        /// How it was commanded last.
        position: TurnoutPosition,
    },
    /// The inputs of ten modules on the R-BUS.
    Feedback {
        /// 0 for modules 1 to 10, 1 for 11 to 20.
        group: u8,
        /// A byte each, input 1 in the lowest bit.
        inputs: [u8; GROUP_MODULES],
    },
    /// A detector on LocoNet.
    LocoNet(LocoNetDetection),
    /// A detector on the CAN bus.
    Can(CanDetection),
    /// What a decoder says of itself.
    RailCom(RailCom),
}

/// A dataset of a known kind with impossible contents: it was damaged in transit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Malformed;

impl Reply {
    /// Reads a dataset; `None` for a kind that is not used here.
    ///
    /// # Errors
    ///
    /// When the kind is known and the rest makes no sense.
    pub fn read(dataset: &Dataset<'_>) -> Result<Option<Self>, Malformed> {
        let Dataset { header, data } = *dataset;
        let reply = match (header, data) {
            (0x10, [a, b, c, d]) => Some(Self::SerialNumber(u32::from_le_bytes([*a, *b, *c, *d]))),
            (0x18, [code]) => Lock::of_code(*code).map(Self::LockCode),
            (0x1a, [a, b, c, d, minor, major, _, _]) => Some(Self::Hardware {
                kind: u32::from_le_bytes([*a, *b, *c, *d]),
                firmware: Firmware { major: *major, minor: *minor },
            }),
            (0x51, [a, b, c, d]) => Some(Self::Broadcasts(Broadcasts(u32::from_le_bytes([*a, *b, *c, *d])))),
            (0x80, [group, inputs @ ..]) => {
                inputs.try_into().ok().map(|inputs| Self::Feedback { group: *group, inputs })
            }
            (0x84, data) => SystemState::read(data).map(Self::SystemState),
            (0x88, data) => rail_com(data).map(Self::RailCom),
            (0xa4, [kind, low, high, info @ ..]) => {
                let info = match *info {
                    [] => 0,
                    [low] => u16::from(low),
                    [low, high, ..] => u16::from_le_bytes([low, high]),
                };
                let address = u16::from_le_bytes([*low, *high]);
                Some(Self::LocoNet(LocoNetDetection { kind: *kind, address, info }))
            }
            (0xc4, [n0, n1, a0, a1, port, kind, v0, v1, m0, m1]) => Some(Self::Can(CanDetection {
                network: u16::from_le_bytes([*n0, *n1]),
                address: u16::from_le_bytes([*a0, *a1]),
                port: *port,
                kind: *kind,
                value: u16::from_le_bytes([*v0, *v1]),
                more: u16::from_le_bytes([*m0, *m1]),
            })),
            (X_BUS, _) => return Self::of_x_bus(dataset.x_bus().ok_or(Malformed)?),
            (0x10 | 0x18 | 0x1a | 0x51 | 0x80 | 0xa4 | 0xc4, _) => None,
            _ => return Ok(None),
        };
        reply.map(Some).ok_or(Malformed)
    }

    fn of_x_bus(message: &[u8]) -> Result<Option<Self>, Malformed> {
        let reply = match message {
            [0x61, 0x00] => Self::Power { on: false },
            [0x61, 0x01] => Self::Power { on: true },
            [0x61, 0x02] => Self::Programming,
            [0x61, 0x08] => Self::ShortCircuit,
            [0x61, 0x82] => Self::Unknown,
            [0x62, 0x22, state] => Self::Status(CentralState(*state)),
            [0x63, 0x21, version, station] => Self::XBusVersion { version: *version, station: *station },
            [0x81, 0x00] => Self::Stopped,
            [0xf3, 0x0a, major, minor] => Self::Firmware(Firmware { major: *major, minor: *minor }),
            [0xef, data @ ..] => Self::Locomotive(LocomotiveState::read(data).ok_or(Malformed)?),
            [0x43, high, low, position] => Self::Turnout {
                address: u16::from_be_bytes([*high, *low]),
                position: TurnoutPosition::of_code(*position),
            },
            [0x43 | 0x62 | 0x63 | 0x81 | 0xf3, ..] => return Err(Malformed),
            _ => return Ok(None),
        };
        Ok(Some(reply))
    }

    /// Whether trains can run, if that is what it says.
    pub const fn power(&self) -> Option<bool> {
        match self {
            Self::Power { on } => Some(*on),
            Self::ShortCircuit | Self::Stopped => Some(false),
            Self::Status(state) | Self::SystemState(SystemState { central: state, .. }) => {
                Some(state.is_powered())
            }
            _ => None,
        }
    }

    /// Whether it says that the power of the track is so. Locomotives that are stopped while the track has power are neither.
    pub const fn confirms_power(&self, on: bool) -> bool {
        match self {
            Self::Stopped => false,
            Self::Status(state) | Self::SystemState(SystemState { central: state, .. }) if !on => {
                state.is_off()
            }
            _ => matches!(self.power(), Some(reported) if reported == on),
        }
    }

    /// Its bytes, behind those that are there; a locomotive's with the functions from F29 on, as from firmware 1.42.
    pub fn write(&self, bytes: &mut Vec<u8>) {
        self.write_as(true, bytes);
    }

    /// The same; `with_f29`: whether a locomotive's message has the byte that firmware before 1.42 leaves out.
    pub fn write_as(&self, with_f29: bool, bytes: &mut Vec<u8>) {
        match self {
            Self::SerialNumber(number) => Dataset::write(0x10, &number.to_le_bytes(), bytes),
            Self::LockCode(lock) => Dataset::write(0x18, &[lock.code()], bytes),
            Self::Hardware { kind, firmware } => {
                let firmware = [firmware.minor, firmware.major, 0, 0];
                let data: Vec<u8> = kind.to_le_bytes().into_iter().chain(firmware).collect();
                Dataset::write(0x1a, &data, bytes);
            }
            Self::Broadcasts(broadcasts) => Dataset::write(0x51, &broadcasts.0.to_le_bytes(), bytes),
            Self::SystemState(state) => Dataset::write(0x84, &state.bytes().collect::<Vec<u8>>(), bytes),
            Self::Feedback { group, inputs } => {
                let data: Vec<u8> = [*group].into_iter().chain(*inputs).collect();
                Dataset::write(0x80, &data, bytes);
            }
            Self::LocoNet(LocoNetDetection { kind, address, info }) => {
                let ([low, high], [info_low, info_high]) = (address.to_le_bytes(), info.to_le_bytes());
                let info: &[u8] = if info_high == 0 { &[info_low] } else { &[info_low, info_high] };
                let data: Vec<u8> = [*kind, low, high].into_iter().chain(info.iter().copied()).collect();
                Dataset::write(0xa4, &data, bytes);
            }
            Self::Can(detection) => {
                let CanDetection { network, address, port, kind, value, more } = *detection;
                let numbers = |pair: [u16; 2]| pair.into_iter().flat_map(u16::to_le_bytes);
                let data: Vec<u8> =
                    numbers([network, address]).chain([port, kind]).chain(numbers([value, more])).collect();
                Dataset::write(0xc4, &data, bytes);
            }
            Self::RailCom(rail_com) => {
                let RailCom { address, received, errors, options, speed, quality } = *rail_com;
                let numbers = address.to_le_bytes().into_iter().chain(received.to_le_bytes());
                let rest = [0, options, speed, quality, 0];
                let data: Vec<u8> = numbers.chain(errors.to_le_bytes()).chain(rest).collect();
                Dataset::write(0x88, &data, bytes);
            }
            Self::Power { on } => Dataset::write_x_bus(&[0x61, u8::from(*on)], bytes),
            Self::Programming => Dataset::write_x_bus(&[0x61, 0x02], bytes),
            Self::ShortCircuit => Dataset::write_x_bus(&[0x61, 0x08], bytes),
            Self::Unknown => Dataset::write_x_bus(&[0x61, 0x82], bytes),
            Self::Stopped => Dataset::write_x_bus(&[0x81, 0x00], bytes),
            Self::Status(state) => Dataset::write_x_bus(&[0x62, 0x22, state.0], bytes),
            Self::XBusVersion { version, station } => {
                Dataset::write_x_bus(&[0x63, 0x21, *version, *station], bytes);
            }
            Self::Firmware(Firmware { major, minor }) => {
                Dataset::write_x_bus(&[0xf3, 0x0a, *major, *minor], bytes);
            }
            Self::Locomotive(state) => {
                let message: Vec<u8> = [0xef].into_iter().chain(state.message(with_f29)).collect();
                Dataset::write_x_bus(&message, bytes);
            }
            Self::Turnout { address, position } => {
                let [high, low] = address.to_be_bytes();
                Dataset::write_x_bus(&[0x43, high, low, position.code()], bytes);
            }
        }
    }
}

fn rail_com(data: &[u8]) -> Option<RailCom> {
    let [a0, a1, r0, r1, r2, r3, e0, e1, _, options, speed, quality, ..] = *data else { return None };
    Some(RailCom {
        address: u16::from_le_bytes([a0, a1]),
        received: u32::from_le_bytes([r0, r1, r2, r3]),
        errors: u16::from_le_bytes([e0, e1]),
        options,
        speed,
        quality,
    })
}
