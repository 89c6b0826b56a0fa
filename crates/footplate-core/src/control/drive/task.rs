//! What a train is doing, what should happen to it next, and the state of its speed supervision.

use alloc::string::String;

use crate::ids::{NodeId, SensorId, SpeedStep};
use crate::time::Timestamp;
use crate::track::Landmark;
use crate::tracking::{DueSensor, PathPoint};

use super::order::{Aim, OrderId};
use crate::control::Promise;
use crate::units::Speed;

/// An order that is being carried out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task {
    pub(super) order: OrderId,
    pub(super) goal: Goal,
    pub(super) phase: TaskPhase,
}

/// The result that the order asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Goal {
    /// Run at the commanded step.
    Run,
    /// Rest anywhere.
    Rest,
    /// Rest at a place.
    RestAt(Destination),
    /// Rest, reverse, then run at this step.
    Reverse(SpeedStep),
    /// Follow the train's pacing.
    Pace,
}

/// Where and how to come to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Destination {
    /// The landmark; `None` for a move.
    pub(super) named: Option<Landmark>,
    /// The point on the path, measured from the last sensor passed; `None` until the train has been located.
    pub(super) at: Option<PathPoint>,
    pub(super) aim: Aim,
    /// The step to stop from, if the order names one.
    pub(super) step: Option<SpeedStep>,
    pub(super) next_round: bool,
    /// When the train shall be at rest, if the order says. Path lengths are then learnt on the run, the target is
    /// measured again, and the step to stop from is chosen for the time.
    pub(super) in_time: Option<Timestamp>,
}

/// The phase of a task.
#[derive(Debug, Clone, Copy)]
pub(super) enum TaskPhase {
    /// The train runs to a sensor to be located.
    Locating { since: Timestamp },
    /// The train runs; `plan` is the planned stop.
    Running { plan: Option<StopPlan> },
    /// A command, mostly step 0, is waiting to be sent.
    Commanding { promise: Option<Promise> },
    /// Step 0 has been sent; the train comes to rest by this time.
    Settling { promise: Option<Promise>, until: Timestamp },
    /// Reversing has been commanded.
    Reversing,
    /// Pacing commands the steps.
    Pacing,
}

/// A planned stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StopPlan {
    /// When the last bit of the command shall have been sent.
    pub(super) leaves: Timestamp,
    /// The last two sensors whose reports can still change it, the later one first.
    pub(super) triggers: [Option<SensorId>; 2],
    pub(super) promise: Promise,
}

/// What should happen to a train next, as of the last report or command.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Expectation {
    /// The next detection.
    pub(super) due: Option<DueSensor>,
    pub(super) since: Timestamp,
    pub(super) overdue_reported: bool,
    /// How many sensors in a row should have reported the train and did not.
    pub(super) missed_in_a_row: u8,
    /// A sensor that should have reported it, if none has reported it since.
    pub(super) missed_sensor: Option<SensorId>,
    /// The highest speed at which it was predicted since its last detection.
    pub(super) fastest: Speed,
    /// When it counts as lost unless it is reported before; set once a detection is overdue.
    pub(super) lost_by: Option<Timestamp>,
    /// When a stop has to be commanded before the end of the track, and which end that is.
    pub(super) track_end_stop: Option<(Timestamp, NodeId)>,
    /// When a stop has to be commanded before the end of authority.
    pub(super) authority_stop: Option<Timestamp>,
}

/// The state of a train's speed supervision.
#[derive(Debug, Clone, Default)]
pub(super) struct SpeedSupervision {
    /// The ordered step, while a slower one is commanded.
    pub(super) wanted: Option<SpeedStep>,
    /// When the zones around the train are checked next.
    pub(super) next_check: Option<Timestamp>,
    /// The zone that was reported to slow the train down.
    pub(super) reported_zone: Option<String>,
}
