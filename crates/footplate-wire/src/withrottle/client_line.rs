//! Lines of a phone.
//!
//! Source: the WiThrottle protocol 2.0 as JMRI documents it. A line ends with LF, CR or both. Servers ignore what they do
//! not know, because phones send more than any one server offers.

use alloc::string::String;
use core::fmt;

use footplate_core::{FunctionNumber, TrainId, TurnoutId};

use super::server_line::FULL_SPEED;

/// The longest line that is read (bytes); a longer one is noise. Engine Driver sends up to about 100.
pub const LONGEST_LINE: usize = 1_024;

/// The name of a locomotive in the protocol: its address, short (`S24`) or long (`L1234`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ThrottleKey {
    /// Whether the phone calls the address a long one.
    pub is_long: bool,
    /// The train with that address.
    pub train: TrainId,
}

impl ThrottleKey {
    /// Reads `S24` or `L1234`.
    pub fn read(text: &str) -> Option<Self> {
        let is_long = match text.chars().next()? {
            'S' => false,
            'L' => true,
            _ => return None,
        };
        let train = TrainId(text.get(1..)?.parse().ok()?);
        Some(Self { is_long, train })
    }
}

impl fmt::Display for ThrottleKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", if self.is_long { 'L' } else { 'S' }, self.train.0)
    }
}

/// What a phone asks of a locomotive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Run at this part of full speed: 0 to [`FULL_SPEED`].
    Speed(u8),
    /// Emergency stop.
    EmergencyStop,
    /// Run forward, or backward.
    Direction {
        /// Forward.
        forward: bool,
    },
    /// A function key was pressed, or released.
    Function {
        /// The function.
        function: FunctionNumber,
        /// Pressed.
        pressed: bool,
    },
    /// A function must be on, or off.
    SetFunction {
        /// The function.
        function: FunctionNumber,
        /// On.
        on: bool,
    },
    /// Which speed is shown?
    QuerySpeed,
    /// Which direction is shown?
    QueryDirection,
}

/// What a phone asks of a turnout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnoutAction {
    /// To the other leg.
    Toggle,
    /// To the straight leg.
    Close,
    /// To the curved leg.
    Throw,
}

/// A line of a phone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ClientLine {
    /// The name of the phone.
    Name(String),
    /// A sign of life.
    Alive,
    /// Whether its trains shall be stopped when it is silent.
    Watch(bool),
    /// Drive a locomotive with one of its throttles.
    Acquire {
        /// The throttle, a letter or digit.
        throttle: char,
        /// The locomotive.
        key: ThrottleKey,
    },
    /// Give a locomotive back, or all of a throttle.
    Release {
        /// The throttle.
        throttle: char,
        /// The locomotive; `None` for all.
        key: Option<ThrottleKey>,
    },
    /// A locomotive, or all of a throttle, shall do something.
    Act {
        /// The throttle.
        throttle: char,
        /// The locomotive; `None` for all.
        key: Option<ThrottleKey>,
        /// What it shall do.
        action: Action,
    },
    /// Track power on or off.
    Power(bool),
    /// A turnout.
    Turnout {
        /// Its number.
        turnout: TurnoutId,
        /// What it shall do.
        action: TurnoutAction,
    },
    /// The phone leaves.
    Quit,
}

impl ClientLine {
    /// Reads a line without its end; `None` for one that means nothing to this server.
    pub fn read(line: &str) -> Option<Self> {
        let first = line.chars().next()?;
        let rest = line.get(first.len_utf8()..)?;
        match first {
            'N' => Some(Self::Name(String::from(rest))),
            '*' => match rest {
                "" => Some(Self::Alive),
                "+" => Some(Self::Watch(true)),
                "-" => Some(Self::Watch(false)),
                _ => None,
            },
            'M' => of_throttle(rest),
            'P' => of_panel(rest),
            'Q' if rest.is_empty() => Some(Self::Quit),
            _ => None,
        }
    }
}

/// `T+S24<;>…`, `T-S24<;>r`, `TAS24<;>V30`.
fn of_throttle(text: &str) -> Option<ClientLine> {
    let (head, what) = text.split_once("<;>")?;
    let mut head = head.chars();
    let (throttle, verb) = (head.next()?, head.next()?);
    let name = head.as_str();
    let key = if name == "*" { None } else { Some(ThrottleKey::read(name)?) };
    match verb {
        '+' => Some(ClientLine::Acquire { throttle, key: key? }),
        '-' => Some(ClientLine::Release { throttle, key }),
        'A' => Some(ClientLine::Act { throttle, key, action: action(what)? }),
        _ => None,
    }
}

fn action(text: &str) -> Option<Action> {
    let first = text.chars().next()?;
    let rest = text.get(first.len_utf8()..)?;
    match (first, rest) {
        // A speed below zero is an emergency stop.
        ('V', _) if rest.starts_with('-') => Some(Action::EmergencyStop),
        ('V', _) => Some(Action::Speed(rest.parse::<u8>().ok()?.min(FULL_SPEED))),
        ('X', "") => Some(Action::EmergencyStop),
        ('I', "") => Some(Action::Speed(0)),
        ('R', "0") => Some(Action::Direction { forward: false }),
        ('R', "1") => Some(Action::Direction { forward: true }),
        ('F', _) => {
            let (function, pressed) = function(rest)?;
            Some(Action::Function { function, pressed })
        }
        ('f', _) => {
            let (function, on) = function(rest)?;
            Some(Action::SetFunction { function, on })
        }
        ('q', "V") => Some(Action::QuerySpeed),
        ('q', "R") => Some(Action::QueryDirection),
        _ => None,
    }
}

/// `15`: state 1 of function 5.
fn function(text: &str) -> Option<(FunctionNumber, bool)> {
    let on = match text.chars().next()? {
        '0' => false,
        '1' => true,
        _ => return None,
    };
    Some((FunctionNumber::new(text.get(1..)?.parse().ok()?)?, on))
}

/// `PA1`, `TA2LT11`.
fn of_panel(text: &str) -> Option<ClientLine> {
    if let Some(state) = text.strip_prefix("PA") {
        return match state {
            "0" => Some(ClientLine::Power(false)),
            "1" => Some(ClientLine::Power(true)),
            _ => None,
        };
    }
    let rest = text.strip_prefix("TA")?;
    let first = rest.chars().next()?;
    let action = match first {
        '2' => TurnoutAction::Toggle,
        'C' => TurnoutAction::Close,
        'T' => TurnoutAction::Throw,
        _ => return None,
    };
    let name = rest.get(first.len_utf8()..)?;
    // Phones repeat the name from the list; one that a person types may lack the letters.
    let number = name.trim_start_matches(|letter: char| letter.is_ascii_alphabetic());
    Some(ClientLine::Turnout { turnout: TurnoutId(number.parse().ok()?), action })
}
