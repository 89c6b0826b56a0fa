//! Feeds a recorded run to the estimator, event by event.

use footplate_core::track::{Layout, Leg};
use footplate_core::tracking::{Hit, Predictor};
use footplate_core::{Event, EventKind, RunId, Timestamp, TrainId, TurnoutId};

use crate::recording::{RawEvent, Run};

/// The layout and the turnout positions of a recording.
#[derive(Debug, Clone, Copy)]
pub struct ReplayContext<'a> {
    /// Its layout.
    pub layout: &'a Layout,
    /// The known turnout positions at the beginning of each run; events of a run may change them.
    pub turnouts: &'a [(TurnoutId, Leg)],
}

/// A run that cannot be replayed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// Several trains run, and reports do not name the train.
    #[error(
        "run {run}: trains {} run at once, and reports do not name the train; record one train per run",
        listed(trains)
    )]
    ManyTrains {
        /// The run.
        run: RunId,
        /// Its trains.
        trains: Vec<TrainId>,
    },
    /// No row names the train.
    #[error("run {0}: no row names a train; begin it with a `running` row that names the train and its step")]
    NoTrain(RunId),
}

fn listed(trains: &[TrainId]) -> String {
    trains.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// Why the reports of a run are not of one train.
fn no_train(run: &Run) -> ReplayError {
    let moving = run.moving();
    let trains = if moving.is_empty() { &run.trains } else { &moving };
    let trains: Vec<TrainId> = trains.iter().map(|known| known.train).collect();
    if trains.is_empty() {
        return ReplayError::NoTrain(run.id);
    }
    ReplayError::ManyTrains { run: run.id, trains }
}

/// Feeds one run to the estimator in the order of time and calls `see` for every passage of a sensor, with the event
/// that reported it and the estimator after it.
///
/// # Errors
/// [`ReplayError`] before the first event; the estimator is unchanged.
pub fn replay_run(
    context: ReplayContext<'_>,
    run: &Run,
    predictor: &mut Predictor,
    mut see: impl FnMut(&RawEvent, Hit, &Predictor),
) -> Result<(), ReplayError> {
    let at_start = run.reported_train().ok_or_else(|| no_train(run))?;
    let ReplayContext { layout, turnouts } = context;
    predictor.begin_run(at_start.train, at_start.step);
    for (turnout, leg) in turnouts {
        let kind = EventKind::Turnout { turnout: *turnout, curved: leg.is_curved() };
        predictor.take(layout, &Event { time: Timestamp::ZERO, kind });
    }
    for raw in &run.events {
        if let Some(hit) = predictor.take(layout, &raw.event) {
            see(raw, hit, predictor);
        }
    }
    predictor.end_run();
    Ok(())
}
