//! Which hops a train has run over, at which steps, and its last route at each turnout.

use alloc::vec::Vec;

use crate::ids::{NodeId, SensorId, SpeedStep};
use crate::track::{HopId, Layout, Reach};

/// The routes of one train.
#[derive(Debug, Clone, Default)]
pub(super) struct RouteMemory {
    /// By hop, the steps at which the train has run over it, a bit each.
    passed: Vec<u128>,
    /// By node, the hop the train took when it was last there.
    habits: Vec<Option<HopId>>,
}

impl RouteMemory {
    /// Whether the train has run over every hop of a path at this step before.
    pub(super) fn has_passed(&self, path: &Reach, step: SpeedStep) -> bool {
        path.hops()
            .iter()
            .all(|hop| self.passed.get(hop.index()).is_some_and(|steps| steps >> step.get() & 1 == 1))
    }

    /// The train took a path at this step.
    pub(super) fn remember(&mut self, layout: &Layout, path: &Reach, step: SpeedStep) {
        for hop in path.hops() {
            if self.passed.len() <= hop.index() {
                self.passed.resize(hop.index() + 1, 0);
            }
            if let Some(steps) = self.passed.get_mut(hop.index()) {
                *steps |= 1 << step.get();
            }
            let Some(from) = layout.hop(*hop).map(|hop| usize::from(hop.from.0)) else { continue };
            if self.habits.len() <= from {
                self.habits.resize(from + 1, None);
            }
            if let Some(habit) = self.habits.get_mut(from) {
                *habit = Some(*hop);
            }
        }
    }

    /// Which sensor had been named as the next before the train took this path.
    pub(super) fn named(&self, layout: &Layout, path: &Reach) -> Option<SensorId> {
        let first = path.hops().first().and_then(|hop| layout.hop(*hop))?;
        self.habit(first.from)
            .and_then(|hop| layout.hop(hop))
            .or_else(|| layout.hops_from(first.from).next())?
            .sensor
    }

    fn habit(&self, from: NodeId) -> Option<HopId> {
        self.habits.get(usize::from(from.0)).copied().flatten()
    }
}
