//! What JMRI says to a client: answers and reports.

use alloc::string::String;
use alloc::vec::Vec;

use serde_json::{Value, json};

use super::json::{Malformed, Properties, line_of, number_of, parts, state_in, text_in};
use super::throttle::ThrottleMessage;

/// JMRI's number for a state that it does not know.
const UNKNOWN: u64 = 0;

/// One message of JMRI.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// Who it is; the first message of a connection.
    Hello {
        /// Its version.
        version: String,
        /// The name that the owner has given to the railway.
        railroad: String,
    },
    /// It is there.
    Pong,
    /// It closes the connection.
    Goodbye,
    /// Whether the tracks of a system have power.
    Power {
        /// The system's name.
        system: String,
        /// How the names of its sensors and turnouts begin; versions before 4.18 leave it out.
        prefix: Option<String>,
        /// Whether it is the system that JMRI uses where none is named.
        is_default: bool,
        /// On or off; `None` if JMRI does not know.
        on: Option<bool>,
    },
    /// The state of a sensor.
    Sensor {
        /// Its system name.
        name: String,
        /// Whether it is occupied; `None` if JMRI does not know.
        active: Option<bool>,
    },
    /// The position of a turnout.
    Turnout {
        /// Its system name.
        name: String,
        /// Whether it is thrown; `None` if JMRI does not know, or it is moving.
        thrown: Option<bool>,
    },
    /// The state of a throttle, or what has changed of it.
    Throttle(ThrottleMessage),
    /// A request was refused.
    Error {
        /// The reason as a number, mostly of HTTP.
        code: u16,
        /// The reason for people.
        message: String,
    },
    /// All objects of a type, in answer to one request. It contains no lists.
    List(Vec<Self>),
}

impl Reply {
    /// The line of a message, with its end.
    pub fn text(&self) -> String {
        line_of(&self.write())
    }

    fn write(&self) -> Value {
        let state = |first: Option<bool>| first.map_or_else(|| Value::from(UNKNOWN), number_of);
        match self {
            Self::Hello { version, railroad } => {
                json!({ "type": "hello", "data": { "JMRI": version, "railroad": railroad } })
            }
            Self::Pong => json!({ "type": "pong" }),
            Self::Goodbye => json!({ "type": "goodbye" }),
            Self::Power { system, prefix, is_default, on } => {
                let mut data = Properties::new();
                data.insert("name".into(), json!(system));
                data.extend(prefix.iter().map(|prefix| ("prefix".into(), json!(prefix))));
                data.insert("default".into(), json!(is_default));
                data.insert("state".into(), state(*on));
                json!({ "type": "power", "data": data })
            }
            Self::Sensor { name, active } => {
                json!({ "type": "sensor", "data": { "name": name, "userName": null, "state": state(*active) } })
            }
            Self::Turnout { name, thrown } => {
                let state = state(thrown.map(|thrown| !thrown));
                json!({ "type": "turnout", "data": { "name": name, "userName": null, "state": state } })
            }
            Self::Throttle(message) => {
                let mut data = message.write();
                // Under its old key, too, as JMRI says it.
                data.insert("throttle".into(), json!(message.name));
                json!({ "type": "throttle", "data": data })
            }
            Self::Error { code, message } => {
                json!({ "type": "error", "data": { "code": code, "message": message } })
            }
            Self::List(all) => Value::Array(all.iter().map(Self::write).collect()),
        }
    }

    /// Reads a line; `None` for a type of message that is not used here.
    ///
    /// # Errors
    /// When it is no JSON, or of a known type with impossible parts.
    pub fn read(line: &str) -> Result<Option<Self>, Malformed> {
        match serde_json::from_str(line).map_err(|_| Malformed)? {
            Value::Array(all) => {
                let all: Result<Vec<Option<Self>>, Malformed> = all.iter().map(Self::of).collect();
                Ok(Some(Self::List(all?.into_iter().flatten().collect())))
            }
            message => Self::of(&message),
        }
    }

    fn of(message: &Value) -> Result<Option<Self>, Malformed> {
        let Some((kind, data)) = parts(message) else { return Ok(None) };
        let name = || text_in(&data, "name");
        Ok(Some(match kind {
            "hello" => Self::Hello {
                version: text_in(&data, "JMRI")?,
                railroad: text_in(&data, "railroad").unwrap_or_default(),
            },
            "pong" => Self::Pong,
            "goodbye" => Self::Goodbye,
            "power" => Self::Power {
                system: name().unwrap_or_default(),
                prefix: text_in(&data, "prefix").ok(),
                is_default: data.get("default").and_then(Value::as_bool).unwrap_or(false),
                on: state_in(&data)?,
            },
            "sensor" => Self::Sensor { name: name()?, active: state_in(&data)? },
            "turnout" => Self::Turnout { name: name()?, thrown: state_in(&data)?.map(|closed| !closed) },
            "throttle" => Self::Throttle(ThrottleMessage::read(&data)?),
            "error" => {
                let code = data.get("code").and_then(Value::as_u64).and_then(|code| u16::try_from(code).ok());
                Self::Error { code: code.ok_or(Malformed)?, message: text_in(&data, "message")? }
            }
            _ => return Ok(None),
        }))
    }
}
