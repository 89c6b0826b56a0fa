//! Lines to a phone.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use footplate_core::track::Leg;
use footplate_core::{FunctionNumber, TurnoutId};

use super::client_line::ThrottleKey;

/// Full speed in the protocol's steps.
pub const FULL_SPEED: u8 = 126;

/// The codes of a turnout's states, which are JMRI's; phones learn the words for them from [`ServerLine::TurnoutWords`].
const fn code(leg: Option<Leg>) -> u8 {
    match leg {
        None => 1,
        Some(Leg::Straight) => 2,
        Some(Leg::Curved) => 4,
    }
}

/// A line to a phone; [`Display`](fmt::Display) writes it without its end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ServerLine {
    /// The version of the protocol.
    Version,
    /// All trains: their keys and names.
    Roster(Vec<(ThrottleKey, String)>),
    /// Whether the track has power; `None` if unknown.
    Power(Option<bool>),
    /// The words for turnouts and their states.
    TurnoutWords,
    /// All turnouts.
    Turnouts(Vec<(TurnoutId, Option<Leg>)>),
    /// The state of a turnout.
    Turnout(TurnoutId, Option<Leg>),
    /// Send a sign of life at least this often (s).
    Heartbeat(u16),
    /// A throttle drives a locomotive from now on.
    Acquired(char, ThrottleKey),
    /// The locomotive was given back.
    Released(char, ThrottleKey),
    /// The speed to display; `None` for an emergency stop.
    Speed(char, ThrottleKey, Option<u8>),
    /// The direction to display.
    Direction(char, ThrottleKey, bool),
    /// The state of a function.
    Function(char, ThrottleKey, FunctionNumber, bool),
    /// Speed steps of the throttle: 1 is 128.
    StepMode(char, ThrottleKey),
    /// A message that the phone shows until it is confirmed.
    Alert(String),
    /// A message that the phone shows for a moment.
    Info(String),
}

impl fmt::Display for ServerLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Version => f.write_str("VN2.0"),
            Self::Roster(trains) => {
                write!(f, "RL{}", trains.len())?;
                trains.iter().try_for_each(|(key, name)| {
                    let length = if key.is_long { 'L' } else { 'S' };
                    write!(f, "]\\[{}}}|{{{}}}|{{{length}", Text(name), key.train.0)
                })
            }
            Self::Power(power) => write!(f, "PPA{}", power.map_or(2, u8::from)),
            Self::TurnoutWords => {
                f.write_str("PTT]\\[Turnouts}|{Turnout]\\[Straight}|{2]\\[Curved}|{4]\\[Unknown}|{1")
            }
            Self::Turnouts(turnouts) => {
                f.write_str("PTL")?;
                turnouts.iter().try_for_each(|(turnout, leg)| {
                    let (number, code) = (turnout.0, code(*leg));
                    write!(f, "]\\[FT{number}}}|{{turnout {number}}}|{{{code}")
                })
            }
            Self::Turnout(turnout, leg) => write!(f, "PTA{}FT{}", code(*leg), turnout.0),
            Self::Heartbeat(seconds) => write!(f, "*{seconds}"),
            Self::Acquired(throttle, key) => write!(f, "M{throttle}+{key}<;>"),
            Self::Released(throttle, key) => write!(f, "M{throttle}-{key}<;>r"),
            Self::Speed(throttle, key, speed) => {
                write!(f, "M{throttle}A{key}<;>V{}", speed.map_or(-1, i16::from))
            }
            Self::Direction(throttle, key, forward) => {
                write!(f, "M{throttle}A{key}<;>R{}", u8::from(*forward))
            }
            Self::Function(throttle, key, function, on) => {
                write!(f, "M{throttle}A{key}<;>F{}{}", u8::from(*on), function.get())
            }
            Self::StepMode(throttle, key) => write!(f, "M{throttle}A{key}<;>s1"),
            Self::Alert(text) => write!(f, "HM{}", Text(text)),
            Self::Info(text) => write!(f, "Hm{}", Text(text)),
        }
    }
}

/// Text of people within a line: without line ends and without the signs that separate fields.
struct Text<'t>(&'t str);

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|letter| match letter {
            ']' | '[' | '}' | '{' | '|' | '\\' => f.write_str(" "),
            _ if letter.is_control() => f.write_str(" "),
            _ => write!(f, "{letter}"),
        })
    }
}
