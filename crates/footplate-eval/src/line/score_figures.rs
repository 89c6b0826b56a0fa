//! The figures of a score, as files hold them.

use footplate_store::odometry::OdometryScore;
use serde_json::{Map, Value, json};

/// The figures of a score by their names in files.
pub fn score_json(score: &OdometryScore) -> Value {
    let figures =
        score.figures().into_iter().map(|(key, value)| (key.to_owned(), value.map_or(Value::Null, figure)));
    let mut fields: Map<String, Value> = figures.collect();
    fields.insert("scored".into(), json!(score.scored));
    fields.into()
}

/// A figure to a micrometre or a millionth of a per cent, so that files do not show the rounding of sums.
pub fn figure(value: f64) -> Value {
    json!((value * 1e6).round() / 1e6 + 0.0)
}
