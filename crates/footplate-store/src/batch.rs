//! Recordings in, motion models out: gathers the runs of recordings, or of a store at a date, and fits every train.

use core::fmt;
use std::collections::{BTreeMap, BTreeSet};

use footplate_core::link::{PollTiming, PollTimingEstimator};
use footplate_core::model::report::{Review, RunPassages};
use footplate_core::model::survey::{LayoutTest, SectionIndex, SurveyTest};
use footplate_core::track::Layout;
use footplate_core::{
    DecoderSteps, Estimate, Event, EventKind, RunId, SpeedStep, TimeSpan, Timestamp, TrainId,
};

use crate::motion_replay::{MotionReplay, RunBegin, own_events};
use crate::recording::{Recording, Run, TrainAtStart};
use crate::recording_names::distinct_names;
use crate::store::{AssignedDetections, Store, StoreError};

/// A run as a batch keeps it: with the place of every event, so that each number can be traced back.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchRun {
    /// The recording it is of, by a name that no other recording of the batch has.
    pub recording: String,
    /// Whether that is a live session.
    pub is_live: bool,
    /// Whether other trains moved in it, too; its events are then those of its train.
    pub is_shared: bool,
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

impl BatchRun {
    /// What a train did in a run of a recording.
    fn of(recording: &str, is_live: bool, run: &Run, train: TrainAtStart, events: Vec<BatchEvent>) -> Self {
        let (TrainAtStart { train, step }, is_shared) = (train, false);
        Self {
            recording: recording.to_owned(),
            is_live,
            is_shared,
            id: run.id,
            began_at: run.began_at,
            train,
            step,
            events,
        }
    }

    /// Its events less those that a person has excluded.
    fn accepted(&self) -> impl Iterator<Item = &BatchEvent> {
        self.events.iter().filter(|event| !event.excluded)
    }
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
    /// It is the first detection of its train after that was lost.
    pub was_lost_before: bool,
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

/// One train of a batch.
#[derive(Debug)]
pub struct BatchTrain {
    /// Its motion model, and what that was fitted to.
    pub replay: MotionReplay,
    /// What its runs show beside the model.
    pub review: Review,
}

/// Runs, what they reported, and what was made of it.
#[derive(Debug)]
pub struct Batch {
    /// The runs, numbered as reviews number them.
    pub runs: Vec<BatchRun>,
    /// The passages read from each.
    pub passages: Vec<RunPassages>,
    /// The rhythm of each recording's link.
    pub polling: Vec<Polling>,
    /// The stretches by which lengths are kept.
    pub sections: SectionIndex,
    /// Whether the runs are of the layout.
    pub layout_test: LayoutTest,
    /// The trains, by number.
    pub trains: Vec<BatchTrain>,
    /// Runs of live sessions in which several trains moved, and of which the session has not said which detection was of which train.
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
    /// No run passes two sensors in a row.
    #[error(
        "nothing to calibrate in {runs} runs with {passages} sensor passages: at least one run should \
         pass two sensors that the layout links, at a steady speed"
    )]
    NothingSettled {
        /// Runs looked at.
        runs: usize,
        /// Passages found in them.
        passages: usize,
    },
    /// Hits of several trains cannot be distinguished yet.
    #[error(
        "{recording}, run {run}: {} trains move in one run; reports cannot be assigned to trains in a \
         recording yet, so record each train in a run of its own",
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
    /// No run is of the train.
    #[error(
        "no run of train {train}: {}",
        listed(there, "the recordings name no train", "the recordings are of train")
    )]
    NoRunOfTrain {
        /// The train.
        train: TrainId,
        /// The trains that the recordings are of.
        there: BTreeSet<TrainId>,
    },
    /// The store has no recording of the layout.
    #[error(
        "nothing to calibrate on the layout {layout}: {}",
        listed(there, "the store has no recordings yet", "the store has recordings of")
    )]
    NoRecordings {
        /// The layout.
        layout: String,
        /// The layouts that the store has recordings of.
        there: BTreeSet<String>,
    },
    /// The store could not be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// What there is, as a sentence: `none` if there is nothing.
fn listed<T: fmt::Display>(found: &BTreeSet<T>, none: &str, some: &str) -> String {
    let found: Vec<String> = found.iter().map(ToString::to_string).collect();
    if found.is_empty() { none.to_owned() } else { format!("{some} {}", found.join(", ")) }
}

impl Batch {
    /// Calibrates from recordings; of one train, or of all that are in them.
    ///
    /// # Errors
    /// [`BatchError`].
    pub fn of_recordings(
        layout: &Layout,
        recordings: &[Recording],
        train: Option<TrainId>,
    ) -> Result<Self, BatchError> {
        let mut runs = Vec::new();
        let names = distinct_names(recordings.iter().map(|recording| recording.name.as_str()));
        for (recording, name) in recordings.iter().zip(&names) {
            for run in &recording.runs {
                let events = run.events.iter().map(|raw| BatchEvent {
                    event: raw.event,
                    line: raw.line,
                    stored_as: None,
                    excluded: false,
                    was_lost_before: false,
                });
                runs.extend(batch_run(name, false, run, events.collect(), train)?);
            }
        }
        if let Some(train) = train.filter(|_| runs.is_empty()) {
            let there = recordings.iter().flat_map(Recording::trains).collect();
            return Err(BatchError::NoRunOfTrain { train, there });
        }
        Self::of_runs(layout, LayoutTest::default(), runs, Vec::new(), BTreeMap::new())
    }

    /// Calibrates from everything a store held at a date of one layout, less what was excluded at that date.
    ///
    /// # Errors
    /// [`BatchError`].
    pub fn of_store(
        layout: &Layout,
        store: &Store,
        as_of: Timestamp,
        train: Option<TrainId>,
    ) -> Result<Self, BatchError> {
        let (mut runs, mut left_out) = (Vec::new(), Vec::new());
        let (mut layout_test, sections) = (LayoutTest::default(), SectionIndex::of(layout));
        // Of recordings whose runs come here as parts: each part lacks the polls of the others.
        let mut rhythms: BTreeMap<String, PollTimingEstimator> = BTreeMap::new();
        let mut known: BTreeSet<TrainId> = BTreeSet::new();
        let all = store.recordings(as_of)?;
        let recordings: Vec<_> = all.iter().filter(|stored| stored.layout == layout.name()).collect();
        if recordings.is_empty() {
            let there = all.iter().map(|stored| stored.layout.clone()).collect();
            return Err(BatchError::NoRecordings { layout: layout.name().to_owned(), there });
        }
        let names = distinct_names(recordings.iter().map(|stored| stored.name.as_str()));
        for (recording, name) in recordings.into_iter().zip(&names) {
            let (mut assigned, stored_runs) = (None, store.runs(recording.key, as_of)?);
            for stored in &stored_runs {
                let events = stored.events.iter().map(|event| BatchEvent {
                    event: event.raw.event,
                    line: event.raw.line,
                    stored_as: Some(event.key.0),
                    excluded: event.is_excluded(),
                    was_lost_before: false,
                });
                let (accepted, is_live) = (stored.accepted(), recording.is_live());
                known.extend(accepted.trains.iter().map(|at_start| at_start.train));
                let moving = accepted.moving();
                if !is_live || moving.len() < 2 {
                    runs.extend(batch_run(name, is_live, &accepted, events.collect(), train)?);
                    continue;
                }
                let events: Vec<BatchEvent> = events.collect();
                let assigned = match &mut assigned {
                    Some(assigned) => assigned,
                    none => none.insert(store.assigned_detections(layout, recording.key)?),
                };
                // As a replay does: which train a report was of is decided by the layout that is tested.
                let accepted_events = accepted.events.iter().map(|raw| &raw.event);
                layout_test.take_run(layout, &sections, moving.len(), accepted_events);
                let wanted = |at_start: &&TrainAtStart| train.is_none_or(|train| train == at_start.train);
                let (known, unknown): (Vec<TrainAtStart>, Vec<TrainAtStart>) =
                    moving.iter().filter(wanted).partition(|at_start| assigned.knows(at_start.train));
                if !known.is_empty() {
                    let all = stored_runs.iter().map(|run| run.events.iter().map(|event| &event.raw.event));
                    rhythms.entry(name.clone()).or_insert_with(|| poll_rhythm(all));
                }
                runs.extend(known.into_iter().map(|at_start| {
                    let own = own_batch_events(layout, assigned, at_start.train, &events);
                    BatchRun { is_shared: true, ..BatchRun::of(name, is_live, &accepted, at_start, own) }
                }));
                if !unknown.is_empty() {
                    let trains = unknown.iter().map(|at_start| at_start.train).collect();
                    left_out.push(LeftOut { recording: name.clone(), run: accepted.id, trains });
                }
            }
        }
        // The runs of a calibration name the train by its commands alone.
        if let Some(train) = train.filter(|train| runs.is_empty() && !known.contains(train)) {
            return Err(BatchError::NoRunOfTrain { train, there: known });
        }
        Self::of_runs(layout, layout_test, runs, left_out, rhythms)
    }

    fn of_runs(
        layout: &Layout,
        mut layout_test: LayoutTest,
        runs: Vec<BatchRun>,
        left_out: Vec<LeftOut>,
        mut whole: BTreeMap<String, PollTimingEstimator>,
    ) -> Result<Self, BatchError> {
        let sections = SectionIndex::of(layout);
        for run in runs.iter().filter(|run| !run.is_shared) {
            layout_test.take_run(layout, &sections, 1, run.accepted().map(|event| &event.event));
        }
        let lengths = layout_test.lengths(&sections);
        let (mut polling, mut rhythms) = (Vec::new(), Vec::new());
        let mut passages: Vec<RunPassages> = Vec::new();
        for recording in runs.chunk_by(|one, next| one.recording == next.recording) {
            // An excluded report still shows when polls were.
            let name = recording.first().map_or_else(String::new, |run| run.recording.clone());
            let events = recording.iter().map(|run| run.events.iter().map(|event| &event.event));
            let rhythm = whole.remove(&name).unwrap_or_else(|| poll_rhythm(events));
            polling.push(Polling { recording: name, timing: rhythm.timing(), period: rhythm.period() });
            for run in recording {
                let place = passages.len();
                let events = run.events.iter().map(|event| (&event.event, event.excluded));
                passages.push(RunPassages::read(layout, run.train, run.step, place, events, &rhythm));
                rhythms.push(rhythm.clone());
            }
        }
        if passages.iter().flat_map(|run| &run.passages).all(|passage| passage.path.is_none()) {
            return Err(BatchError::NothingSettled {
                runs: runs.len(),
                passages: passages.iter().map(|run| run.passages.len()).sum(),
            });
        }
        let mut numbers: Vec<TrainId> = runs.iter().map(|run| run.train).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let trains = numbers.into_iter().map(|train| {
            let replay = replayed(layout, &sections, train, &runs, &rhythms, &lengths);
            let review = Review::of(layout, &sections, replay.fit.model(), &passages);
            BatchTrain { replay, review }
        });
        Ok(Self { trains: trains.collect(), runs, passages, polling, sections, layout_test, left_out })
    }

    /// What the lengths of the layout are worth after the runs: as all of them show it, or else the first train to contradict
    /// them.
    pub fn survey_test(&self) -> SurveyTest {
        let mut of_trains = self.trains.iter().map(|train| train.replay.fit.survey_test());
        of_trains.find(|test| !test.is_passed()).cloned().unwrap_or_default()
    }

    /// The event that a review means by run and entry.
    pub fn event(&self, run: usize, entry: usize) -> Option<&BatchEvent> {
        self.runs.get(run)?.events.get(entry)
    }
}

fn replayed(
    layout: &Layout,
    sections: &SectionIndex,
    train: TrainId,
    runs: &[BatchRun],
    rhythms: &[PollTimingEstimator],
    lengths: &SurveyTest,
) -> MotionReplay {
    let own = || runs.iter().zip(rhythms).filter(|(run, _)| run.train == train);
    let mut replay = MotionReplay::empty(train, highest(own().map(|(run, _)| run)));
    for (run, rhythm) in own() {
        let begin = RunBegin {
            recording: &run.recording,
            is_live: run.is_live,
            is_shared: run.is_shared,
            step: run.step,
            began_at: run.began_at,
        };
        let events = run.accepted().map(|event| (event.event, event.was_lost_before));
        replay.take_run(layout, sections, begin, events, rhythm);
    }
    replay.end(sections, lengths);
    replay
}

/// What a train did among the events of a run that others moved in, too, with those that a person has excluded.
fn own_batch_events(
    layout: &Layout,
    assigned: &AssignedDetections,
    train: TrainId,
    events: &[BatchEvent],
) -> Vec<BatchEvent> {
    let accepted = events.iter().filter(|event| !event.excluded).map(|event| &event.event);
    let mut lost = own_events(layout, assigned, train, accepted).map(|(_, was_lost)| was_lost);
    let own = events
        .iter()
        .filter_map(|event| Some(BatchEvent { event: assigned.own(layout, train, &event.event)?, ..*event }));
    own.map(|event| BatchEvent {
        was_lost_before: !event.excluded && lost.next().unwrap_or_default(),
        ..event
    })
    .collect()
}

/// The highest step of the train's decoder: of the kinds there are the smallest that has all steps seen.
fn highest<'r>(runs: impl Iterator<Item = &'r BatchRun>) -> SpeedStep {
    let commanded = |run: &BatchRun| {
        let steps = run.events.iter().filter_map(|event| match event.event.kind {
            EventKind::Speed { train, step } if train == run.train => Some(step),
            _ => None,
        });
        steps.max().unwrap_or_default().max(run.step)
    };
    let seen = runs.map(commanded).max().unwrap_or_default();
    DecoderSteps::with(seen).highest()
}

fn batch_run(
    recording: &str,
    is_live: bool,
    run: &Run,
    events: Vec<BatchEvent>,
    wanted: Option<TrainId>,
) -> Result<Option<BatchRun>, BatchError> {
    let only = match (run.reported_train(), run.moving().as_slice()) {
        (Some(only), _) => only,
        (None, []) => return Ok(None),
        (None, several) => {
            return Err(BatchError::SeveralTrains {
                recording: recording.to_owned(),
                run: run.id,
                trains: several.iter().map(|at_start| at_start.train).collect(),
            });
        }
    };
    Ok(wanted
        .is_none_or(|wanted| wanted == only.train)
        .then(|| BatchRun::of(recording, is_live, run, only, events)))
}

/// Learns the rhythm in which a link was polled from the runs of its recording.
pub(crate) fn poll_rhythm<'e, R>(runs: impl Iterator<Item = R>) -> PollTimingEstimator
where
    R: Iterator<Item = &'e Event>,
{
    let mut timing = PollTimingEstimator::default();
    let mut last = Timestamp::ZERO;
    for run in runs {
        timing.restart();
        for event in run {
            match event.kind {
                EventKind::Sensor(_) => timing.report(event.time),
                EventKind::Freed(_) | EventKind::Stopped { .. } => {}
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
