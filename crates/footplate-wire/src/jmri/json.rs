//! Lines of JSON, and the numbers that JMRI gives to states.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;

use serde_json::{Map, Value};

/// The longest line that is read: a list of some thousands of sensors with their names and comments.
pub const LONGEST_LINE: usize = 1 << 20;

/// Cuts a stream into lines.
pub type Lines = crate::lines::Lines<LONGEST_LINE>;

/// A line that is no JSON, or a message of a known type with impossible parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Malformed;

/// The properties of an object.
pub(super) type Properties = Map<String, Value>;

/// JMRI's number for a power that is on, a sensor that is active and a turnout that is closed.
const FIRST: u64 = 2;
/// JMRI's number for the opposite. Others are unknown (0), inconsistent or idle (8).
const SECOND: u64 = 4;

/// JMRI's number of a state.
pub(super) fn number_of(is_first: bool) -> Value {
    Value::from(if is_first { FIRST } else { SECOND })
}

/// The state in a message; `None` for one that JMRI does not know.
///
/// # Errors
/// When there is no number.
pub(super) fn state_in(data: &Properties) -> Result<Option<bool>, Malformed> {
    match data.get("state").and_then(Value::as_u64).ok_or(Malformed)? {
        FIRST => Ok(Some(true)),
        SECOND => Ok(Some(false)),
        _ => Ok(None),
    }
}

/// A text in a message.
pub(super) fn text_in(data: &Properties, key: &str) -> Result<String, Malformed> {
    data.get(key).and_then(Value::as_str).map(ToOwned::to_owned).ok_or(Malformed)
}

/// The line of a message.
pub(super) fn line_of(message: &Value) -> String {
    format!("{message}\n")
}

/// The type of a message and its data, which may be left out.
pub(super) fn parts(message: &Value) -> Option<(&str, Properties)> {
    let kind = message.get("type")?.as_str()?;
    let data = message.get("data").and_then(Value::as_object).cloned().unwrap_or_default();
    Some((kind, data))
}
