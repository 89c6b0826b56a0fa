//! What the station is asked before trains are driven.

/// A question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Question {
    /// Who is there.
    Ping,
    /// The contacts of all modules.
    Modules,
    /// That the track has power, or has none.
    Power,
    /// The list of locomotives.
    Roster,
}

impl Question {
    /// All questions, in the order in which they are asked.
    pub(super) const ALL: [Self; 4] = [Self::Ping, Self::Modules, Self::Power, Self::Roster];
    /// What is asked when the station was not heard for a while and its list of locomotives is known.
    pub(super) const AGAIN: [Self; 3] = [Self::Ping, Self::Modules, Self::Power];
}
