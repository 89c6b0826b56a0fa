//! Notices of the driver, its watchdog and the dispatcher, in one type: each machine passes on those of the machine
//! inside it.

use alloc::string::String;
use alloc::vec::Vec;

use crate::control::drive::{ArrivalProfile, Order, OrderId, Refusal};
use crate::control::supervise::Alarm;
use crate::event::Command;
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::Landmark;
use crate::tracking::{DueSensor, PassedSensor};
use crate::units::{Length, Speed};

/// What has happened, or will.
#[derive(Debug, Clone, PartialEq)]
pub enum Notice {
    /// A sensor reported a train.
    Passed {
        /// The train.
        train: TrainId,
        /// The detection, beside the one that was expected.
        passed: PassedSensor,
        /// The detection that is due next.
        next: Option<DueSensor>,
    },
    /// The driver planned a stop, or planned it again from a new detection.
    Planned(PlannedStop),
    /// The order came too late for its target: the train was commanded to stop at once, and comes to rest beyond.
    Overshoots {
        /// The order.
        order: OrderId,
        /// The train.
        train: TrainId,
        /// The median distance beyond the target.
        by: Length,
    },
    /// A train that holds a speed follows this line from now on.
    Paced(PacedLine),
    /// How a train will arrive on time.
    Arrives(PlannedArrival),
    /// A follower was commanded to stop: it would have come too close to its leader, or the leader's position is unknown.
    /// It starts again by itself.
    HeldBack {
        /// The order.
        order: OrderId,
        /// The follower.
        train: TrainId,
        /// The train ahead.
        leader: TrainId,
    },
    /// Speed supervision commanded a slower step than was ordered, because of a zone the train is in or approaches. It
    /// commands the ordered step again behind the zone.
    SpeedLimited {
        /// The train.
        train: TrainId,
        /// The step commanded.
        step: SpeedStep,
        /// The name of the zone.
        zone: String,
        /// The zone's limit.
        limit: Speed,
    },
    /// An order has been carried out.
    Done(Finished),
    /// The driver gave up an order that it had begun; the train was commanded to stop.
    GivenUp {
        /// The order.
        order: OrderId,
        /// The train.
        train: TrainId,
        /// Why.
        why: Refusal,
    },
    /// A later order replaced this one.
    Replaced {
        /// The order.
        order: OrderId,
        /// The train.
        train: TrainId,
    },
    /// A turnout was commanded.
    TurnoutThrown {
        /// The order; `None` if it was commanded elsewhere, for example at the station.
        order: Option<OrderId>,
        /// The turnout.
        turnout: TurnoutId,
        /// `true` for the diverging leg.
        curved: bool,
    },
    /// A train took the other leg: the turnout is not as it was commanded.
    TurnoutMismatch {
        /// The turnout.
        turnout: TurnoutId,
        /// Its position as the train showed it; `true` for the diverging leg.
        curved: bool,
        /// The train.
        train: TrainId,
    },
    /// A sensor should have reported a train by now.
    Overdue {
        /// The train.
        train: TrainId,
        /// The sensor.
        sensor: SensorId,
        /// How late the detection is.
        by: TimeSpan,
    },
    /// The speeds that a train's decoder reports contradict its sensors: they are ignored from now on.
    SpeedReportsIgnored {
        /// The train.
        train: TrainId,
    },
    /// The track ends ahead of a train, which was commanded to stop.
    TrackEnds {
        /// The train.
        train: TrainId,
        /// The end of the track.
        end: NodeId,
    },
    /// The movement authority of a train ends ahead of it; the train was commanded to stop.
    AuthorityEnds {
        /// The train.
        train: TrainId,
    },
    /// The position of a train is unknown; the train was commanded to stop.
    Lost {
        /// The train.
        train: TrainId,
    },
    /// A detection that two trains, or a train and noise, may have caused. No estimate changes until other detections decide.
    Ambiguous {
        /// The sensor.
        sensor: SensorId,
        /// When it was detected.
        time: Timestamp,
        /// The most likely train.
        likeliest: TrainId,
        /// The next likely train; `None` for noise.
        or: Option<TrainId>,
    },
    /// A train was detected by a sensor that does not report the direction, and its direction is not known: the next sensor decides.
    EitherDirection {
        /// The train.
        train: TrainId,
        /// The sensor.
        sensor: SensorId,
        /// When it was detected.
        time: Timestamp,
    },
    /// A sensor reported repeatedly where no train can be: its reports are ignored.
    SensorStuck {
        /// The sensor.
        sensor: SensorId,
    },
    /// A stuck sensor has behaved for a while: its reports are used again.
    SensorRestored {
        /// The sensor.
        sensor: SensorId,
    },
    /// A detection that no train can have caused.
    Unexplained {
        /// The sensor.
        sensor: SensorId,
        /// When it was detected.
        time: Timestamp,
    },
    /// Something moves that no session drives: two adjacent sensors reported what no train explains. Trains that could
    /// meet it were commanded to stop, until an operator places a train or switches the power on.
    UnauthorisedMovement {
        /// The sensor that reported it first.
        from: SensorId,
        /// The next one.
        to: SensorId,
        /// Trains that it could meet.
        stopped: Vec<TrainId>,
    },
    /// The track is clear of what no session drove.
    TrackClear,
    /// Sensors all over the layout report what no train explains: trains that may move are stopped until none has for a while.
    Noise,
    /// No sensor has reported at random for a while.
    NoiseOver,
    /// A command was not sent for a long time. A stop is commanded again.
    Unconfirmed {
        /// The command.
        command: Command,
    },
    /// The watchdog no longer trusts the model or position of a train: it was commanded to stop, and so were others.
    Danger {
        /// The train.
        train: TrainId,
        /// Why.
        why: Alarm,
        /// Other trains that it could meet.
        stopped: Vec<TrainId>,
        /// The order that was interrupted.
        interrupted: Option<Order>,
    },
    /// Track power was switched off.
    PowerOff {
        /// The train that did not stop otherwise.
        train: TrainId,
    },
    /// Track power is on again; all trains were commanded to stop.
    PowerOn,
    /// A train waits for clearance to creep to the next sensors.
    AsksToCreep {
        /// The train.
        train: TrainId,
    },
    /// A train creeps until two sensors confirm its position.
    Creeps {
        /// The train.
        train: TrainId,
        /// The step commanded.
        step: SpeedStep,
    },
    /// Two consistent detections located a train again.
    Located {
        /// The train.
        train: TrainId,
    },
    /// The speed at a step was measured again.
    SpeedMeasured {
        /// The train.
        train: TrainId,
        /// The step.
        step: SpeedStep,
        /// Measured speed over the model's.
        ratio: f64,
        /// One standard deviation of the ratio.
        deviation: f64,
    },
    /// A stop was compared with its prediction.
    StopChecked {
        /// The train.
        train: TrainId,
        /// Distance from the predicted to the estimated place of rest.
        beyond: Length,
        /// One standard deviation expected of that.
        deviation: Length,
    },
    /// A recovery succeeded.
    Recovered {
        /// The train.
        train: TrainId,
        /// What it found.
        outcome: Outcome,
        /// How long it took.
        took: TimeSpan,
    },
    /// An interrupted order was given again.
    Resumed {
        /// The train.
        train: TrainId,
        /// The number of the interrupted order.
        interrupted: Option<OrderId>,
        /// Its number now.
        order: OrderId,
    },
    /// An interrupted order cannot be resumed.
    Cancelled {
        /// The train.
        train: TrainId,
        /// The number of the order.
        interrupted: OrderId,
        /// The order.
        order: Order,
    },
    /// A recovery failed: an operator has to look.
    NeedsOperator {
        /// The train.
        train: TrainId,
        /// What it failed at, as the end of a sentence.
        while_it: &'static str,
    },
    /// The dispatcher reserved the route of a train, to its destination or to where it makes room.
    RouteSet {
        /// The train.
        train: TrainId,
        /// The predicted travel time.
        takes: TimeSpan,
        /// How often the train reverses on it.
        turns: usize,
    },
    /// A train waits for track that other trains have reserved.
    Waits {
        /// The train.
        train: TrainId,
        /// The trains that have reserved it.
        on: Vec<TrainId>,
    },
    /// Trains at rest block each other, and none of them can move: an operator has to move one and place it. Repeated
    /// until one can.
    Deadlocked {
        /// The train whose path was searched last.
        train: TrainId,
    },
    /// Trains at rest block each other: some of them make room.
    Deadlock {
        /// The train that is blocked.
        train: TrainId,
        /// The trains that make room, in this order; empty if no sequence resolves it, and one is sent elsewhere.
        moves: Vec<TrainId>,
    },
    /// A train makes room for another.
    StepsAside {
        /// The train.
        train: TrainId,
        /// The train that needs the track.
        makes_room_for: TrainId,
        /// Where it goes.
        to: Landmark,
    },
    /// A route was released before its train started; the dispatcher tries again later.
    Withdrawn {
        /// The train.
        train: TrainId,
        /// The driver's refusal, if the driver refused.
        why: Option<Refusal>,
    },
    /// A train has arrived at its destination.
    Arrived {
        /// The journey.
        order: OrderId,
        /// The train.
        train: TrainId,
        /// Estimated distance beyond the destination in the direction that the train faces.
        error: Option<Length>,
        /// Time since the journey was ordered.
        took: TimeSpan,
    },
    /// A train left its route: it was commanded to stop, and so were those that it could meet.
    Diverged {
        /// The train.
        train: TrainId,
        /// The others.
        stopped: Vec<TrainId>,
    },
    /// The position of a train is unknown: all track where it may be stays reserved.
    ReservedAsUnknown {
        /// The train.
        train: TrainId,
    },
}

/// A planned stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedStop {
    /// The order.
    pub order: OrderId,
    /// The train.
    pub train: TrainId,
    /// When the last bit of the command shall have been sent.
    pub leaves: Timestamp,
    /// The last sensor whose report can still change the time of the command.
    pub trigger: Option<SensorId>,
    /// How long after that sensor the command is sent.
    pub after_trigger: Option<TimeSpan>,
    /// The predicted place of rest, relative to the target.
    pub promise: Promise,
}

/// The line of a train that holds a speed, in surveyed lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PacedLine {
    /// The order.
    pub order: OrderId,
    /// The train.
    pub train: TrainId,
    /// The node of a sensor on its path.
    pub node: NodeId,
    /// The train is this far past it ...
    pub way: Length,
    /// ... at this time, and runs on from there ...
    pub time: Timestamp,
    /// ... at this speed.
    pub speed: Speed,
}

/// A planned arrival at a place at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedArrival {
    /// The order.
    pub order: OrderId,
    /// The train.
    pub train: TrainId,
    /// When it shall be at rest there.
    pub by: Timestamp,
    /// For a train at rest: when it starts, and at which step.
    pub starts: Option<(Timestamp, SpeedStep)>,
    /// Its profile until the stop; `None` for a start followed directly by the stop.
    pub profile: Option<ArrivalProfile>,
}

/// A predicted place of rest relative to the target, negative short of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Promise {
    /// The median.
    pub median: Length,
    /// 2.5 % of stops end short of this.
    pub low: Length,
    /// 2.5 % of stops end beyond this.
    pub high: Length,
}

/// An order carried out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finished {
    /// The order.
    pub order: OrderId,
    /// The train.
    pub train: TrainId,
    /// When.
    pub time: Timestamp,
    /// Where the train is estimated to be; `None` if its position is unknown.
    pub achieved: Option<Achieved>,
    /// The prediction when the stop was commanded; only with a target.
    pub promise: Option<Promise>,
    /// A sensor that should have reported the train and did not: it missed the train, or the train is at rest short
    /// of it and its estimated position is wrong.
    pub unseen: Option<SensorId>,
}

/// The estimated place of rest of a train.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Achieved {
    /// The place.
    pub at: Landmark,
    /// One standard deviation.
    pub uncertainty: Length,
    /// Distance beyond the target, negative short of it; only with a target.
    pub error: Option<Length>,
}

/// The result of a recovery.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Outcome {
    /// The train is unchanged.
    AsBefore,
    /// The same train, faster or slower by a factor.
    Rescaled {
        /// New speed divided by old.
        ratio: f64,
    },
    /// Another train: its model was learnt from the start.
    LearntAnew,
}
