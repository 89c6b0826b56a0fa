//! What the station says of itself, of a locomotive and of a turnout.

use core::fmt::{Display, Formatter, Result as FmtResult};

use footplate_core::DecoderSteps;

use super::speed::{Throttle, code_of, steps_of};

/// Added to the speed byte when a locomotive runs forward.
pub(super) const FORWARD: u8 = 0x80;
/// The functions that a message with three, four or five bytes of them tells.
const FUNCTION_BYTES: [u8; 5] = [0, 5, 13, 21, 29];

/// The version of the station's program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Firmware {
    /// Before the point, as the station counts: decimal digits as hexadecimal ones.
    pub major: u8,
    /// Behind the point, the same.
    pub minor: u8,
}

impl Display for Firmware {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        write!(f, "{:x}.{:02x}", self.major, self.minor)
    }
}

/// Whether trains may be driven over the network: a z21start needs a code for that.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lock {
    /// It is a station that knows no lock.
    None,
    /// It is locked: driving and turnouts over the network are ignored.
    Locked,
    /// It was unlocked.
    Unlocked,
}

impl Lock {
    pub(super) const fn code(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Locked => 1,
            Self::Unlocked => 2,
        }
    }

    pub(super) const fn of_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::None),
            1 => Some(Self::Locked),
            2 => Some(Self::Unlocked),
            _ => None,
        }
    }
}

/// The station's bits of state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CentralState(pub u8);

impl CentralState {
    /// All locomotives are stopped, the track has power.
    pub const STOPPED: u8 = 0x01;
    /// The track has no power.
    pub const POWER_OFF: u8 = 0x02;
    /// There is a short circuit.
    pub const SHORT_CIRCUIT: u8 = 0x04;
    /// Whether the track has no power. A stop of all locomotives leaves it on.
    #[must_use]
    pub const fn is_off(self) -> bool {
        self.0 & (Self::POWER_OFF | Self::SHORT_CIRCUIT) != 0
    }

    /// Whether trains can run.
    #[must_use]
    pub const fn is_powered(self) -> bool {
        self.0 & (Self::STOPPED | Self::POWER_OFF | Self::SHORT_CIRCUIT) == 0
    }
}

/// Currents, voltages and temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SystemState {
    /// The current of the main track (mA).
    pub main_ma: i16,
    /// The current of the programming track (mA).
    pub programming_ma: i16,
    /// The current of the main track, smoothed (mA).
    pub filtered_ma: i16,
    /// The temperature in the station (°C).
    pub temperature_c: i16,
    /// The voltage of its supply (mV).
    pub supply_mv: u16,
    /// The voltage of the track (mV).
    pub track_mv: u16,
    /// Its bits of state.
    pub central: CentralState,
    /// More bits: too hot, too little voltage, short circuits outside or inside.
    pub central_more: u8,
    /// What it can do (from firmware 1.42).
    pub capabilities: u8,
}

impl SystemState {
    pub(super) fn read(data: &[u8]) -> Option<Self> {
        let [m0, m1, p0, p1, f0, f1, t0, t1, s0, s1, v0, v1, central, more, _, capabilities] = *data else {
            return None;
        };
        Some(Self {
            main_ma: i16::from_le_bytes([m0, m1]),
            programming_ma: i16::from_le_bytes([p0, p1]),
            filtered_ma: i16::from_le_bytes([f0, f1]),
            temperature_c: i16::from_le_bytes([t0, t1]),
            supply_mv: u16::from_le_bytes([s0, s1]),
            track_mv: u16::from_le_bytes([v0, v1]),
            central: CentralState(central),
            central_more: more,
            capabilities,
        })
    }

    pub(super) fn bytes(&self) -> impl Iterator<Item = u8> {
        let currents = [self.main_ma, self.programming_ma, self.filtered_ma, self.temperature_c];
        let voltages = [self.supply_mv, self.track_mv];
        let states = [self.central.0, self.central_more, 0, self.capabilities];
        let signed = currents.into_iter().flat_map(i16::to_le_bytes);
        signed.chain(voltages.into_iter().flat_map(u16::to_le_bytes)).chain(states)
    }
}

/// The state of a locomotive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LocomotiveState {
    /// Its address.
    pub address: u16,
    /// Whether another hand-set on the X-BUS drives it.
    pub busy: bool,
    /// The steps of its decoder.
    pub steps: DecoderSteps,
    /// Its speed.
    pub throttle: Throttle,
    /// Whether it runs forward.
    pub forward: bool,
    /// Functions that are on, F0 in the lowest bit.
    pub functions: u32,
}

impl LocomotiveState {
    /// Reads what follows the X-header; longer messages of later firmware are read as far as they are known.
    pub(super) fn read(data: &[u8]) -> Option<Self> {
        let [high, low, kind, speed, functions @ ..] = data else { return None };
        let steps = steps_of(kind & 0x07)?;
        let mut on = 0;
        for (at, (byte, first)) in functions.iter().zip(FUNCTION_BYTES).enumerate() {
            // 0 D S L F4 F3 F2 F1: lights are F0.
            let bits = if at == 0 { (byte & 0x0f) << 1 | byte >> 4 & 1 } else { *byte };
            on |= u32::from(bits) << first;
        }
        Some(Self {
            address: address_of(*high, *low),
            busy: kind & 0x08 != 0,
            steps,
            throttle: Throttle::of_code(speed & !FORWARD, steps),
            forward: speed & FORWARD != 0,
            functions: on,
        })
    }

    /// The X-BUS message; `with_f29`: as from firmware 1.42 on, with the functions from F29.
    pub(super) fn message(&self, with_f29: bool) -> impl Iterator<Item = u8> {
        let [high, low] = address_bytes(self.address);
        let speed = self.throttle.code(self.steps) | if self.forward { FORWARD } else { 0 };
        let [first, second, third, fourth] = self.functions.to_le_bytes();
        let group = first >> 1 & 0x0f | (first & 1) << 4;
        // From F5 on eight each: F5 to F12, F13 to F20, F21 to F28, F29 to F31.
        let [after_4, after_12, after_20, after_28] =
            [first >> 5 | second << 3, second >> 5 | third << 3, third >> 5 | fourth << 3, fourth >> 5];
        let kind = code_of(self.steps) | if self.busy { 0x08 } else { 0 };
        let last = with_f29.then_some(after_28);
        [high, low, kind, speed, group, after_4, after_12, after_20].into_iter().chain(last)
    }
}

/// Addresses from 128 on have both upper bits set on the line.
pub(super) const fn address_of(high: u8, low: u8) -> u16 {
    u16::from_be_bytes([high & 0x3f, low])
}

/// The two bytes of an address.
pub(super) const fn address_bytes(address: u16) -> [u8; 2] {
    let [high, low] = address.to_be_bytes();
    if address >= 128 { [high | 0xc0, low] } else { [high, low] }
}

/// The position of a turnout, as the station commanded it last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnoutPosition {
    /// It was never commanded.
    Unknown,
    /// By its first output (P = 0) or its second (P = 1).
    Output {
        /// Whether it is the second.
        second: bool,
    },
    /// Both at once.
    Invalid,
}

impl TurnoutPosition {
    pub(super) const fn code(self) -> u8 {
        match self {
            Self::Unknown => 0,
            Self::Output { second: false } => 1,
            Self::Output { second: true } => 2,
            Self::Invalid => 3,
        }
    }

    pub(super) const fn of_code(code: u8) -> Self {
        match code & 0x03 {
            0 => Self::Unknown,
            1 => Self::Output { second: false },
            2 => Self::Output { second: true },
            _ => Self::Invalid,
        }
    }
}
