//! The most likely motion of a train from here, further commands included.

use super::filter_state::FilterState;
use super::motion_filter::INTERRUPTED;
use crate::ids::{NodeId, SpeedStep};
use crate::model::MotionModel;
use crate::time::Timestamp;

/// Answers "what if this were commanded then?", thousands of times, on copies.
///
/// In plain numbers for speed: distances are path lengths in m past [`node`](Self::node), times are in s on a clock whose zero
/// [`seconds`](Self::seconds) knows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rollout {
    node: NodeId,
    epoch: Timestamp,
    course: FilterState,
}

/// After this time (s) every change of speed is complete.
const LONG_AFTER: f64 = 20.0;

impl Rollout {
    pub(super) const fn new(node: NodeId, epoch: Timestamp, course: FilterState) -> Self {
        Self { node, epoch, course }
    }

    /// The sensor from which distances count.
    pub(crate) const fn node(&self) -> NodeId {
        self.node
    }

    /// A time on the clock of the rollout.
    pub(crate) fn seconds(&self, time: Timestamp) -> f64 {
        (time - self.epoch).as_s()
    }

    /// The step commanded last.
    pub(crate) fn step(&self) -> u8 {
        self.course.step()
    }

    /// A step leaves the line at a time that is not before the last query.
    pub(crate) fn command(&mut self, model: &MotionModel, sent: f64, step: SpeedStep) {
        self.course.settle(model, sent);
        self.course.command(sent, step.get());
    }

    /// One standard deviation (m) of the distance that a further command adds, given at a time not before the last query.
    pub(crate) fn interruption_deviation(&mut self, model: &MotionModel, time: f64) -> f64 {
        self.course.settle(model, time);
        INTERRUPTED * self.course.unsettled(time)
    }

    /// The distance at a time that is not before the last query.
    pub(crate) fn place(&mut self, model: &MotionModel, time: f64) -> f64 {
        self.course.settle(model, time);
        self.course.place(time)
    }

    /// Distance and speed at such a time.
    pub(crate) fn place_and_speed(&mut self, model: &MotionModel, time: f64) -> [f64; 2] {
        [self.place(model, time), self.course.speed(time)]
    }

    /// Once all commands have taken effect: the distance at a time as if the train had always run at its final speed, and that
    /// speed.
    pub(crate) fn settled_place_and_speed(mut self, model: &MotionModel, time: f64) -> [f64; 2] {
        let [place, speed] = self.place_and_speed(model, time + LONG_AFTER);
        [place - speed * LONG_AFTER, speed]
    }
}
