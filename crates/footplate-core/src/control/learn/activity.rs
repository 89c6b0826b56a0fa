//! The activity of the calibrator, and the stage of its experiment.

use super::accuracy::StepAccuracy;
use super::experiment::Experiment;
use super::notice::CalibrationPhase;
use crate::time::Timestamp;

/// The present activity of the calibrator.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Activity {
    /// It has not started.
    NotStarted,
    /// The train was commanded to stop; stuck sensors report now.
    Listening { until: Timestamp },
    /// The lost train runs to any sensor. Its step is raised if none reports.
    Finding { push_at: Timestamp },
    /// The train stops, and reverses when it is at rest.
    Reversing { at: Timestamp },
    /// The train runs to a circuit, or over turnouts that could not be thrown yet.
    Joining,
    /// An experiment runs.
    Trying(Trial),
    /// The train was lost and commanded to stop; the search begins at this time.
    Waiting { until: Timestamp },
    /// The train stops; the calibration is over then.
    Ending { until: Timestamp },
    /// The calibration is over.
    Finished,
}

impl Activity {
    /// The phase that notices report.
    pub(super) fn phase(&self) -> CalibrationPhase {
        match self {
            Self::NotStarted
            | Self::Listening { .. }
            | Self::Finding { .. }
            | Self::Reversing { .. }
            | Self::Waiting { .. } => CalibrationPhase::Finding,
            Self::Joining => CalibrationPhase::Joining,
            Self::Trying(trial) => CalibrationPhase::Experiment(trial.experiment),
            Self::Ending { .. } => CalibrationPhase::Ending,
            Self::Finished => CalibrationPhase::Finished,
        }
    }
}

/// A running experiment.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trial {
    pub(super) experiment: Experiment,
    pub(super) begun: Timestamp,
    pub(super) before: StepAccuracy,
    pub(super) stage: Stage,
}

/// The stage of an experiment.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Stage {
    /// Runs at a step on the side from which the experiment's step is approached.
    RunUp,
    /// Runs at the step; this many sensors remain to be passed at a steady speed.
    Steady { sensors: u8 },
    /// Waits for the time to stop, if it is known already.
    Aiming {
        at: Option<Timestamp>,
        /// Number of sensors at which that time may be computed again.
        again: u8,
    },
    /// Commanded to stop; at rest by then.
    Braking { until: Timestamp },
    /// Makes a short move, to be stopped at this time.
    Moving { stop_at: Timestamp },
    /// Commanded to stop at the end of a short move.
    BrakingAgain { until: Timestamp },
    /// Creeps to the next sensor.
    Creeping,
}
