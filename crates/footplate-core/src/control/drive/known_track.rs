//! The track that a driver runs trains on.

use crate::model::survey::SectionIndex;
use crate::track::{Layout, TurnoutStates};
use crate::tracking::TrackContext;

/// The owner of what a [`TrackContext`] refers to.
#[derive(Debug, Clone)]
pub(super) struct KnownTrack {
    pub(super) layout: Layout,
    pub(super) sections: SectionIndex,
    pub(super) turnouts: TurnoutStates,
}

impl KnownTrack {
    pub(super) fn new(layout: Layout, turnouts: TurnoutStates) -> Self {
        let sections = SectionIndex::of(&layout);
        Self { layout, sections, turnouts }
    }

    pub(super) const fn context(&self) -> TrackContext<'_> {
        TrackContext { layout: &self.layout, sections: &self.sections, turnouts: &self.turnouts }
    }
}
