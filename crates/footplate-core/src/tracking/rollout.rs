//! Where one train most likely goes from here, commands that have not been given included.

use super::filter_state::FilterState;
use super::motion_filter::INTERRUPTED;
use crate::ids::{NodeId, SpeedStep};
use crate::model::MotionModel;
use crate::time::Timestamp;

/// What is asked "and if it were told this then?", again and again, of copies.
///
/// In plain numbers, because searches ask thousands of times: ways in m past [`node`](Self::node) in lengths as the train
/// feels them, times in s on a clock whose zero [`seconds`](Self::seconds) knows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rollout {
    node: NodeId,
    epoch: Timestamp,
    course: FilterState,
}

/// By this much (s) later every change of speed is over.
const LONG_AFTER: f64 = 20.0;

impl Rollout {
    pub(super) const fn new(node: NodeId, epoch: Timestamp, course: FilterState) -> Self {
        Self { node, epoch, course }
    }

    /// The contact from which ways are counted.
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

    /// A step leaves the line at a time that is not before what was asked last.
    pub(crate) fn command(&mut self, model: &MotionModel, sent: f64, step: SpeedStep) {
        self.course.settle(model, sent);
        self.course.command(sent, step.get());
    }

    /// How much way (m) nobody can foresee if it were told another step at a time that is not before what was asked last.
    pub(crate) fn doubt_of_interruption(&mut self, model: &MotionModel, time: f64) -> f64 {
        self.course.settle(model, time);
        INTERRUPTED * self.course.unsettled(time)
    }

    /// The way at a time that is not before what was asked last.
    pub(crate) fn place(&mut self, model: &MotionModel, time: f64) -> f64 {
        self.course.settle(model, time);
        self.course.place(time)
    }

    /// Way and speed at such a time.
    pub(crate) fn place_and_speed(&mut self, model: &MotionModel, time: f64) -> [f64; 2] {
        [self.place(model, time), self.course.speed(time)]
    }

    /// Once all that was told has taken effect: the way at a time if the train had always run at the speed that it will
    /// have then, and that speed.
    pub(crate) fn settled_place_and_speed(mut self, model: &MotionModel, time: f64) -> [f64; 2] {
        let [place, speed] = self.place_and_speed(model, time + LONG_AFTER);
        [place - speed * LONG_AFTER, speed]
    }
}
