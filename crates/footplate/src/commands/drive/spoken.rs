//! What is said of a session: lines for people, and finished orders for whoever counts them.

use footplate_core::control::Promise;
use footplate_core::track::Landmark;
use footplate_core::{Length, TimeSpan, TrainId};

use crate::dashboard::{Alarm, TrainPassed};

/// Something to be said.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Spoken {
    /// For people, and what could stand below it: where trains are.
    Line {
        /// The line.
        text: String,
        /// Where trains are, shortly.
        status: String,
    },
    /// A train passed a contact; for whoever draws it.
    Passed(TrainPassed),
    /// Something is not as it should be; for whoever looks at pages, where it is said, too.
    Alarm(Alarm),
    /// An order begins that ends at a place; whoever knows the truth may look where the train is now.
    Begun(TrainId),
    /// An order has ended.
    Ended(Ended),
    /// All has been done.
    Over,
}

/// An order that has ended, well or not.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ended {
    /// As it was written.
    pub(super) text: String,
    /// Its first word.
    pub(crate) command: &'static str,
    pub(super) train: Option<TrainId>,
    pub(super) target: Target,
    /// The target as the train faces it, where it may have come from either side.
    pub(super) faced: Option<Landmark>,
    /// The place, as it is believed.
    pub(super) achieved: Option<String>,
    /// How far beyond the target that is.
    pub(super) error: Option<Length>,
    /// What had been promised of that.
    pub(crate) promise: Option<Promise>,
    /// When, since the session began.
    pub(super) at: TimeSpan,
    /// A contact that should have reported the train and did not.
    pub(super) unseen: Option<String>,
    /// Why it was not carried out.
    pub(crate) refused: Option<String>,
}

/// Where an order was to lead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Target {
    /// Nowhere in particular.
    None,
    /// To a place.
    Place(Landmark),
    /// So far from where it was.
    Ahead(Length),
}
