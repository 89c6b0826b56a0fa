//! What can become of trains and turnouts.

use footplate_core::{Timestamp, TrainId, TurnoutId};

/// Something that a person has to set right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mishap {
    /// When it happened.
    pub at: Timestamp,
    /// The train it happened to, if to one.
    pub train: Option<TrainId>,
    /// What.
    pub kind: MishapKind,
}

/// What happened. Trains concerned stop dead and stay where they are until a hand puts them elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MishapKind {
    /// Two trains touch: the other one. It has an entry of its own.
    Collision {
        /// The train that it touches.
        with: TrainId,
    },
    /// The points moved under it, or it backed over points that lay for the other leg than it came by, or it met a
    /// pair of turnouts in one place that both lay curved.
    Derailment {
        /// The turnout.
        turnout: TurnoutId,
    },
    /// It ran past the end of its track.
    Overrun,
    /// A solenoid was left powered until its coil burnt; the turnout lies as it does for good.
    CoilBurnt {
        /// The turnout.
        turnout: TurnoutId,
    },
}
