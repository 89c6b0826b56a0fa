//! The messages of a driving session: lines of text, detections, alarms and ended orders.

use footplate_core::control::Promise;
use footplate_core::track::Landmark;
use footplate_core::{Length, TimeSpan, TrainId};

use crate::dashboard::{Alarm, TrainPassed};

/// One message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Spoken {
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
