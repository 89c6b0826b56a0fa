//! Where one train is between two contacts, through changes of speed, and where it would come to rest.
//!
//! Ways are counted from a contact passed, in lengths as the train feels them: a contact-to-contact hop is as long as
//! [`MotionModel::length`] says, and a place within it lies at the same part of it as on the survey.

use super::ground::Ground;
use crate::calibration::motion::MotionModel;
use crate::event::Event;
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::latency::ContactWindow;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Position;
use crate::units::{Length, Speed};

/// A place on the way of a train, counted in lengths as the train feels them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WayPoint {
    /// The node of the contact from which it is counted.
    pub node: NodeId,
    /// How far past it, along the way as the turnouts lie.
    pub way: Length,
}

/// Where a train is and how sure that is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// The most likely place of its pickup.
    pub at: WayPoint,
    /// One standard deviation of the way.
    pub uncertainty: Length,
    /// Its speed.
    pub speed: Speed,
    /// One standard deviation of that.
    pub speed_uncertainty: Speed,
    /// The step it was told last.
    pub step: SpeedStep,
    /// Whether it stands, as far as is known.
    pub at_rest: bool,
}

/// Where a train would come to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// The most likely place.
    pub at: WayPoint,
    /// One standard deviation of what is not known: the place now and the way to rest.
    pub doubt: Length,
    /// One standard deviation of what no knowledge would narrow: how stops from there scatter.
    pub scatter: Length,
    /// When it stands, at the latest as far as is foreseen.
    pub time: Timestamp,
}

/// The next contact that is due.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DueContact {
    /// The contact.
    pub sensor: SensorId,
    /// When it should close.
    pub time: Timestamp,
    /// One standard deviation of that.
    pub uncertainty: TimeSpan,
    /// How fast the train will be there.
    pub speed: Speed,
}

/// A contact that the train passed, beside what had been expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassedContact {
    /// The contact.
    pub sensor: SensorId,
    /// When it closed.
    pub window: ContactWindow,
    /// How much later than expected the middle of the window was, and one standard deviation of that expectation with
    /// the window in it; `None` for the first contact after the train was lost.
    pub late: Option<[TimeSpan; 2]>,
    /// The same as way: how far the train was short of the contact when it was expected there.
    pub short: Option<Length>,
    /// Contacts between the one passed before and this one that did not report.
    pub missed: usize,
}

/// Follows one train.
#[derive(Debug, Clone)]
pub struct Locator {
    train: TrainId,
    step: SpeedStep,
}

impl Locator {
    /// A train that stands nobody knows where.
    #[must_use]
    pub fn new(train: TrainId) -> Self {
        Self { train, step: SpeedStep::STAND }
    }

    /// The train.
    #[must_use]
    pub const fn train(&self) -> TrainId {
        self.train
    }

    /// The train stands here, within one standard deviation: a person put it there or read it off a tape.
    pub fn place(&mut self, now: Timestamp, at: WayPoint, uncertainty: Length) {
        let _ = (now, at, uncertainty);
    }

    /// Nobody knows where the train is: it was lifted, or reports make no sense.
    pub fn lose(&mut self) {}

    /// A command to the train has left the line. Other entries say nothing here.
    pub fn handle_command(&mut self, ground: Ground<'_>, model: &MotionModel, event: &Event) {
        let _ = (ground, model, event);
    }

    /// How likely it is that this train closed a contact within a window: the logarithm of the probability density in
    /// 1/s, `None` if it cannot be. A train that is lost may be anywhere (`0`).
    #[must_use]
    pub fn likelihood(
        &self,
        ground: Ground<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: ContactWindow,
    ) -> Option<f64> {
        let _ = (ground, model, sensor, window);
        None
    }

    /// The train passed a contact: it is judged to have been this train.
    pub fn pass(
        &mut self,
        ground: Ground<'_>,
        model: &MotionModel,
        sensor: SensorId,
        window: ContactWindow,
    ) -> PassedContact {
        let _ = (ground, model);
        PassedContact { sensor, window, late: None, short: None, missed: 0 }
    }

    /// Where it is at a time that is not before the last entry; `None` while it is lost.
    #[must_use]
    pub fn locate(&self, ground: Ground<'_>, model: &MotionModel, at: Timestamp) -> Option<Located> {
        let _ = (ground, model, at);
        None
    }

    /// The contact it comes to next if nothing else is commanded; `None` while it stands, stops short of it or is lost.
    #[must_use]
    pub fn next_contact(
        &self,
        ground: Ground<'_>,
        model: &MotionModel,
        now: Timestamp,
    ) -> Option<DueContact> {
        let _ = (ground, model, now);
        None
    }

    /// Where it would come to rest if step 0 left the line at a time (not before the last entry), after any commands
    /// that were sent. For a train that was told to stop already, where it comes to rest anyway.
    #[must_use]
    pub fn rest_if_stopped(&self, ground: Ground<'_>, model: &MotionModel, at: Timestamp) -> Option<Rest> {
        let _ = (ground, model, at);
        None
    }

    /// The same for a train at rest that is first told a step at `start`: what a short move is made of.
    #[must_use]
    pub fn rest_after_move(
        &self,
        ground: Ground<'_>,
        model: &MotionModel,
        start: Timestamp,
        step: SpeedStep,
        stop: Timestamp,
    ) -> Option<Rest> {
        let _ = (ground, model, start, step, stop);
        None
    }
}

/// The way from a waypoint's node to a place on the layout, as the train feels it and as the turnouts lie; `None` if
/// none leads there within one lap.
#[must_use]
pub fn way_to(ground: Ground<'_>, model: &MotionModel, from: NodeId, to: Position) -> Option<Length> {
    let _ = (ground, model, from, to);
    None
}

/// The place on the layout of a point on the way, as the turnouts lie.
#[must_use]
pub fn place_of(ground: Ground<'_>, model: &MotionModel, at: WayPoint) -> Option<Position> {
    let _ = (ground, model, at);
    None
}
