//! The questions of the opening.

/// A question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Question {
    /// Who is there.
    Ping,
    /// The inputs of all modules.
    Modules,
    /// Sets the track power.
    Power,
    /// The list of locomotives.
    Roster,
}

impl Question {
    /// All questions, in the order in which they are asked.
    pub(super) const ALL: [Self; 4] = [Self::Ping, Self::Modules, Self::Power, Self::Roster];
    /// The questions after a silence, when the list of locomotives is known.
    pub(super) const AGAIN: [Self; 3] = [Self::Ping, Self::Modules, Self::Power];
}
