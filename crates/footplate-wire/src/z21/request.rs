//! Requests to the station, and their datasets.
//!
//! The virtual station reads requests with the same code.

use alloc::vec::Vec;
use core::ops::RangeInclusive;

use footplate_core::DecoderSteps;

use super::broadcasts::Broadcasts;
use super::dataset::{Dataset, X_BUS};
use super::speed::Throttle;
use super::states::{FORWARD, address_bytes, address_of};

/// Addresses of locomotives.
pub const LOCOMOTIVES: RangeInclusive<u16> = 1..=9_999;

/// Addresses of turnouts on the line: 2048 from 0.
pub const TURNOUTS: RangeInclusive<u16> = 0..=2_047;

/// The functions that one request can switch (F0 to F31).
const HIGHEST_FUNCTION: u8 = 31;
/// The kind of a request for one state by its address.
const BY_ADDRESS: u8 = 0x01;

/// What is done to a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FunctionSwitch {
    /// It is switched off.
    Off,
    /// It is switched on.
    On,
    /// It is switched over.
    Toggle,
}

/// One thing that can be asked of the station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Its serial number.
    SerialNumber,
    /// What it is, and its firmware.
    Hardware,
    /// Whether driving over the network is locked.
    LockCode,
    /// This client will not speak any more.
    LogOff,
    /// Sets the subscription of this client.
    SetBroadcasts(Broadcasts),
    /// The subscription of this client.
    Broadcasts,
    /// Currents, voltages, temperature.
    SystemState,
    /// The version of the X-BUS and what it is there.
    XBusVersion,
    /// Its bits of state.
    Status,
    /// Its firmware, asked on the X-BUS.
    Firmware,
    /// Switch the power of the track.
    Power {
        /// On or off.
        on: bool,
    },
    /// Stop all locomotives at once; the track keeps its power.
    StopAll,
    /// The state of a locomotive. From then on the station reports its changes to the client that asked.
    Locomotive {
        /// Its address.
        address: u16,
    },
    /// Drive a locomotive.
    Drive {
        /// Its address.
        address: u16,
        /// The steps of its decoder.
        steps: DecoderSteps,
        /// Its speed.
        throttle: Throttle,
        /// Whether it runs forward; absolute.
        forward: bool,
    },
    /// Switch a function.
    Function {
        /// The locomotive's address.
        address: u16,
        /// F0 to F31.
        function: u8,
        /// What is done to it.
        switch: FunctionSwitch,
    },
    /// The position of a turnout.
    Turnout {
        /// Its address, from 0.
        address: u16,
    },
    /// Power one of a turnout's two outputs, or let go of it.
    SetTurnout {
        /// Its address, from 0.
        address: u16,
        /// Whether the second output is meant (P).
        second: bool,
        /// Whether it is powered (A).
        activate: bool,
        /// Whether the station keeps it until the one before is through (Q, from firmware 1.24).
        queue: bool,
    },
    /// The inputs of ten modules on the R-BUS.
    Feedback {
        /// 0 for modules 1 to 10, 1 for 11 to 20.
        group: u8,
    },
    /// What the detectors of the CAN bus see.
    CanDetectors {
        /// The number of one on the bus; 0xd000 for all.
        network: u16,
    },
    /// What the detectors of LocoNet see.
    LocoNetDetectors {
        /// How they are asked: 0x80 for those that speak as Digitrax's do, 0x81 for Uhlenbrock's.
        kind: u8,
        /// The address that is asked for.
        address: u16,
    },
    /// What a decoder says of itself.
    RailCom {
        /// Its address.
        address: u16,
    },
}

impl Request {
    /// All detectors of the CAN bus.
    pub const ALL_CAN: Self = Self::CanDetectors { network: 0xd000 };
    /// All detectors of LocoNet that answer an interrogation.
    pub const ALL_LOCO_NET: Self = Self::LocoNetDetectors { kind: 0x80, address: 0 };

    /// Reads a dataset; `None` for what is not known here.
    pub fn read(dataset: &Dataset<'_>) -> Option<Self> {
        Some(match (dataset.header, dataset.data) {
            (0x10, []) => Self::SerialNumber,
            (0x18, []) => Self::LockCode,
            (0x1a, []) => Self::Hardware,
            (0x30, []) => Self::LogOff,
            (0x50, [a, b, c, d]) => Self::SetBroadcasts(Broadcasts(u32::from_le_bytes([*a, *b, *c, *d]))),
            (0x51, []) => Self::Broadcasts,
            (0x81, [group]) => Self::Feedback { group: *group },
            (0x85, []) => Self::SystemState,
            (0x89, [BY_ADDRESS, low, high]) => Self::RailCom { address: u16::from_le_bytes([*low, *high]) },
            (0xa4, [kind, low, high]) => {
                Self::LocoNetDetectors { kind: *kind, address: u16::from_le_bytes([*low, *high]) }
            }
            (0xc4, [0, low, high]) => Self::CanDetectors { network: u16::from_le_bytes([*low, *high]) },
            (X_BUS, _) => Self::of_x_bus(dataset.x_bus()?)?,
            _ => return None,
        })
    }

    fn of_x_bus(message: &[u8]) -> Option<Self> {
        Some(match *message {
            [0x21, 0x21] => Self::XBusVersion,
            [0x21, 0x24] => Self::Status,
            [0x21, 0x80] => Self::Power { on: false },
            [0x21, 0x81] => Self::Power { on: true },
            [0x80] => Self::StopAll,
            [0xf1, 0x0a] => Self::Firmware,
            [0xe3, 0xf0, high, low] => Self::Locomotive { address: address_of(high, low) },
            [0xe4, 0xf8, high, low, what] => {
                let switch = match what >> 6 {
                    0 => FunctionSwitch::Off,
                    1 => FunctionSwitch::On,
                    2 => FunctionSwitch::Toggle,
                    _ => return None,
                };
                let function = Some(what & 0x3f).filter(|function| *function <= HIGHEST_FUNCTION)?;
                Self::Function { address: address_of(high, low), function, switch }
            }
            [0xe4, kind @ (0x10 | 0x12 | 0x13), high, low, speed] => {
                let steps = match kind {
                    0x10 => DecoderSteps::Fourteen,
                    0x12 => DecoderSteps::TwentyEight,
                    _ => DecoderSteps::All,
                };
                let throttle = Throttle::of_code(speed & !FORWARD, steps);
                let (address, forward) = (address_of(high, low), speed & FORWARD != 0);
                Self::Drive { address, steps, throttle, forward }
            }
            [0x43, high, low] => Self::Turnout { address: u16::from_be_bytes([high, low]) },
            [0x53, high, low, how] if how & 0x80 != 0 => Self::SetTurnout {
                address: u16::from_be_bytes([high, low]),
                second: how & 0x01 != 0,
                activate: how & 0x08 != 0,
                queue: how & 0x20 != 0,
            },
            _ => return None,
        })
    }

    /// Its bytes, behind those that are there.
    pub fn write(&self, bytes: &mut Vec<u8>) {
        match *self {
            Self::SerialNumber => Dataset::write(0x10, &[], bytes),
            Self::LockCode => Dataset::write(0x18, &[], bytes),
            Self::Hardware => Dataset::write(0x1a, &[], bytes),
            Self::LogOff => Dataset::write(0x30, &[], bytes),
            Self::SetBroadcasts(broadcasts) => Dataset::write(0x50, &broadcasts.0.to_le_bytes(), bytes),
            Self::Broadcasts => Dataset::write(0x51, &[], bytes),
            Self::Feedback { group } => Dataset::write(0x81, &[group], bytes),
            Self::SystemState => Dataset::write(0x85, &[], bytes),
            Self::RailCom { address } => write_numbered(0x89, BY_ADDRESS, address, bytes),
            Self::LocoNetDetectors { kind, address } => write_numbered(0xa4, kind, address, bytes),
            Self::CanDetectors { network } => write_numbered(0xc4, 0, network, bytes),
            Self::XBusVersion => Dataset::write_x_bus(&[0x21, 0x21], bytes),
            Self::Status => Dataset::write_x_bus(&[0x21, 0x24], bytes),
            Self::Power { on } => Dataset::write_x_bus(&[0x21, 0x80 | u8::from(on)], bytes),
            Self::StopAll => Dataset::write_x_bus(&[0x80], bytes),
            Self::Firmware => Dataset::write_x_bus(&[0xf1, 0x0a], bytes),
            Self::Locomotive { address } => {
                let [high, low] = address_bytes(address);
                Dataset::write_x_bus(&[0xe3, 0xf0, high, low], bytes);
            }
            Self::Drive { address, steps, throttle, forward } => {
                let [high, low] = address_bytes(address);
                let kind = match steps {
                    DecoderSteps::Fourteen => 0x10,
                    DecoderSteps::TwentyEight => 0x12,
                    DecoderSteps::All => 0x13,
                };
                let speed = throttle.code(steps) | if forward { FORWARD } else { 0 };
                Dataset::write_x_bus(&[0xe4, kind, high, low, speed], bytes);
            }
            Self::Function { address, function, switch } => {
                let [high, low] = address_bytes(address);
                let what = match switch {
                    FunctionSwitch::Off => 0,
                    FunctionSwitch::On => 0x40,
                    FunctionSwitch::Toggle => 0x80,
                };
                Dataset::write_x_bus(&[0xe4, 0xf8, high, low, what | function & 0x3f], bytes);
            }
            Self::Turnout { address } => {
                let [high, low] = address.to_be_bytes();
                Dataset::write_x_bus(&[0x43, high, low], bytes);
            }
            Self::SetTurnout { address, second, activate, queue } => {
                let [high, low] = address.to_be_bytes();
                let how = 0x80 | u8::from(queue) << 5 | u8::from(activate) << 3 | u8::from(second);
                Dataset::write_x_bus(&[0x53, high, low, how], bytes);
            }
        }
    }
}

/// A dataset of a kind and a number.
fn write_numbered(header: u16, kind: u8, number: u16, bytes: &mut Vec<u8>) {
    let [low, high] = number.to_le_bytes();
    Dataset::write(header, &[kind, low, high], bytes);
}
