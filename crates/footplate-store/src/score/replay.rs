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
    #[error(
        "run {run}: no row names a train; begin it with a `running` row that names the train and its step"
    )]
    NoTrain {
        /// The run.
        run: RunId,
    },
}

fn listed(trains: &[TrainId]) -> String {
    trains.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
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
    let at_start = match run.trains.as_slice() {
        [only] => *only,
        [] => return Err(ReplayError::NoTrain { run: run.id }),
        many => {
            let trains = many.iter().map(|known| known.train).collect();
            return Err(ReplayError::ManyTrains { run: run.id, trains });
        }
    };
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
