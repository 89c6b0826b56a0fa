//! What a calibration has to say while it goes on.

use alloc::vec::Vec;

use super::accuracy::StepAccuracy;
use super::experiment::{Experiment, Why};
use crate::ids::{NodeId, SensorId, SpeedStep, TurnoutId};
use crate::time::TimeSpan;
use crate::track::{Circuit, HopId, Leg};
use crate::units::Length;

/// Something for people and programs to know.
#[derive(Debug, Clone, PartialEq)]
pub enum CalibrationNotice {
    /// The train passed a contact: it is known where it is and which way it faces.
    Found {
        /// The node of the contact.
        node: NodeId,
        /// The throttle step at which it came.
        step: SpeedStep,
    },
    /// It runs on this circuit from now on.
    Circuit(Circuit),
    /// It faces a track that ends, or one that leads back to nowhere: it stops and turns around.
    TurnsAround {
        /// The node of the contact behind which it does so.
        node: NodeId,
    },
    /// An experiment begins.
    Begins {
        /// What is tried.
        experiment: Experiment,
        /// Why this one.
        why: Why,
    },
    /// An experiment has ended, and the model is fitted anew.
    Done(Done),
    /// How far it is.
    Progress(Progress),
    /// Something went wrong; the calibration goes on unless it is followed by `Finished`.
    Mishap(Mishap),
    /// The train stands and nothing more is coming.
    Finished {
        /// Why it ended.
        ending: Ending,
        /// What has been reached.
        accuracy: Vec<StepAccuracy>,
    },
}

/// An experiment and what it brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Done {
    /// What was tried.
    pub experiment: Experiment,
    /// How long it took.
    pub took: TimeSpan,
    /// What was known of its step and approach before.
    pub before: StepAccuracy,
    /// What is known now.
    pub after: StepAccuracy,
}

/// How far a calibration is.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// What it is about.
    pub phase: Phase,
    /// Track time since its first command.
    pub elapsed: TimeSpan,
    /// Track time that is left of the budget.
    pub left: TimeSpan,
    /// What is known of the steps that move the train.
    pub accuracy: Vec<StepAccuracy>,
}

/// What a calibration is about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// Finding the train.
    Finding,
    /// On the way to a circuit.
    Joining,
    /// Trying something.
    Experiment(Experiment),
    /// Paused by a person; the train stands or comes to rest.
    Paused,
    /// Bringing the train to rest.
    Ending,
    /// Done.
    Finished,
}

/// What can go wrong without being the end.
#[derive(Debug, Clone, PartialEq)]
pub enum Mishap {
    /// The train did not start or stopped by itself; it was pushed up a step, and this one is not relied upon.
    Stalled {
        /// The step.
        step: SpeedStep,
    },
    /// Contacts that the train passed did not report.
    Missed {
        /// How many in a row.
        count: usize,
        /// The contact that reported after them.
        before: SensorId,
    },
    /// A report that the train cannot have caused.
    Unexplained {
        /// The contact.
        sensor: SensorId,
    },
    /// The train took the other leg of a turnout: it did not lie as it had been told. It is commanded again.
    WrongLeg {
        /// The turnout.
        turnout: TurnoutId,
        /// The leg it should have lain for.
        wanted: Leg,
    },
    /// The train turned up where it cannot have run to: it was lifted, pushed or turned around.
    Moved {
        /// Where it was seen last.
        from: Option<NodeId>,
        /// Where it is now.
        to: NodeId,
    },
    /// No contact for too long: the train is stopped and looked for again.
    Lost {
        /// Where it was seen last.
        last: Option<NodeId>,
    },
    /// Hops take times that their surveyed lengths do not explain: dirty rails, or another layout.
    LengthsDiffer {
        /// The hops, with the length on the survey and as the train feels it.
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
    /// The train could not be found: no contact reported, at any step and in either direction.
    NotFound,
    /// No circuit can be reached from where the train is, in either direction.
    NoCircuit,
    /// The reports make no sense on this layout: it is another one.
    WrongLayout {
        /// What reported, in order.
        seen: Vec<SensorId>,
        /// What might have reported at the first of them.
        expected: Vec<SensorId>,
    },
}
