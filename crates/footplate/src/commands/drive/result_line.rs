//! One line of JSON for an order that has ended.

use footplate_core::Length;
use footplate_core::control::Promise;
use footplate_core::track::Layout;
use serde_json::{Value, json};

use super::spoken::{Ended, Target};

/// A tenth of a millimetre is more than anybody knows.
fn mm(length: Length) -> Value {
    json!((length.as_mm() * 10.0).round() / 10.0)
}

/// The line; `truth` is how far beyond its target the train really came to rest, where that is known.
pub(super) fn result_line(layout: &Layout, ended: &Ended, truth: Option<Length>) -> Value {
    let target = match ended.target {
        Target::Place(place) => json!(layout.display(place).to_string()),
        Target::Ahead(distance) => json!(format!("{}mm", (distance.as_mm() * 1e6).round() / 1e6)),
        Target::None => Value::Null,
    };
    let promised = |of: fn(Promise) -> Length| ended.promise.map(|promise| mm(of(promise)));
    let mut line = json!({
        "command": ended.command,
        "train": ended.train.map(|train| train.0),
        "target": target,
        "achieved": ended.achieved,
        "error_mm": ended.error.map(mm),
        "promised_low_mm": promised(|promise| promise.low),
        "promised_high_mm": promised(|promise| promise.high),
        "t_s": (ended.at.as_s() * 1e3).round() / 1e3,
    });
    let mut add = |key: &str, value: Option<Value>| {
        if let (Some(value), Some(line)) = (value, line.as_object_mut()) {
            line.insert(key.to_owned(), value);
        }
    };
    add("true_error_mm", truth.map(mm));
    add("unseen", ended.unseen.as_ref().map(|unseen| json!(unseen)));
    add("refused", ended.refused.as_ref().map(|refused| json!(refused)));
    line
}
