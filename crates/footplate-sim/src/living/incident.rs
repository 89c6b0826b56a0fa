//! Incidents: collisions, derailments, overruns and burnt coils.

use core::fmt;

use footplate_core::{Timestamp, TrainId, TurnoutId};

/// An event that an operator has to set right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Incident {
    /// When it happened.
    pub at: Timestamp,
    /// The train concerned, if there is one.
    pub train: Option<TrainId>,
    /// What happened.
    pub kind: IncidentKind,
}

/// The kinds of incidents. Trains concerned stop dead, and stay there until an operator places them elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IncidentKind {
    /// Two trains touched; each of them has an entry.
    Collision {
        /// The other train.
        with: TrainId,
    },
    /// The points moved under the train, or it reversed over points that were set for the other leg, or it met a double
    /// slip with both turnouts curved.
    Derailment {
        /// The turnout.
        turnout: TurnoutId,
    },
    /// The train ran past the end of its track.
    Overrun,
    /// A solenoid was left powered until its coil burnt; the turnout keeps its position.
    CoilBurnt {
        /// The turnout.
        turnout: TurnoutId,
    },
}

impl fmt::Display for Incident {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} s: ", self.at.as_s())?;
        if let Some(train) = self.train {
            write!(f, "train {} ", train.0)?;
        }
        match self.kind {
            IncidentKind::Collision { with } => write!(f, "ran into train {}", with.0),
            IncidentKind::Derailment { turnout } => write!(f, "derailed at turnout {}", turnout.0),
            IncidentKind::Overrun => write!(f, "ran past the end of its track"),
            IncidentKind::CoilBurnt { turnout } => write!(f, "the coil of turnout {} burnt", turnout.0),
        }
    }
}
