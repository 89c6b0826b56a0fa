//! Bounds of a train's motion from here: its uncertainty and possible further commands included.
//!
//! [`Rollout`](super::Rollout) gives the most likely motion, thousands of times; this gives the bounds. `k` is everywhere the
//! number of standard deviations that are allowed for.

use super::motion_filter::MotionFilter;
use crate::ids::{NodeId, SpeedStep};
use crate::linalg::Gaussian;
use crate::model::{MotionModel, PATH_LENGTH_SPREAD};
use crate::time::{TimeSpan, Timestamp};

/// A train that takes longer to a place (s) does not count as reaching it: as long as a session waits for the longest hop at
/// the lowest step.
const LONGEST: f64 = 200.0;
/// First horizon of the search (s); doubled as often as it is too short.
const FIRST_LOOK: f64 = 0.5;
/// Bisections of the horizon that leave less than a millisecond, in which a train runs half a millimetre.
const HALVINGS: usize = 10;

/// A train that keeps its commands. A copy may receive others.
///
/// Distances are path lengths in m past [`node`](Self::node).
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

    /// The sensor from which distances count; `None` while the position of the train is unknown.
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

    /// The state once all commands have taken effect: asked many times.
    pub(crate) fn after_all(&self, model: &MotionModel) -> Self {
        Self { following: self.following.after_all(model), ..*self }
    }

    /// The furthest place at a time; for a negative `k` the nearest.
    pub(crate) fn place(&self, model: &MotionModel, at: Timestamp, k: f64) -> f64 {
        bound(self.following.place(model, (at - self.epoch).as_s()), k)
    }

    /// The earliest time at a place, searched from a time on; for a negative `k` the latest. `None` if the train does not come so
    /// far.
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
        // A doubled horizon takes one more bisection for the same resolution.
        let further = libm::log2(high / FIRST_LOOK) as usize;
        for _ in 0..HALVINGS + further {
            let middle = 0.5 * (low + high);
            if is_there(middle) { high = middle } else { low = middle }
        }
        Some(from + TimeSpan::from_s(high))
    }

    /// By which part its speed at a time exceeds the speed of its command; negative for a train that accelerates.
    pub(crate) fn unsettled(&self, model: &MotionModel, at: Timestamp) -> f64 {
        let now = self.following.speed(model, (at - self.epoch).as_s()).mean;
        let settled = self.after_all(model).following.settled_speed().mean;
        if settled > 0.0 { now / settled - 1.0 } else { now }
    }

    /// The highest speed (m/s) at a time and from then on, whether or not the present change is complete.
    pub(crate) fn fastest_from(&self, model: &MotionModel, at: Timestamp, k: f64) -> f64 {
        let now = local(self.following.changing_speed(model, (at - self.epoch).as_s()), k);
        now.max(self.fastest_settled(k))
    }

    /// The highest speed (m/s) once all changes are complete, of a reachable set [`after_all`](Self::after_all).
    pub(crate) fn fastest_settled(&self, k: f64) -> f64 {
        local(self.following.settled_speed(), k)
    }
}

/// The bound of a speed on a single stretch: a model knows speeds as means over whole hops, and the ratio of path length to
/// surveyed length varies within a hop.
fn local(of: Gaussian, k: f64) -> f64 {
    let spread = PATH_LENGTH_SPREAD * of.mean;
    bound(Gaussian { variance: of.variance + spread * spread, ..of }, k)
}

fn bound(of: Gaussian, k: f64) -> f64 {
    of.mean + k * libm::sqrt(of.variance)
}
