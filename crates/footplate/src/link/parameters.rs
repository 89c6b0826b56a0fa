//! What follows the `?` of an address: keys with values.

use std::str::FromStr;

/// The fastest clock, in times real time (chosen: beyond it a simulated day takes less than a tenth of a second).
const FASTEST: f64 = 1e6;

/// The key and the value of `key=value`.
pub(super) fn pair(text: &str) -> Result<(&str, &str), String> {
    text.split_once('=').ok_or_else(|| format!("`{text}` has no value; write {text}=…"))
}

/// A value that is a number; `example` is a right one.
pub(super) fn number<N: FromStr>(key: &str, value: &str, example: &str) -> Result<N, String> {
    value.parse().map_err(|_| format!("`{value}` is no {key}; write {key}={example}"))
}

/// How many times faster than real time a clock runs.
pub(super) fn times(value: &str) -> Result<f64, String> {
    let times: f64 = number("speed", value, "20")?;
    let runs = times > 0.0 && times <= FASTEST;
    runs.then_some(times).ok_or_else(|| {
        format!("speed {value} is not between 0 and {FASTEST}; write speed=20 for twenty times real time")
    })
}

/// How many S88 modules are on a bus.
pub(super) fn modules(value: &str) -> Result<u8, String> {
    let modules: u8 = number("modules", value, "5")?;
    let is_possible = (1..=31).contains(&modules);
    is_possible.then_some(modules).ok_or_else(|| format!("{modules} sensor modules; the bus has 1 to 31"))
}
