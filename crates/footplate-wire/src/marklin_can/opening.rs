//! How far the station has been asked for all that has to be known before trains are driven.

use alloc::collections::VecDeque;

/// What is asked, in this order.
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

/// Where the opening is.
#[derive(Debug, Clone)]
pub(super) enum Opening {
    /// These are still to be asked.
    Asking(VecDeque<Question>),
    Open,
}

impl Opening {
    pub(super) fn begin() -> Self {
        Self::Asking([Question::Ping, Question::Modules, Question::Power, Question::Roster].into())
    }

    /// The station was not heard for a while; its list of locomotives is known.
    pub(super) fn again() -> Self {
        Self::Asking([Question::Ping, Question::Modules, Question::Power].into())
    }

    pub(super) const fn is_open(&self) -> bool {
        matches!(self, Self::Open)
    }
}
