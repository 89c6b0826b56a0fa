//! Walking a recorded run through the estimator, entry by entry.

use footplate_core::track::{Layout, Leg};
use footplate_core::tracking::{Hit, Predictor};
use footplate_core::{Event, EventKind, RunId, Timestamp, TrainId, TurnoutId};

use crate::recording::{RawEvent, Run};

/// What a recording is walked on.
#[derive(Debug, Clone, Copy)]
pub struct ReplayContext<'a> {
    /// Its layout.
    pub layout: &'a Layout,
    /// How turnouts lay when each run began, as far as that is known; a run may tell more.
    pub turnouts: &'a [(TurnoutId, Leg)],
}

/// Why a run cannot be walked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// Reports do not say which train made them.
    #[error(
        "run {run}: trains {} run at once, and no report says which of them made it; record one train a run",
        listed(trains)
    )]
    ManyTrains {
        /// The run.
        run: RunId,
        /// Its trains.
        trains: Vec<TrainId>,
    },
    /// Nothing in the run says which train ran.
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

/// Walks one run in the order of time and calls `see` for every passage of a contact, with the entry that
/// reported it and the estimator as it is then.
///
/// # Errors
/// [`ReplayError`] before the first entry; the estimator is as it was.
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
