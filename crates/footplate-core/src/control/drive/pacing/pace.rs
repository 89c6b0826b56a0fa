//! What a train is paced for, and what is kept of it from look to look.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::control::drive::order::Gap;
use crate::control::drive::task::Destination;
use crate::ids::{SpeedStep, TrainId};
use crate::time::Timestamp;
use crate::tracking::WayPoint;
use crate::units::Speed;

use super::arrival_plan::ArrivalPlan;
use super::command_budget::CommandBudget;
use super::ideal_line::IdealLine;

/// What a train is paced for.
#[derive(Debug, Clone)]
pub(in crate::control::drive) enum Pace {
    /// To run at a speed.
    Hold(Holding),
    /// To come to rest in time.
    Arrive(Box<Arriving>),
    /// To keep a gap to another train.
    Follow(Following),
}

/// A train that is paced.
#[derive(Debug, Clone)]
pub(in crate::control::drive) struct Pacing {
    pub(super) pace: Pace,
    /// The steps that may be commanded, slowest first.
    pub(super) usable: Vec<SpeedStep>,
    pub(super) budget: CommandBudget,
    /// When it is looked at next.
    pub(super) look: Option<Timestamp>,
}

impl Pacing {
    pub(super) fn new(pace: Pace, usable: Vec<SpeedStep>, now: Timestamp) -> Self {
        Self { pace, usable, budget: CommandBudget::UNUSED, look: Some(now) }
    }
}

/// The speed to be held, and the line since there is one.
#[derive(Debug, Clone, Copy)]
pub(in crate::control::drive) struct Holding {
    pub(super) speed: Speed,
    /// From when on the train runs steadily at the step it was told first.
    pub(super) settled: Timestamp,
    pub(super) line: Option<IdealLine>,
}

/// Where it goes, and how.
#[derive(Debug, Clone, Copy)]
pub(in crate::control::drive) struct Arriving {
    pub(super) destination: Destination,
    /// `None` for a way so short that it takes one step and the stop.
    pub(super) plan: Option<ArrivalPlan>,
    /// What the times of the plan count from.
    pub(super) since: Timestamp,
    /// For a train that stands: the step to start with, which it is commanded when the times begin to count.
    pub(super) start: Option<SpeedStep>,
}

/// Whom it follows, and how.
#[derive(Debug, Clone, Copy)]
pub(in crate::control::drive) struct Following {
    pub(super) leader: TrainId,
    pub(super) gap: Gap,
    /// It has been commanded to stop because it would come too near.
    pub(super) is_held: bool,
    /// What it shall not pass, as of the last look, ...
    pub(super) rear: Option<WayPoint>,
    /// ... and the fastest step from which it will still be able to stop before it.
    pub(super) fastest: Option<SpeedStep>,
}
