//! What a client says to JMRI.
//!
//! The virtual JMRI reads requests with the same code.

use alloc::string::String;
use core::ops::RangeInclusive;

use serde_json::{Value, json};

use super::json::{Malformed, Properties, line_of, number_of, parts, state_in, text_in};
use super::throttle::ThrottleMessage;

/// Addresses of locomotives (NMRA S-9.2.1: 7-bit and 14-bit addresses up to 10239).
pub const LOCOMOTIVES: RangeInclusive<u16> = 1..=10_239;

/// One thing that a client says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Request {
    /// Is anybody there? JMRI closes a connection on which it hears nothing for its heartbeat and a tenth more.
    Ping,
    /// The systems that JMRI is connected to, and whether they power their tracks.
    Powers,
    /// Switch the power of a system.
    Power {
        /// The system's name; `None` for JMRI's default.
        system: Option<String>,
        /// On or off.
        on: bool,
    },
    /// All sensors and their states.
    Sensors,
    /// The state of a sensor, now and each time that it changes.
    Sensor {
        /// Its system name.
        name: String,
    },
    /// Throw a turnout; its state, now and each time that it changes.
    Turnout {
        /// Its system name.
        name: String,
        /// Whether to throw it; otherwise it is closed.
        thrown: bool,
    },
    /// Ask for a throttle, drive with it, or give it up.
    Throttle(ThrottleMessage),
}

impl Request {
    /// The line of a request, with its end.
    pub fn text(&self) -> String {
        line_of(&match self {
            Self::Ping => json!({ "type": "ping" }),
            Self::Powers => json!({ "type": "power", "method": "list" }),
            Self::Power { system, on } => {
                let mut data = Properties::new();
                data.extend(system.iter().map(|system| ("name".into(), json!(system))));
                data.insert("state".into(), number_of(*on));
                json!({ "type": "power", "method": "post", "data": data })
            }
            Self::Sensors => json!({ "type": "sensor", "method": "list" }),
            Self::Sensor { name } => json!({ "type": "sensor", "method": "get", "data": { "name": name } }),
            Self::Turnout { name, thrown } => {
                let state = number_of(!thrown);
                json!({ "type": "turnout", "method": "post", "data": { "name": name, "state": state } })
            }
            Self::Throttle(message) => json!({ "type": "throttle", "data": message.write() }),
        })
    }

    /// Reads a line; `None` for what is not used here.
    ///
    /// # Errors
    /// When it is no JSON, or of a known type with impossible parts.
    pub fn read(line: &str) -> Result<Option<Self>, Malformed> {
        let message: Value = serde_json::from_str(line).map_err(|_| Malformed)?;
        let Some((kind, data)) = parts(&message) else { return Ok(None) };
        let method = message.get("method").and_then(Value::as_str).unwrap_or("get");
        Ok(Some(match (kind, method) {
            ("ping", _) => Self::Ping,
            ("power", "list") => Self::Powers,
            ("power", "post") => match state_in(&data)? {
                Some(on) => Self::Power { system: text_in(&data, "name").ok(), on },
                None => return Ok(None),
            },
            ("sensor", "list") => Self::Sensors,
            ("sensor", "get") => Self::Sensor { name: text_in(&data, "name")? },
            ("turnout", "post") => match state_in(&data)? {
                Some(closed) => Self::Turnout { name: text_in(&data, "name")?, thrown: !closed },
                None => return Ok(None),
            },
            ("throttle", _) => Self::Throttle(ThrottleMessage::read(&data)?),
            _ => return Ok(None),
        }))
    }
}
