//! How fast one train may be where it goes from here, with the doubts of it and with commands that have not been given.
//!
//! [`Rollout`](super::Rollout) says what is most likely, thousands of times; this says what is to be reckoned with. `k` is
//! everywhere the number of standard deviations that are allowed for.

use super::motion_filter::MotionFilter;
use crate::ids::{NodeId, SpeedStep};
use crate::linalg::Gaussian;
use crate::model::{FELT, MotionModel};
use crate::time::{TimeSpan, Timestamp};

/// A train that does not come to a place within this long (s) is not reckoned with there: as long as a session waits for
/// the longest hop at the lowest step.
const LONGEST: f64 = 200.0;
/// The first look ahead (s); twice as far each time that it was not far enough.
const FIRST_LOOK: f64 = 0.5;
/// Halvings of that which leave less than a millisecond: a train runs half a millimetre then.
const HALVINGS: usize = 10;

/// A train that goes on as it was told. A copy may be told something else.
///
/// Ways in m past [`node`](Self::node), in lengths as the train feels them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReachableSet {
    node: Option<NodeId>,
    epoch: Timestamp,
    following: MotionFilter,
}

impl ReachableSet {
    pub(super) const fn new(node: Option<NodeId>, epoch: Timestamp, following: MotionFilter) -> Self {
        Self { node, epoch, following }
    }

    /// The contact from which ways are counted; `None` while the position of the train is unknown.
    pub(crate) const fn node(&self) -> Option<NodeId> {
        self.node
    }

    /// The step commanded last.
    pub(crate) fn step(&self) -> u8 {
        self.following.step()
    }

    /// A step leaves the line at a time that is not before the last command.
    pub(crate) fn command(&mut self, model: &MotionModel, sent: Timestamp, step: SpeedStep) {
        self.following.command(model, (sent - self.epoch).as_s(), step.get());
    }

    /// Once all that was told has taken effect: what is asked of it many times.
    pub(crate) fn after_all(&self, model: &MotionModel) -> Self {
        Self { following: self.following.after_all(model), ..*self }
    }

    /// How far it may have come by a time; for a negative `k` how far it has come at least.
    pub(crate) fn place(&self, model: &MotionModel, at: Timestamp, k: f64) -> f64 {
        bound(self.following.place(model, (at - self.epoch).as_s()), k)
    }

    /// When it may be at a place for the first time, looked for from a time on; for a negative `k` when it is there at the
    /// latest. `None` if it does not come so far.
    pub(crate) fn reaches(
        &self,
        model: &MotionModel,
        place: f64,
        from: Timestamp,
        k: f64,
    ) -> Option<Timestamp> {
        let is_there = |after: f64| self.place(model, from + TimeSpan::from_s(after), k) >= place;
        if is_there(0.0) {
            return Some(from);
        }
        let (mut low, mut high) = (0.0, FIRST_LOOK);
        while !is_there(high) {
            (low, high) = (high, 2.0 * high);
            if high > LONGEST {
                return None;
            }
        }
        // A look that is twice as far takes one halving more to be as fine.
        let further = libm::log2(high / FIRST_LOOK) as usize;
        for _ in 0..HALVINGS + further {
            let middle = 0.5 * (low + high);
            if is_there(middle) { high = middle } else { low = middle }
        }
        Some(from + TimeSpan::from_s(high))
    }

    /// By which part it is at a time faster than what it was told will have it, negative for a train that gets faster.
    pub(crate) fn unsettled(&self, model: &MotionModel, at: Timestamp) -> f64 {
        let now = self.following.speed(model, (at - self.epoch).as_s()).mean;
        let settled = self.after_all(model).following.settled_speed().mean;
        if settled > 0.0 { now / settled - 1.0 } else { now }
    }

    /// How fast (m/s) it may be at a time and from then on, the change under way done or not.
    pub(crate) fn fastest_from(&self, model: &MotionModel, at: Timestamp, k: f64) -> f64 {
        let now = local(self.following.changing_speed(model, (at - self.epoch).as_s()), k);
        now.max(self.fastest_settled(k))
    }

    /// How fast (m/s) it may run once all changes are done, of a reachable set [`after_all`](Self::after_all).
    pub(crate) fn fastest_settled(&self, k: f64) -> f64 {
        local(self.following.settled_speed(), k)
    }
}

/// The bound of a speed on any single stretch: a model knows speeds as means of whole hops in the train's own measure, and a
/// stretch of rail is felt shorter or longer than that by what hops are.
fn local(of: Gaussian, k: f64) -> f64 {
    let felt = FELT * of.mean;
    bound(Gaussian { variance: of.variance + felt * felt, ..of }, k)
}

fn bound(of: Gaussian, k: f64) -> f64 {
    of.mean + k * libm::sqrt(of.variance)
}
