//! Notices of a calibration.

use alloc::vec::Vec;

use super::accuracy::StepAccuracy;
use super::experiment::{Experiment, Why};
use crate::ids::{NodeId, SensorId, SpeedStep, TurnoutId};
use crate::time::TimeSpan;
use crate::track::{Circuit, HopId, Leg};
use crate::units::Length;

/// A notice for operators and programs.
#[derive(Debug, Clone, PartialEq)]
pub enum CalibrationNotice {
    /// The train passed a sensor: its position and direction are known.
    Found {
        /// The node of the sensor.
        node: NodeId,
        /// The step that was commanded.
        step: SpeedStep,
    },
    /// The train runs on this circuit from now on.
    Circuit(Circuit),
    /// No circuit leads ahead of the train, or the track ends: it stops and reverses.
    TurnsAround {
        /// The node of the sensor that it passed last.
        node: NodeId,
    },
    /// An experiment begins.
    Begins {
        /// The experiment.
        experiment: Experiment,
        /// Why it was chosen.
        why: Why,
    },
    /// An experiment has ended, and the model was fitted again.
    Done(Done),
    /// The progress of the calibration.
    Progress(Progress),
    /// A fault; the calibration continues unless `Finished` follows. Recorded decisions hold this name, so it stays.
    Mishap(Fault),
    /// The train is at rest, and no more notices follow.
    Finished {
        /// Why it ended.
        ending: Ending,
        /// The accuracy reached.
        accuracy: Vec<StepAccuracy>,
    },
}

/// An experiment and its result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Done {
    /// The experiment.
    pub experiment: Experiment,
    /// How long it took.
    pub took: TimeSpan,
    /// The accuracy of its step and approach before.
    pub before: StepAccuracy,
    /// The accuracy now.
    pub after: StepAccuracy,
}

/// The progress of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// The phase.
    pub phase: CalibrationPhase,
    /// Track time since its first command.
    pub elapsed: TimeSpan,
    /// Remaining track time of the budget.
    pub left: TimeSpan,
    /// The accuracy of the steps that move the train.
    pub accuracy: Vec<StepAccuracy>,
}

/// The phase of a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CalibrationPhase {
    /// Finding the train.
    Finding,
    /// Running to a circuit.
    Joining,
    /// Running an experiment.
    Experiment(Experiment),
    /// Bringing the train to rest.
    Ending,
    /// Done.
    Finished,
}

/// A fault that does not end the calibration.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// The train did not start, or stopped by itself; its step was raised, and this one counts as unreliable.
    Stalled {
        /// The step.
        step: SpeedStep,
    },
    /// Sensors that the train passed did not report.
    Missed {
        /// How many in a row.
        count: usize,
        /// The sensor that reported after them.
        before: SensorId,
    },
    /// A report that the train cannot have caused.
    Unexplained {
        /// The sensor.
        sensor: SensorId,
    },
    /// The train took the other leg of a turnout, which was not in its commanded position. It is commanded again.
    WrongLeg {
        /// The turnout.
        turnout: TurnoutId,
        /// The commanded position.
        wanted: Leg,
    },
    /// The train was detected where it cannot have run: it was lifted, pushed or reversed by hand.
    Moved {
        /// Where it was detected before.
        from: Option<NodeId>,
        /// Where it is now.
        to: NodeId,
    },
    /// No detection for too long: the train stops, and the search begins again.
    Lost {
        /// Where it was detected last.
        last: Option<NodeId>,
    },
    /// The train runs otherwise than in earlier sessions: it may be another engine.
    OtherSpeeds {
        /// Its speeds divided by those of before (median).
        ratio: f64,
    },
    /// Running times contradict the surveyed lengths of hops: dirty rails, or another layout.
    LengthsDiffer {
        /// The hops, with surveyed length and path length.
        hops: Vec<(HopId, Length, Length)>,
    },
}

/// Why a calibration ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The budget is used.
    Budget,
    /// No experiment would gain anything worth its time.
    NothingToGain,
    /// The operator ended it. Recorded decisions hold this name, so it stays.
    Told,
    /// The train could not be found: no sensor reported it, at any step and in either direction.
    NotFound,
    /// Sensors that do not report the direction do not show it by their order either.
    NoDirection,
    /// No circuit can be reached from where the train is, in either direction.
    NoCircuit,
    /// Turnouts of the circuit could not be set: the train is always too near to them.
    TurnoutsUnset,
    /// The reports contradict this layout: it is another one.
    WrongLayout {
        /// The sensors that reported, in order.
        seen: Vec<SensorId>,
        /// The sensors that could have reported instead of the first of them.
        expected: Vec<SensorId>,
    },
}
