//! Requests to the board, and their texts.
//!
//! The virtual board reads requests with the same code.

use core::fmt::{Display, Formatter, Result as FmtResult};
use core::ops::RangeInclusive;
use core::str::{FromStr, SplitAsciiWhitespace};

use footplate_core::{DecoderSteps, SpeedStep};

/// Addresses of locomotives (NMRA S-9.2.1: 7-bit and 14-bit addresses up to 10239).
pub const CABS: RangeInclusive<u16> = 1..=10_239;

/// The highest of the board's speeds.
const HIGHEST_SPEED: u8 = 126;

/// The outputs of an accessory decoder.
const OUTPUTS: u16 = 4;

/// The functions that a board knows of a locomotive (F0 to F68).
const FUNCTIONS: RangeInclusive<u8> = 0..=68;

/// How fast a locomotive is commanded to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Throttle {
    /// A speed from 0 to 126; at 0 it stops by its decoder's own rule.
    Speed(u8),
    /// It stops at once.
    EmergencyStop,
}

/// Which tracks are meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Power {
    /// All tracks.
    All,
    /// The tracks on which trains run.
    Main,
    /// The programming track.
    Programming,
}

/// One thing that can be asked of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// `<s>`: who it is and which tracks have power.
    Status,
    /// `<#>`: how many locomotives it can drive. Always answered, so that it serves as a sign of life.
    Slots,
    /// `<1>`, `<0>`, `<1 MAIN>`, …: switch the power.
    Power {
        /// On or off.
        on: bool,
        /// Of which tracks.
        tracks: Power,
    },
    /// `<t cab speed direction>`: drive a locomotive.
    Drive {
        /// Its address.
        cab: u16,
        /// Its speed.
        throttle: Throttle,
        /// Whether it runs forward; absolute.
        forward: bool,
    },
    /// `<t register cab speed direction>`, the form of DCC++ that some programs still write.
    DriveByRegister {
        /// Any number; it comes back in the answer.
        register: u8,
        /// Its address.
        cab: u16,
        /// Its speed.
        throttle: Throttle,
        /// Whether it runs forward.
        forward: bool,
    },
    /// `<t cab>`: how a locomotive is driven.
    Locomotive {
        /// Its address.
        cab: u16,
    },
    /// `<F cab function 0|1>`: switch a function.
    Function {
        /// Its address.
        cab: u16,
        /// F0 to F68.
        function: u8,
        /// On or off.
        on: bool,
    },
    /// `<!>`: stop all locomotives at once.
    StopAll,
    /// `<- cab>`, or `<->` for all: no longer drive it.
    Forget {
        /// Its address; `None` for all.
        cab: Option<u16>,
    },
    /// `<T id 0|1>`: throw a turnout that is defined on the board.
    Turnout {
        /// Its number on the board.
        id: u16,
        /// `true` for the diverging leg.
        thrown: bool,
    },
    /// `<T>`: the defined turnouts and how they lie.
    Turnouts,
    /// `<T id X>`: how a turnout is defined, and how it lies.
    Examine {
        /// Its number on the board.
        id: u16,
    },
    /// `<T id DCC address>`: define a turnout, or change its address. It counts as thrown until it has been closed.
    Define {
        /// Its number on the board.
        id: u16,
        /// The linear address of its accessory decoder.
        address: u16,
    },
    /// `<T id>`: no longer define it.
    Undefine {
        /// Its number on the board.
        id: u16,
    },
    /// `<a address 0|1>`: switch an accessory decoder, by its linear address.
    Accessory {
        /// The linear address, from 1.
        address: u16,
        /// `true` for the diverging leg.
        on: bool,
    },
    /// `<Q>`: the state of every sensor.
    SensorStates,
    /// `<S>`: which sensors are defined.
    Sensors,
}

/// The board's speed for a step of a decoder: all steps are equally far apart, and the highest is the highest. `None` beyond the
/// highest step.
pub fn speed_of(step: SpeedStep, decoder: DecoderSteps) -> Option<u8> {
    decoder.scaled(step, HIGHEST_SPEED)
}

impl Request {
    /// Reads the text between the brackets; `None` for what the board would answer with `<X>`.
    pub fn read(text: &str) -> Option<Self> {
        let (opcode, rest) = text.split_at_checked(1)?;
        let mut words = Words(rest.split_ascii_whitespace());
        let request = match opcode {
            "s" => Self::Status,
            "#" => Self::Slots,
            "0" | "1" => Self::Power { on: opcode == "1", tracks: words.tracks()? },
            "t" => Self::throttle(&mut words)?,
            "F" => Self::Function { cab: words.cab()?, function: words.function()?, on: words.flag()? },
            "!" => Self::StopAll,
            "-" => {
                Self::Forget { cab: words.rest_is_empty().then_some(None).or_else(|| words.cab().map(Some))? }
            }
            "T" if words.rest_is_empty() => Self::Turnouts,
            "T" => Self::turnout(&mut words)?,
            "a" => Self::accessory(&mut words)?,
            "Q" => Self::SensorStates,
            "S" => Self::Sensors,
            _ => return None,
        };
        words.rest_is_empty().then_some(request)
    }

    fn throttle(words: &mut Words<'_>) -> Option<Self> {
        let first = words.number()?;
        if words.rest_is_empty() {
            return Some(Self::Locomotive { cab: known_cab(first)? });
        }
        let second: i16 = words.number()?;
        let third: i16 = words.number()?;
        if words.rest_is_empty() {
            let (cab, throttle) = (known_cab(first)?, Throttle::of_number(second)?);
            return Some(Self::Drive { cab, throttle, forward: third == 1 });
        }
        let (register, cab) = (u8::try_from(first).ok()?, known_cab(u16::try_from(second).ok()?)?);
        let (throttle, forward) = (Throttle::of_number(third)?, words.flag()?);
        Some(Self::DriveByRegister { register, cab, throttle, forward })
    }

    fn turnout(words: &mut Words<'_>) -> Option<Self> {
        let id = words.number()?;
        Some(match words.word() {
            None => Self::Undefine { id },
            Some("X") => Self::Examine { id },
            Some("DCC") => {
                let first = words.number()?;
                let linear = |second| linear_address(first, second);
                let address =
                    if words.rest_is_empty() { Some(first) } else { words.number().and_then(linear) };
                Self::Define { id, address: address? }
            }
            Some(word) => Self::Turnout { id, thrown: position_of(word)? },
        })
    }

    /// `<a linear 0|1>` or `<a decoder output 0|1>`.
    fn accessory(words: &mut Words<'_>) -> Option<Self> {
        let (first, second): (u16, u16) = (words.number()?, words.number()?);
        if words.rest_is_empty() {
            return Some(Self::Accessory { address: first, on: flag_of(second)? });
        }
        Some(Self::Accessory { address: linear_address(first, second)?, on: words.flag()? })
    }
}

impl Throttle {
    /// As in `<t …>`: -1 for an emergency stop.
    fn of_number(number: i16) -> Option<Self> {
        match number {
            -1 => Some(Self::EmergencyStop),
            _ => u8::try_from(number).ok().filter(|speed| *speed <= HIGHEST_SPEED).map(Self::Speed),
        }
    }

    /// The lower seven bits of the speed byte in `<l …>`: 0 stop, 1 emergency stop, 2 to 127 speeds 1 to 126.
    pub(super) const fn code(self) -> u8 {
        match self {
            Self::EmergencyStop => 1,
            Self::Speed(0) => 0,
            Self::Speed(speed) => speed.saturating_add(1),
        }
    }

    /// The throttle of such a code.
    pub(super) const fn of_code(code: u8) -> Self {
        match code {
            1 => Self::EmergencyStop,
            0 => Self::Speed(0),
            code => Self::Speed(code - 1),
        }
    }
}

/// The parameters of a message.
pub(super) struct Words<'t>(pub(super) SplitAsciiWhitespace<'t>);

impl<'t> Words<'t> {
    pub(super) fn word(&mut self) -> Option<&'t str> {
        self.0.next()
    }

    pub(super) fn number<N: FromStr>(&mut self) -> Option<N> {
        self.word()?.parse().ok()
    }

    pub(super) fn flag(&mut self) -> Option<bool> {
        flag_of(self.number()?)
    }

    pub(super) fn rest_is_empty(&self) -> bool {
        self.0.clone().next().is_none()
    }

    fn cab(&mut self) -> Option<u16> {
        known_cab(self.number()?)
    }

    fn function(&mut self) -> Option<u8> {
        self.number().filter(|function| FUNCTIONS.contains(function))
    }

    fn tracks(&mut self) -> Option<Power> {
        match self.word() {
            None => Some(Power::All),
            Some("MAIN") => Some(Power::Main),
            Some("PROG") => Some(Power::Programming),
            Some(_) => None,
        }
    }
}

fn known_cab(number: u16) -> Option<u16> {
    CABS.contains(&number).then_some(number)
}

/// The linear address of a decoder's output: four outputs a decoder, counted from decoder 1 and output 0.
pub(super) fn linear_address(decoder: u16, output: u16) -> Option<u16> {
    decoder.checked_sub(1)?.checked_mul(OUTPUTS)?.checked_add(output)?.checked_add(1)
}

/// The decoder and output of a linear address.
pub(super) const fn decoder_output(address: u16) -> (u16, u16) {
    let from_zero = address.saturating_sub(1);
    (from_zero / OUTPUTS + 1, from_zero % OUTPUTS)
}

fn position_of(word: &str) -> Option<bool> {
    match word {
        "1" | "T" => Some(true),
        "0" | "C" => Some(false),
        _ => None,
    }
}

pub(super) const fn flag_of(number: u16) -> Option<bool> {
    match number {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

impl Display for Throttle {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Speed(speed) => speed.fmt(f),
            Self::EmergencyStop => f.write_str("-1"),
        }
    }
}

/// The text that is written, with its brackets.
impl Display for Request {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        let bit = |is: bool| u8::from(is);
        match *self {
            Self::Status => f.write_str("<s>"),
            Self::Slots => f.write_str("<#>"),
            Self::Power { on, tracks } => {
                let tracks = match tracks {
                    Power::All => "",
                    Power::Main => " MAIN",
                    Power::Programming => " PROG",
                };
                write!(f, "<{}{tracks}>", bit(on))
            }
            Self::Drive { cab, throttle, forward } => write!(f, "<t {cab} {throttle} {}>", bit(forward)),
            Self::DriveByRegister { register, cab, throttle, forward } => {
                write!(f, "<t {register} {cab} {throttle} {}>", bit(forward))
            }
            Self::Locomotive { cab } => write!(f, "<t {cab}>"),
            Self::Function { cab, function, on } => write!(f, "<F {cab} {function} {}>", bit(on)),
            Self::StopAll => f.write_str("<!>"),
            Self::Forget { cab: Some(cab) } => write!(f, "<- {cab}>"),
            Self::Forget { cab: None } => f.write_str("<->"),
            Self::Turnout { id, thrown } => write!(f, "<T {id} {}>", bit(thrown)),
            Self::Turnouts => f.write_str("<T>"),
            Self::Examine { id } => write!(f, "<T {id} X>"),
            Self::Define { id, address } => write!(f, "<T {id} DCC {address}>"),
            Self::Undefine { id } => write!(f, "<T {id}>"),
            Self::Accessory { address, on } => write!(f, "<a {address} {}>", bit(on)),
            Self::SensorStates => f.write_str("<Q>"),
            Self::Sensors => f.write_str("<S>"),
        }
    }
}
