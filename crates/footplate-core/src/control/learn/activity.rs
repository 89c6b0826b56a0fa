//! What the calibrator is doing right now.

use super::accuracy::StepAccuracy;
use super::experiment::Experiment;
use super::notice::Phase;
use crate::time::Timestamp;

/// What it is about.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Activity {
    /// Nothing was said yet.
    Asleep,
    /// The train was commanded to stop; contacts that report by themselves show now.
    Listening { until: Timestamp },
    /// It runs, and any contact tells where. Without one it is pushed up a step.
    Finding { push_at: Timestamp },
    /// It stops, and is turned around when it stands.
    Turning { at: Timestamp },
    /// It is on its way to a circuit, or over turnouts that could not be thrown yet.
    Joining,
    /// Something is tried.
    Trying(Trial),
    /// It stops because a person said so, and waits for them.
    Paused,
    /// It was lost and commanded to stop; it is looked for again from then on.
    Waiting { until: Timestamp },
    /// It stops for good.
    Ending { until: Timestamp },
    /// It is over.
    Finished,
}

impl Activity {
    /// The same for people.
    pub(super) fn phase(&self) -> Phase {
        match self {
            Self::Asleep
            | Self::Listening { .. }
            | Self::Finding { .. }
            | Self::Turning { .. }
            | Self::Waiting { .. } => Phase::Finding,
            Self::Joining => Phase::Joining,
            Self::Trying(trial) => Phase::Experiment(trial.experiment),
            Self::Paused => Phase::Paused,
            Self::Ending { .. } => Phase::Ending,
            Self::Finished => Phase::Finished,
        }
    }
}

/// An experiment under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trial {
    pub(super) experiment: Experiment,
    pub(super) begun: Timestamp,
    pub(super) before: StepAccuracy,
    pub(super) stage: Stage,
}

/// How far it is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Stage {
    /// To the other side of the step, so that it is reached by the approach that is asked for.
    RunUp,
    /// At the step; this many contacts are still to be passed once it is steady.
    Steady { contacts: u8 },
    /// Waiting for the moment to stop, if it is known already.
    Aiming {
        at: Option<Timestamp>,
        /// Contacts at which it may be worked out anew.
        again: u8,
    },
    /// Told to stop; rests by then.
    Braking { until: Timestamp },
    /// On a short move, to be stopped then.
    Moving { stop_at: Timestamp },
    /// Told to stop at the end of a short move.
    BrakingAgain { until: Timestamp },
    /// On to the next contact.
    Crawling,
}
