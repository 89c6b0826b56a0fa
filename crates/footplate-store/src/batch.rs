//! Recordings in, a calibration out: gathers the runs of recordings, or of a store at a date, for the batch fit.

use footplate_core::calibration::{Calibration, RunPassages, SectionIndex};
use footplate_core::estimation::Predictor;
use footplate_core::latency::{PollTiming, PollTimingEstimator};
use footplate_core::track::Layout;
use footplate_core::{Estimate, Event, EventKind, RunId, SpeedStep, TimeSpan, Timestamp, TrainId};

use crate::recording::{Recording, Run};
use crate::store::{Store, StoreError};

/// A run as a batch keeps it: with the place of every event, so that each number can be traced back.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchRun {
    /// The recording it is of.
    pub recording: String,
    /// Its number there.
    pub id: RunId,
    /// When its clock stood at zero, since the Unix epoch, where the recording tells.
    pub began_at: Option<Timestamp>,
    /// Its train.
    pub train: TrainId,
    /// The step at which the train had been running for long; 0 at rest.
    pub step: SpeedStep,
    /// Its events in order.
    pub events: Vec<BatchEvent>,
}

/// An event and where it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatchEvent {
    /// What happened.
    pub event: Event,
    /// The line of the file that tells it, counted from 1.
    pub line: u64,
    /// Its number in the store, by which a person can exclude it.
    pub stored_as: Option<i64>,
    /// A person has excluded it.
    pub excluded: bool,
}

/// The rhythm of the link of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Polling {
    /// The recording.
    pub recording: String,
    /// As found in its reports; what is assumed where they show no rhythm.
    pub timing: PollTiming,
    /// The idle period with its uncertainty; `None` where the reports show no rhythm.
    pub period: Option<Estimate<TimeSpan>>,
}

/// Runs, what they told, and what was made of it.
#[derive(Debug)]
pub struct Batch {
    /// The runs, numbered as the calibration numbers them.
    pub runs: Vec<BatchRun>,
    /// The passages read from each.
    pub passages: Vec<RunPassages>,
    /// The rhythm of each recording's link.
    pub polling: Vec<Polling>,
    /// The stretches by which lengths are kept.
    pub sections: SectionIndex,
    /// The fit of all of it.
    pub calibration: Calibration,
    /// Runs of live sessions in which several trains moved, whose contacts nobody has told apart.
    pub left_out: Vec<LeftOut>,
}

/// A run of which nothing was used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// The recording it is of.
    pub recording: String,
    /// Its number there.
    pub run: RunId,
    /// The trains that moved in it.
    pub trains: Vec<TrainId>,
}

/// Why recordings make no calibration.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BatchError {
    /// No run passes two contacts in a row at a settled speed.
    #[error(
        "nothing to calibrate in {runs} runs with {passages} passages of contacts: at least one run should pass \
         two contacts that the layout links, at a speed that no longer changes"
    )]
    NothingSettled {
        /// Runs looked at.
        runs: usize,
        /// Passages found in them.
        passages: usize,
    },
    /// Hits of several trains cannot be told apart yet.
    #[error(
        "{recording}, run {run}: {} trains move in one run; hits can only be told apart in runs of one train so \
         far, so record each train in a run of its own",
        trains.len()
    )]
    SeveralTrains {
        /// The recording.
        recording: String,
        /// The run.
        run: RunId,
        /// The trains that move in it.
        trains: Vec<TrainId>,
    },
    /// The store could not be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl Batch {
    /// Calibrates from recordings just read; of one train only where it is given.
    pub fn of_recordings(
        layout: &Layout,
        recordings: &[Recording],
        train: Option<TrainId>,
    ) -> Result<Self, BatchError> {
        let mut runs = Vec::new();
        for recording in recordings {
            for run in &recording.runs {
                let events = run.events.iter().map(|raw| BatchEvent {
                    event: raw.event,
                    line: raw.line,
                    stored_as: None,
                    excluded: false,
                });
                runs.extend(batch_run(&recording.name, run, events.collect(), train)?);
            }
        }
        Self::of_runs(layout, runs, Vec::new())
    }

    /// Calibrates from everything a store held at a date of one layout, less what was excluded at that date.
    pub fn of_store(
        layout: &Layout,
        store: &Store,
        as_of: Timestamp,
        train: Option<TrainId>,
    ) -> Result<Self, BatchError> {
        let (mut runs, mut left_out) = (Vec::new(), Vec::new());
        for recording in store.recordings(as_of)?.iter().filter(|stored| stored.layout == layout.name()) {
            for stored in store.runs(recording.key, as_of)? {
                let events = stored.events.iter().map(|event| BatchEvent {
                    event: event.raw.event,
                    line: event.raw.line,
                    stored_as: Some(event.key.0),
                    excluded: event.is_excluded(),
                });
                match batch_run(&recording.name, &stored.accepted(), events.collect(), train) {
                    // A person who records trains one by one wants to know; a session goes as it goes.
                    Err(BatchError::SeveralTrains { recording: name, run, trains })
                        if recording.is_live() =>
                    {
                        left_out.push(LeftOut { recording: name, run, trains });
                    }
                    run => runs.extend(run?),
                }
            }
        }
        Self::of_runs(layout, runs, left_out)
    }

    fn of_runs(layout: &Layout, runs: Vec<BatchRun>, left_out: Vec<LeftOut>) -> Result<Self, BatchError> {
        let sections = SectionIndex::of(layout);
        let mut polling: Vec<Polling> = Vec::new();
        let mut passages: Vec<RunPassages> = Vec::new();
        for recording in runs.chunk_by(|one, next| one.recording == next.recording) {
            let timing = rhythm(recording);
            let name = recording.first().map_or_else(String::new, |run| run.recording.clone());
            polling.push(Polling { recording: name, timing: timing.timing(), period: timing.period() });
            for run in recording {
                let place = passages.len();
                let events = run.events.iter().map(|event| (&event.event, event.excluded));
                passages.push(RunPassages::read(layout, run.train, run.step, place, events, &timing));
            }
        }
        let calibration =
            Calibration::of(layout, &sections, &passages).ok_or_else(|| BatchError::NothingSettled {
                runs: runs.len(),
                passages: passages.iter().map(|run| run.passages.len()).sum(),
            })?;
        Ok(Self { runs, passages, polling, sections, calibration, left_out })
    }

    /// The event that a calibration means by run and entry.
    #[must_use]
    pub fn event(&self, run: usize, entry: usize) -> Option<&BatchEvent> {
        self.runs.get(run)?.events.get(entry)
    }

    /// Walks the runs of one train in order through a predictor that knows nothing, as a live session would
    /// have.
    pub fn walk(&self, layout: &Layout, train: TrainId) -> Predictor {
        let mut predictor = Predictor::new(layout);
        for run in self.runs.iter().filter(|run| run.train == train) {
            predictor.begin_run(run.train, run.step);
            for event in run.events.iter().filter(|event| !event.excluded) {
                predictor.take(layout, &event.event);
            }
        }
        predictor.end_run();
        predictor
    }
}

fn batch_run(
    recording: &str,
    run: &Run,
    events: Vec<BatchEvent>,
    wanted: Option<TrainId>,
) -> Result<Option<BatchRun>, BatchError> {
    let moving = run.moving();
    let only = match (run.only_train(), moving.as_slice()) {
        (Some(only), _) => only,
        (None, [only]) => *only,
        (None, []) => return Ok(None),
        (None, several) => {
            return Err(BatchError::SeveralTrains {
                recording: recording.to_owned(),
                run: run.id,
                trains: several.iter().map(|at_start| at_start.train).collect(),
            });
        }
    };
    Ok(wanted.is_none_or(|wanted| wanted == only.train).then(|| BatchRun {
        recording: recording.to_owned(),
        id: run.id,
        began_at: run.began_at,
        train: only.train,
        step: only.step,
        events,
    }))
}

/// The rhythm of a recording's link, from all its reports: an excluded report still shows when polls were.
fn rhythm(runs: &[BatchRun]) -> PollTimingEstimator {
    let mut timing = PollTimingEstimator::default();
    let mut last = Timestamp::ZERO;
    for run in runs {
        timing.restart();
        for BatchEvent { event, .. } in &run.events {
            match event.kind {
                EventKind::Sensor(_) => timing.report(event.time),
                EventKind::Stopped { .. } => {}
                EventKind::Speed { .. } | EventKind::Reverse { .. } | EventKind::Turnout { .. } => {
                    timing.command_sent();
                }
            }
            last = event.time;
        }
    }
    timing.fit(last);
    timing
}
