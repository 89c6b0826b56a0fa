//! The line of JSON that `drive --json` prints for each order that has ended.

use footplate_core::Length;
use footplate_core::track::Layout;
use serde::Serialize;

use super::spoken::{Ended, Target};

/// The fields in the order in which they are written.
#[derive(Debug, Serialize)]
pub(super) struct ResultLine<'e> {
    command: &'static str,
    train: Option<u16>,
    target: Option<String>,
    achieved: Option<&'e str>,
    error_mm: Option<f64>,
    promised_low_mm: Option<f64>,
    promised_high_mm: Option<f64>,
    t_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    true_error_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    unseen: Option<&'e str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<&'e str>,
}

/// Millimetres, rounded to 0.1: finer than any estimate.
fn mm(length: Length) -> f64 {
    (length.as_mm() * 10.0).round() / 10.0
}

impl<'e> ResultLine<'e> {
    /// `truth` is how far beyond its target the train really came to rest, if a simulator knows.
    pub(super) fn of(layout: &Layout, ended: &'e Ended, truth: Option<Length>) -> Self {
        let target = match ended.target {
            Target::Place(place) => Some(layout.display(place).to_string()),
            Target::Ahead(distance) => Some(format!("{}mm", (distance.as_mm() * 1e6).round() / 1e6)),
            Target::None => None,
        };
        Self {
            command: ended.command,
            train: ended.train.map(|train| train.0),
            target,
            achieved: ended.achieved.as_deref(),
            error_mm: ended.error.map(mm),
            promised_low_mm: ended.promise.map(|promise| mm(promise.low)),
            promised_high_mm: ended.promise.map(|promise| mm(promise.high)),
            t_s: (ended.at.as_s() * 1e3).round() / 1e3,
            true_error_mm: truth.map(mm),
            unseen: ended.unseen.as_deref(),
            refused: ended.refused.as_deref(),
        }
    }
}
