//! What a client and the server say of a throttle.

use alloc::string::String;

use footplate_core::FunctionNumber;
use serde_json::{Value, json};

use super::json::{Malformed, Properties};
use crate::dcc_ex::Throttle;
use crate::reported_functions::ReportedFunctions;

/// The steps into which JMRI divides the share of a decoder's highest speed for decoders of 126 steps.
const HIGHEST: u8 = 126;
/// The share that stands for an emergency stop.
const EMERGENCY_STOP: f64 = -1.0;

/// What is said of a throttle; of what is left out nothing is said.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ThrottleMessage {
    /// The name that the client has given it.
    pub name: String,
    /// The locomotive's address: where a client asks for a throttle, and in whole states.
    pub address: Option<u16>,
    /// Its speed, in steps of 126.
    pub throttle: Option<Throttle>,
    /// Whether it runs forward.
    pub forward: Option<bool>,
    /// Functions that are on or off.
    pub functions: ReportedFunctions,
    /// Whether the client asks for the whole state.
    pub asks: bool,
    /// Whether the throttle is given up, or was taken away.
    pub is_released: bool,
}

impl ThrottleMessage {
    /// The same in JSON. JMRI acts on one property after the other: the question for the state is the last.
    pub(super) fn write(&self) -> Properties {
        let mut data = Properties::new();
        data.insert("name".into(), json!(self.name));
        if let Some(address) = self.address {
            data.insert("address".into(), json!(address));
        }
        if let Some(throttle) = self.throttle {
            data.insert("speed".into(), json!(share_of(throttle)));
        }
        if let Some(forward) = self.forward {
            data.insert("forward".into(), json!(forward));
        }
        for function in FunctionNumber::all() {
            if let Some(is_on) = self.functions.is_on(function) {
                data.insert(alloc::format!("{function}"), json!(is_on));
            }
        }
        if self.asks {
            data.insert("status".into(), Value::Null);
        }
        if self.is_released {
            data.insert("release".into(), Value::Null);
        }
        data
    }

    /// Reads it. Clients of versions before 5 call the name `throttle`; `idle` and `eStop` are speeds, too.
    pub(super) fn read(data: &Properties) -> Result<Self, Malformed> {
        let mut message = Self::default();
        for (key, value) in data {
            match key.as_str() {
                "name" => message.name = value.as_str().ok_or(Malformed)?.into(),
                "throttle" if !data.contains_key("name") => {
                    message.name = value.as_str().ok_or(Malformed)?.into();
                }
                "address" => {
                    let address = value.as_u64().and_then(|address| u16::try_from(address).ok());
                    message.address = Some(address.ok_or(Malformed)?);
                }
                "speed" => message.throttle = Some(throttle_of(value.as_f64().ok_or(Malformed)?)),
                "idle" => message.throttle = Some(Throttle::Speed(0)),
                "eStop" => message.throttle = Some(Throttle::EmergencyStop),
                "forward" => message.forward = Some(value.as_bool().ok_or(Malformed)?),
                "status" => message.asks = true,
                "release" => message.is_released = true,
                key => {
                    let number = key.strip_prefix('F').and_then(|number| number.parse().ok());
                    if let Some(function) = number.and_then(FunctionNumber::new) {
                        let on = if value.as_bool().ok_or(Malformed)? { function.bit() } else { 0 };
                        let newer = ReportedFunctions { known: function.bit(), on };
                        message.functions = message.functions.with(newer);
                    }
                }
            }
        }
        if message.name.is_empty() { Err(Malformed) } else { Ok(message) }
    }
}

/// The share of the highest speed that JMRI takes and states.
fn share_of(throttle: Throttle) -> f64 {
    match throttle {
        Throttle::Speed(speed) => f64::from(speed) / f64::from(HIGHEST),
        Throttle::EmergencyStop => EMERGENCY_STOP,
    }
}

/// The nearest step of a share: JMRI calculates in single precision.
fn throttle_of(share: f64) -> Throttle {
    if share < 0.0 {
        return Throttle::EmergencyStop;
    }
    // Beyond the limits of the type, the cast takes its limit.
    Throttle::Speed(((share * f64::from(HIGHEST) + 0.5) as u8).min(HIGHEST))
}
