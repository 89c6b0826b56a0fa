//! Messages from the board, and their texts: answers and reports.

use alloc::borrow::ToOwned;
use alloc::string::String;
use core::fmt::{Display, Formatter, Result as FmtResult};

use super::request::{Throttle, Words, decoder_output, flag_of, linear_address};

/// Added to the speed code in `<l …>` when a locomotive runs forward.
const FORWARD: u8 = 0x80;

/// One message of the board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// `<iDCC-EX V-5.6.0 / MEGA / …>`: who it is. After a reset it comes unasked.
    Identity(String),
    /// `<p1>`, `<p0 A>`, `<p1 MAIN>`: whether tracks have power.
    Power {
        /// On or off.
        on: bool,
        /// Which track; empty for all of them.
        track: String,
    },
    /// `<l cab register speed functions>`: how a locomotive is driven now.
    Locomotive {
        /// Its address.
        cab: u16,
        /// Its place among the board's; -1 if the board does not drive it.
        register: i16,
        /// Its speed.
        throttle: Throttle,
        /// Whether it runs forward.
        forward: bool,
        /// Functions that are on, F0 in the lowest bit.
        functions: u32,
    },
    /// `<T register speed direction>`, which follows the `<l …>` of a request in the old form.
    Register {
        /// The number that was sent.
        register: u8,
        /// Its speed.
        throttle: Throttle,
        /// Whether it runs forward.
        forward: bool,
    },
    /// `<H id 0|1>`: a defined turnout lies so.
    Turnout {
        /// Its number on the board.
        id: u16,
        /// `true` for the diverging leg.
        thrown: bool,
    },
    /// `<H id DCC decoder output 0|1>`, or `<H id SERVO … 0|1>` and others: how a turnout is defined, and how it lies.
    Definition {
        /// Its number on the board.
        id: u16,
        /// The linear address of its accessory decoder; `None` for another kind.
        address: Option<u16>,
        /// `true` for the diverging leg.
        thrown: bool,
    },
    /// `<Q id>` or `<q id>`: a sensor is occupied, or free again.
    Sensor {
        /// Its number on the board.
        id: u16,
        /// Whether it is occupied.
        active: bool,
    },
    /// `<Q id pin pull-up>`: a sensor is defined so.
    SensorDefined {
        /// Its number on the board.
        id: u16,
        /// The pin it is wired to.
        pin: u16,
        /// Whether its pull-up resistor is used.
        pull_up: bool,
    },
    /// `<# 50>`: how many locomotives it can drive.
    Slots(u16),
    /// `<- cab>`: it no longer drives this one.
    Forgotten {
        /// Its address.
        cab: u16,
    },
    /// `<O>`: done.
    Done,
    /// `<X>`: not understood, or not possible.
    Failed,
}

/// Names of the tracks on which trains run: all of them, by their use, and the first output of a motor shield.
const MAIN_TRACKS: [&str; 3] = ["", "MAIN", "A"];

/// A message of a known kind with impossible parameters: it was damaged in transit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Malformed;

impl Reply {
    /// Reads the text between the brackets; `None` for a kind of message that is not used here.
    ///
    /// # Errors
    ///
    /// When the kind is known and the rest makes no sense.
    pub fn read(text: &str) -> Result<Option<Self>, Malformed> {
        let Some((opcode, rest)) = text.split_at_checked(1) else { return Ok(None) };
        let mut words = Words(rest.split_ascii_whitespace());
        let reply = match opcode {
            "i" => Some(Self::Identity(rest.to_owned())),
            "p" => Self::power(rest),
            "l" => Self::locomotive(&mut words),
            "T" => Self::register(&mut words),
            // A decoder's output, once more in the form of DCC++.
            "H" if words.0.clone().nth(1).is_some_and(is_number) && words.0.clone().nth(2).is_some() => {
                return Ok(None);
            }
            "H" => Self::turnout(&mut words),
            "Q" | "q" => Self::sensor(&mut words, opcode == "Q"),
            "#" => words.number().map(Self::Slots),
            "-" => words.number().map(|cab| Self::Forgotten { cab }),
            "O" => Some(Self::Done),
            "X" => return Ok(Some(Self::Failed)),
            _ => return Ok(None),
        };
        let is_whole = matches!(opcode, "i" | "p") || words.rest_is_empty();
        reply.filter(|_| is_whole).map(Some).ok_or(Malformed)
    }

    /// Whether the tracks on which trains run have power, if that is what it says.
    pub fn main_power(&self) -> Option<bool> {
        match self {
            Self::Power { on, track } if MAIN_TRACKS.contains(&track.as_str()) => Some(*on),
            _ => None,
        }
    }

    fn power(rest: &str) -> Option<Self> {
        let (bit, track) = rest.split_at_checked(1)?;
        let on = match bit {
            "0" => false,
            "1" => true,
            _ => return None,
        };
        Some(Self::Power { on, track: track.trim().to_owned() })
    }

    fn locomotive(words: &mut Words<'_>) -> Option<Self> {
        let (cab, register, code): (u16, i16, u8) = (words.number()?, words.number()?, words.number()?);
        let throttle = Throttle::of_code(code & !FORWARD);
        Some(Self::Locomotive {
            cab,
            register,
            throttle,
            forward: code & FORWARD != 0,
            functions: words.number()?,
        })
    }

    fn register(words: &mut Words<'_>) -> Option<Self> {
        let (register, speed) = (words.number()?, words.number::<i16>()?);
        let throttle = match speed {
            -1 => Throttle::EmergencyStop,
            speed => Throttle::Speed(u8::try_from(speed).ok()?),
        };
        Some(Self::Register { register, throttle, forward: words.flag()? })
    }

    fn turnout(words: &mut Words<'_>) -> Option<Self> {
        let id = words.number()?;
        let kind = words.word()?;
        if words.rest_is_empty() {
            return Some(Self::Turnout { id, thrown: flag_of(kind.parse().ok()?)? });
        }
        if kind == "DCC" {
            let address = linear_address(words.number()?, words.number()?);
            return Some(Self::Definition { id, address, thrown: words.flag()? });
        }
        let last = words.0.by_ref().last()?;
        Some(Self::Definition { id, address: None, thrown: flag_of(last.parse().ok()?)? })
    }

    fn sensor(words: &mut Words<'_>, active: bool) -> Option<Self> {
        let id = words.number()?;
        if words.rest_is_empty() {
            return Some(Self::Sensor { id, active });
        }
        Some(Self::SensorDefined { id, pin: words.number()?, pull_up: words.flag()? }).filter(|_| active)
    }
}

fn is_number(word: &str) -> bool {
    word.bytes().all(|byte| byte.is_ascii_digit())
}

/// The text that is written, with its brackets.
impl Display for Reply {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        let bit = |is: bool| u8::from(is);
        match self {
            Self::Identity(text) => write!(f, "<i{text}>"),
            Self::Power { on, track } if track.is_empty() => write!(f, "<p{}>", bit(*on)),
            Self::Power { on, track } => write!(f, "<p{} {track}>", bit(*on)),
            Self::Locomotive { cab, register, throttle, forward, functions } => {
                let code = throttle.code() | if *forward { FORWARD } else { 0 };
                write!(f, "<l {cab} {register} {code} {functions}>")
            }
            Self::Register { register, throttle, forward } => {
                write!(f, "<T {register} {throttle} {}>", bit(*forward))
            }
            Self::Turnout { id, thrown } => write!(f, "<H {id} {}>", bit(*thrown)),
            Self::Definition { id, address: Some(address), thrown } => {
                let (decoder, output) = decoder_output(*address);
                write!(f, "<H {id} DCC {decoder} {output} {}>", bit(*thrown))
            }
            Self::Definition { id, address: None, thrown } => write!(f, "<H {id} LCN {}>", bit(*thrown)),
            Self::Sensor { id, active } => write!(f, "<{} {id}>", if *active { 'Q' } else { 'q' }),
            Self::SensorDefined { id, pin, pull_up } => write!(f, "<Q {id} {pin} {}>", bit(*pull_up)),
            Self::Slots(count) => write!(f, "<# {count}>"),
            Self::Forgotten { cab } => write!(f, "<- {cab}>"),
            Self::Done => f.write_str("<O>"),
            Self::Failed => f.write_str("<X>"),
        }
    }
}
