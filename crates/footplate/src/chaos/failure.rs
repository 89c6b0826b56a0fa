//! What must not happen in a story.

use footplate_sim::IncidentKind;

/// The kind of a failure; two failures of one kind count as the same when a story is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FailureKind {
    /// Trains touched.
    Collision,
    /// A train left the rails.
    Derailment,
    /// A train ran past the end of its track.
    Overrun,
    /// A coil of a turnout burnt.
    CoilBurnt,
    /// Trains ran on after a death.
    RanOn,
    /// Program or guardian was taken for dead, and was alive.
    Wronged,
    /// The store lost or changed what it had acknowledged.
    NotKept,
    /// Nothing moved, and no alarm said why.
    Stuck,
}

impl FailureKind {
    /// Whether a train came to grief.
    pub(crate) const fn is_grief(self) -> bool {
        matches!(self, Self::Collision | Self::Derailment | Self::Overrun)
    }

    /// Whether it is known to happen in some of a thousand stories: grief, and a railway that stands without an alarm. Everything
    /// else has happened in no story since it was mended, and is never accepted.
    pub(crate) const fn is_known(self) -> bool {
        self.is_grief() || matches!(self, Self::Stuck)
    }
}

impl From<IncidentKind> for FailureKind {
    fn from(kind: IncidentKind) -> Self {
        match kind {
            IncidentKind::Collision { .. } => Self::Collision,
            IncidentKind::Derailment { .. } => Self::Derailment,
            IncidentKind::Overrun => Self::Overrun,
            IncidentKind::CoilBurnt { .. } => Self::CoilBurnt,
        }
    }
}

/// One failure, in words for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Failure {
    pub(crate) kind: FailureKind,
    pub(crate) words: String,
}
