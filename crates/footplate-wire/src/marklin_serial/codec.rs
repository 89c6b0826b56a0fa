//! Messages to the interface, and their bytes.
//!
//! The virtual station reads requests with the same code. Numbers are decimal in Märklin's
//! instructions and so they are here.

use core::fmt::{Display, Formatter, Result as FmtResult};
use core::ops::RangeInclusive;

use footplate_core::{SpeedStep, TrainId, TurnoutId};

use crate::session::CommandError;

/// Steps 0 to 14; with [`REVERSE`] the first byte of a message to a locomotive.
const HIGHEST_STEP: u8 = 14;
/// Turns a locomotive around.
const REVERSE: u8 = 15;
/// Added to a step or to [`REVERSE`]: F0 (the headlight) is on.
const LIGHT: u8 = 16;
const SOLENOID_OFF: u8 = 32;
const TURNOUT_STRAIGHT: u8 = 33;
const TURNOUT_CURVED: u8 = 34;
/// F1 to F4 of a locomotive in the lowest four bits.
const FUNCTIONS: u8 = 64;
const LAST_FUNCTIONS: u8 = 79;
const GO: u8 = 96;
const STOP: u8 = 97;
const RESET_MODE_OFF: u8 = 128;
/// Added to the number of modules to read.
const READ_MODULES: u8 = 128;
const RESET_MODE_ON: u8 = 192;
/// Added to the number of the one module to read.
const READ_MODULE: u8 = 192;

/// The addresses of locomotives.
pub const TRAINS: RangeInclusive<u16> = 1..=80;
/// The last one is byte 0.
const TURNOUTS: RangeInclusive<u16> = 1..=256;
/// Modules that fit between the reset mode and the next code. The 6051 has one S88 bus of 31.
const MODULES: RangeInclusive<u8> = 1..=31;

/// A message to the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message {
    /// Drive a train at a throttle step from 0 to 14.
    Drive {
        /// The train, 1 to 80.
        train: TrainId,
        /// The step, 0 to 14.
        step: SpeedStep,
        /// Whether F0 is on; every message to a locomotive sets it, so `false` switches it off.
        light: bool,
    },
    /// Reverse a train. The direction cannot be read back; a moving train stops dead.
    Reverse {
        /// The train, 1 to 80.
        train: TrainId,
        /// Whether F0 is on.
        light: bool,
    },
    /// Switch the extra functions of a train; understood by the 6021 and later.
    Functions {
        /// The train, 1 to 80.
        train: TrainId,
        /// F1 to F4.
        on: [bool; 4],
    },
    /// Throw a turnout. Its solenoid stays powered until [`SolenoidOff`](Self::SolenoidOff) or the next turnout.
    Turnout {
        /// The turnout, 1 to 256.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// Switch off the solenoid that was switched on last.
    SolenoidOff,
    /// Give power to the track.
    Go,
    /// Switch the track power off.
    Stop,
    /// Whether reading a module clears its memory of closed inputs.
    ResetMode {
        /// `true` to forget.
        on: bool,
    },
    /// Read the first modules; answered with two bytes a module.
    ReadModules {
        /// How many, 1 to 31.
        count: u8,
    },
    /// Read one module; answered with two bytes.
    ReadModule {
        /// Which, 1 to 31.
        module: u8,
    },
    /// Bytes without a meaning in Märklin's instructions. They can be read, but not sent.
    Unknown {
        /// The byte that was taken for the first of a message.
        first: u8,
        /// What followed it, where two bytes were expected.
        second: Option<u8>,
    },
}

/// The bytes of one message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// A message of one byte.
    One([u8; 1]),
    /// A message of two; nothing may come between them.
    Two([u8; 2]),
}

/// Why a message cannot be sent to the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncodeError {
    /// No decoder has this address.
    Train(TrainId),
    /// Beyond the decoder's 14 steps.
    Step(SpeedStep),
    /// No turnout decoder has this address.
    Turnout(TurnoutId),
    /// No module of this number, or no such number of modules, fits on the bus.
    Module(u8),
    /// The message has no known meaning.
    Unknown,
}

impl Message {
    /// The bytes to send.
    ///
    /// # Errors
    ///
    /// When a number is beyond what the interface knows, and for [`Unknown`](Self::Unknown).
    pub fn encode(self) -> Result<Frame, EncodeError> {
        let one = |byte| Ok(Frame::One([byte]));
        let to_train = |first, train| Ok(Frame::Two([first, train_byte(train)?]));
        match self {
            Self::Drive { step, .. } if step.get() > HIGHEST_STEP => Err(EncodeError::Step(step)),
            Self::Drive { train, step, light } => to_train(step.get() + light_byte(light), train),
            Self::Reverse { train, light } => to_train(REVERSE + light_byte(light), train),
            Self::Functions { train, on: [f1, f2, f3, f4] } => {
                let bits = u8::from(f1) | u8::from(f2) << 1 | u8::from(f3) << 2 | u8::from(f4) << 3;
                to_train(FUNCTIONS | bits, train)
            }
            Self::Turnout { turnout, curved } => {
                let first = if curved { TURNOUT_CURVED } else { TURNOUT_STRAIGHT };
                Ok(Frame::Two([first, turnout_byte(turnout)?]))
            }
            Self::SolenoidOff => one(SOLENOID_OFF),
            Self::Go => one(GO),
            Self::Stop => one(STOP),
            Self::ResetMode { on: false } => one(RESET_MODE_OFF),
            Self::ResetMode { on: true } => one(RESET_MODE_ON),
            Self::ReadModules { count: module } | Self::ReadModule { module }
                if !MODULES.contains(&module) =>
            {
                Err(EncodeError::Module(module))
            }
            Self::ReadModules { count } => one(READ_MODULES + count),
            Self::ReadModule { module } => one(READ_MODULE + module),
            Self::Unknown { .. } => Err(EncodeError::Unknown),
        }
    }

    /// Reads the first message of a stream and returns what follows it, or `None` while its last byte is missing.
    pub fn decode(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (&first, rest) = bytes.split_first()?;
        if let Some(message) = Self::of_one_byte(first) {
            return Some((message, rest));
        }
        let (&second, rest) = rest.split_first()?;
        let message = Self::of_two_bytes(first, second);
        Some((message.unwrap_or(Self::Unknown { first, second: Some(second) }), rest))
    }

    /// The modules that the interface answers with, in the order of its reply; empty where it says nothing.
    #[must_use]
    pub fn modules_read(self) -> RangeInclusive<u8> {
        match self {
            Self::ReadModules { count } => 1..=count,
            Self::ReadModule { module } => module..=module,
            _ => RangeInclusive::new(1, 0),
        }
    }

    /// The message, unless the byte announces a second one.
    fn of_one_byte(byte: u8) -> Option<Self> {
        let message = match byte {
            0..=TURNOUT_CURVED if byte != SOLENOID_OFF => return None,
            FUNCTIONS..=LAST_FUNCTIONS => return None,
            SOLENOID_OFF => Self::SolenoidOff,
            GO => Self::Go,
            STOP => Self::Stop,
            RESET_MODE_OFF => Self::ResetMode { on: false },
            RESET_MODE_ON => Self::ResetMode { on: true },
            _ => match (byte.wrapping_sub(READ_MODULES), byte.wrapping_sub(READ_MODULE)) {
                (count, _) if MODULES.contains(&count) => Self::ReadModules { count },
                (_, module) if MODULES.contains(&module) => Self::ReadModule { module },
                _ => Self::Unknown { first: byte, second: None },
            },
        };
        Some(message)
    }

    /// The message, if the second byte is an address that the first can be said to.
    fn of_two_bytes(first: u8, second: u8) -> Option<Self> {
        if matches!(first, TURNOUT_STRAIGHT | TURNOUT_CURVED) {
            let number = if second == 0 { *TURNOUTS.end() } else { u16::from(second) };
            return Some(Self::Turnout { turnout: TurnoutId(number), curved: first == TURNOUT_CURVED });
        }
        let train = Some(TrainId(u16::from(second))).filter(|train| TRAINS.contains(&train.0))?;
        if first >= FUNCTIONS {
            let on = [1, 2, 4, 8].map(|bit| first & bit != 0);
            return Some(Self::Functions { train, on });
        }
        let light = first >= LIGHT;
        match first % LIGHT {
            REVERSE => Some(Self::Reverse { train, light }),
            step => Some(Self::Drive { train, step: SpeedStep::new(step)?, light }),
        }
    }
}

impl Frame {
    /// The bytes in the order in which they are sent.
    pub fn as_bytes(&self) -> &[u8] {
        match self {
            Self::One(bytes) => bytes,
            Self::Two(bytes) => bytes,
        }
    }
}

fn light_byte(light: bool) -> u8 {
    if light { LIGHT } else { 0 }
}

fn train_byte(train: TrainId) -> Result<u8, EncodeError> {
    let known = Some(train.0).filter(|number| TRAINS.contains(number));
    known.and_then(|number| u8::try_from(number).ok()).ok_or(EncodeError::Train(train))
}

fn turnout_byte(turnout: TurnoutId) -> Result<u8, EncodeError> {
    match turnout.0 {
        number if number == *TURNOUTS.end() => Ok(0),
        0 => Err(EncodeError::Turnout(turnout)),
        number => u8::try_from(number).map_err(|_| EncodeError::Turnout(turnout)),
    }
}

impl Display for Message {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        let on_or_off = |on| if on { "on" } else { "off" };
        match *self {
            Self::Drive { train, step, light } => {
                write!(f, "train {train} step {step} light {}", on_or_off(light))
            }
            Self::Reverse { train, light } => write!(f, "train {train} reverse light {}", on_or_off(light)),
            Self::Functions { train, on: [f1, f2, f3, f4] } => {
                let [f1, f2, f3, f4] = [f1, f2, f3, f4].map(on_or_off);
                write!(f, "train {train} f1 {f1} f2 {f2} f3 {f3} f4 {f4}")
            }
            Self::Turnout { turnout, curved: false } => write!(f, "turnout {turnout} straight"),
            Self::Turnout { turnout, curved: true } => write!(f, "turnout {turnout} curved"),
            Self::SolenoidOff => f.write_str("solenoid off"),
            Self::Go => f.write_str("go"),
            Self::Stop => f.write_str("stop"),
            Self::ResetMode { on } => write!(f, "reset mode {}", on_or_off(on)),
            Self::ReadModules { count } => write!(f, "read modules 1 to {count}"),
            Self::ReadModule { module } => write!(f, "read module {module}"),
            Self::Unknown { first, second: None } => write!(f, "unknown {first}"),
            Self::Unknown { first, second: Some(second) } => write!(f, "unknown {first} {second}"),
        }
    }
}

impl Display for EncodeError {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Train(train) => {
                write!(
                    f,
                    "train {train} has no address here; addresses are {} to {}",
                    TRAINS.start(),
                    TRAINS.end()
                )
            }
            Self::Step(step) => write!(f, "step {step} is beyond the decoder; steps are 0 to {HIGHEST_STEP}"),
            Self::Turnout(turnout) => {
                let (first, last) = (TURNOUTS.start(), TURNOUTS.end());
                write!(f, "turnout {turnout} has no address here; addresses are {first} to {last}")
            }
            Self::Module(module) => {
                write!(f, "{module} sensor modules; the bus has {} to {}", MODULES.start(), MODULES.end())
            }
            Self::Unknown => f.write_str("bytes of unknown meaning are not sent to a command station"),
        }
    }
}

impl core::error::Error for EncodeError {}

impl From<EncodeError> for CommandError {
    fn from(error: EncodeError) -> Self {
        match error {
            EncodeError::Train(train) => Self::Train { train, addresses: (*TRAINS.start(), *TRAINS.end()) },
            EncodeError::Step(step) => Self::Step { step, highest: HIGHEST_STEP },
            EncodeError::Turnout(turnout) => {
                Self::Turnout { turnout, addresses: (*TURNOUTS.start(), *TURNOUTS.end()) }
            }
            // No command is one of these.
            EncodeError::Module(_) | EncodeError::Unknown => Self::Unknown,
        }
    }
}
