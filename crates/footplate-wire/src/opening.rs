//! The opening: what is asked of a station before trains may run.

use alloc::collections::VecDeque;

/// The state of the opening.
#[derive(Debug, Clone)]
pub(crate) enum Opening<Q> {
    /// These are still to be asked, each when the one before is answered.
    Asking(VecDeque<Q>),
    /// Trains may be driven.
    Open,
}

impl<Q> Opening<Q> {
    pub(crate) fn asking(questions: impl IntoIterator<Item = Q>) -> Self {
        Self::Asking(questions.into_iter().collect())
    }

    pub(crate) const fn is_open(&self) -> bool {
        matches!(self, Self::Open)
    }
}
