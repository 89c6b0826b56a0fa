//! When a train came by the contacts behind it.

use alloc::collections::VecDeque;

use crate::ids::NodeId;
use crate::time::Timestamp;

/// As many as trains that follow each other need of their first: ten seconds of the densest known track, twice over.
const KEPT: usize = 40;

/// The last contacts that a train passed, oldest first, each with when it most likely did: what the report says of that and
/// what the train's motion says, taken together.
#[derive(Debug, Clone, Default)]
pub(in crate::control::drive) struct Passages(VecDeque<(NodeId, Timestamp)>);

impl Passages {
    /// It came by one more.
    pub(in crate::control::drive) fn note(&mut self, node: NodeId, time: Timestamp) {
        if self.0.len() >= KEPT {
            self.0.pop_front();
        }
        self.0.push_back((node, time));
    }

    /// It is somewhere else now.
    pub(in crate::control::drive) fn forget(&mut self) {
        self.0.clear();
    }

    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = (NodeId, Timestamp)> + '_ {
        self.0.iter().copied()
    }
}
