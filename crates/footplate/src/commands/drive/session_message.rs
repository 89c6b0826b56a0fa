//! The messages of a driving session: lines of text, detections, alarms and ended orders.

use footplate_core::control::Promise;
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Length, TimeSpan, TrainId};
use serde::Serialize;

use crate::dashboard::{Alarm, TrainPassed};

/// One message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum SessionMessage {
    /// A line for operators, with a status line to show below it.
    Line {
        text: String,
        /// Where all trains are, in short.
        status: String,
    },
    /// A sensor detected a train: for the displays.
    Passed(TrainPassed),
    /// An alarm: for the displays.
    Alarm(Alarm),
    /// An operator said where a train is: what it did before does not lead there.
    Placed(TrainId),
    /// A train begins an order that ends at a place: the time to note its true position in a simulation.
    Begun(TrainId),
    /// An order has ended.
    Ended(Ended),
    /// The session is over.
    Over,
}

/// An order that has ended, carried out or not.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ended {
    /// The line it was given by.
    pub(super) text: String,
    /// The first word of that line.
    pub(crate) command: &'static str,
    pub(super) train: Option<TrainId>,
    pub(super) target: Target,
    /// The target in the direction of arrival, if the train may have come from either side.
    pub(super) target_on_arrival: Option<Landmark>,
    /// The estimated place of rest.
    pub(super) achieved: Option<String>,
    /// How far beyond the target that is.
    pub(super) error: Option<Length>,
    /// The interval that was predicted for the stop.
    pub(crate) promise: Option<Promise>,
    /// When it ended, since the session began.
    pub(super) at: TimeSpan,
    /// A sensor that should have reported the train and did not.
    pub(super) unseen: Option<String>,
    /// Why it was not carried out.
    pub(crate) refused: Option<String>,
}

/// The target of an order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Target {
    /// An order without a target.
    None,
    /// A place.
    Place(Landmark),
    /// A distance ahead of where the train was.
    Ahead(Length),
}

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
