//! How a train moves, learnt anew from recordings: from what a store has kept, or from files.
//!
//! The events are the truth and a model is what follows from them, so a session that was killed loses nothing: the next one
//! replays what was written down and goes on from there. Events that a person has excluded are left out, and where a run
//! ends the chain of what the train did is broken.
//!
//! A fit to hours of running takes its time, and most of what is replayed has been replayed before. So the store keeps how far
//! the last replay came behind its last run, with a fingerprint of all that it follows from: the next one goes on from there,
//! to the same numbers to the last bit. Where anything differs, be it one excluded event, all is replayed.

mod fingerprint;
mod run_reader;

use fingerprint::Fingerprint;
use footplate_core::link::PollTimingEstimator;
use footplate_core::model::StepUse;
use footplate_core::model::survey::{LayoutTest, SectionIndex, SurveyTest};
use footplate_core::model::{MotionFit, StepChanges};
use footplate_core::track::{DirectionFinder, Layout, Leg, TurnoutStates};
use footplate_core::{Approach, Event, EventKind, RunId, SpeedStep, TimeSpan, Timestamp, TrainId};
use run_reader::RunReader;
use serde::{Deserialize, Serialize};

use crate::batch::poll_rhythm;
use crate::recording::{Run, TrainAtStart};
use crate::recording_names::distinct_names;
use crate::speed_profile::SpeedProfile;
use crate::store::{AssignedDetections, KeptReplay, RecordingKey, Store, StoreError};

/// How often the model is fitted anew during a replay, at starts from rest: what is thought of a command depends on whether the
/// train stood, and so on how fast it is known to stop.
const REFIT_AFTER: TimeSpan = TimeSpan::from_ms(20_000);

/// A recording that begins so long after the last one ended is of another session: engines have cooled down by then. Those
/// that have no date count as one session with the one before.
const ANOTHER_SESSION: TimeSpan = TimeSpan::from_ms(3_600_000);

/// What sessions reported of one train.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MotionReplay {
    /// What follows from it, fitted.
    pub fit: MotionFit,
    /// The file of the speed profile that the fit began with, if one was imported.
    #[serde(default)]
    pub profile: Option<String>,
    /// How the turnouts lay at the end of the last live session, as far as it was recorded.
    pub turnouts: TurnoutStates,
    /// How those of the present recording lie, if it was read from a file.
    turnouts_of_file: TurnoutStates,
    /// Sessions in which the train was driven, by name.
    pub recordings: Vec<String>,
    /// Runs that were used.
    pub runs: usize,
    /// Commands to the train and reports that were used.
    pub events: usize,
    /// When the last of them was, since the Unix epoch, where the runs tell.
    pub newest: Option<Timestamp>,
    /// Runs that were not used: other trains moved, too, and no session has said which detections were of which train.
    pub left_out: Vec<(String, RunId)>,
}

impl MotionReplay {
    /// Replays everything that a store held at a date of a train on a layout; `highest` is the highest step of its
    /// decoder. Recordings that were read from files count as well. The fit begins with the profile of another program, if one was
    /// imported for the train.
    ///
    /// It goes on from where the last replay of the train came, if nothing of that has changed, and keeps how far it came.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn of_store(
        layout: &Layout,
        store: &mut Store,
        train: TrainId,
        highest: SpeedStep,
        as_of: Timestamp,
    ) -> Result<Self, StoreError> {
        let profile = store.profile(train, as_of)?;
        let runs = Self::stored_runs(layout, store, as_of)?;
        let mut fingerprint = Fingerprint::of(layout, train, highest, profile.as_ref());
        let behind: Vec<Fingerprint> = runs
            .iter()
            .map(|stored| {
                fingerprint = fingerprint.with(&stored.recording, &stored.run, stored.rhythm.timing());
                fingerprint
            })
            .collect();
        let (mut replay, gone) = match Self::kept(store, layout, train, &behind)? {
            Some(kept) => kept,
            None => (Self::beginning(train, highest, profile.as_ref()), 0),
        };
        let sections = SectionIndex::of(layout);
        replay.take_all(layout, &sections, store, runs.get(gone..).unwrap_or_default())?;
        if !replay.is_empty() && gone < runs.len() {
            replay.keep(store, layout, fingerprint);
        }
        replay.end(&sections, &lengths_of(layout, &sections, &runs));
        Ok(replay)
    }

    /// The same with another profile in the place of the one in the store, to see what it would change. Writes nothing.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn with_profile(
        layout: &Layout,
        store: &Store,
        profile: Option<&SpeedProfile>,
        train: TrainId,
        highest: SpeedStep,
        as_of: Timestamp,
    ) -> Result<Self, StoreError> {
        let mut replay = Self::beginning(train, highest, profile);
        let sections = SectionIndex::of(layout);
        let runs = Self::stored_runs(layout, store, as_of)?;
        replay.take_all(layout, &sections, store, &runs)?;
        replay.end(&sections, &lengths_of(layout, &sections, &runs));
        Ok(replay)
    }

    fn stored_runs(
        layout: &Layout,
        store: &Store,
        as_of: Timestamp,
    ) -> Result<Vec<StoredReplayRun>, StoreError> {
        let mut runs: Vec<StoredReplayRun> = Vec::new();
        let mut recordings = store.recordings(as_of)?;
        recordings.retain(|stored| stored.layout == layout.name());
        let names = distinct_names(recordings.iter().map(|stored| stored.name.as_str()));
        for (recording, name) in recordings.iter().zip(&names) {
            let accepted: Vec<Run> =
                store.runs(recording.key, as_of)?.iter().map(crate::StoredRun::accepted).collect();
            let rhythm = poll_rhythm(accepted.iter().map(|run| run.events.iter().map(|raw| &raw.event)));
            let of = |run: Run| StoredReplayRun {
                key: recording.key,
                recording: name.clone(),
                is_live: recording.is_live(),
                moving: run.moving(),
                run,
                rhythm: rhythm.clone(),
            };
            runs.extend(accepted.into_iter().map(of));
        }
        Ok(runs)
    }

    /// Fits to all that was taken in, and counts the lengths of the layout for no more than a test of them allows: by the times from
    /// sensor to sensor, or by the path lengths of the train where those tell nothing.
    pub(crate) fn end(&mut self, sections: &SectionIndex, lengths: &SurveyTest) {
        self.fit.widen_by_lengths(lengths.clone());
        self.fit.refit(sections);
        if lengths.is_passed() {
            let own = SurveyTest::of(sections, self.fit.model().sections());
            if !own.is_passed() {
                self.fit.widen_by_lengths(own);
                self.fit.refit(sections);
            }
        }
        self.note_steps();
    }

    /// How far the last replay came, and behind how many of the runs that was; `behind` are their fingerprints.
    fn kept(
        store: &Store,
        layout: &Layout,
        train: TrainId,
        behind: &[Fingerprint],
    ) -> Result<Option<(Self, usize)>, StoreError> {
        let Some(kept) = store.kept_replay(train, layout.name())? else { return Ok(None) };
        let Some(last) = behind.iter().position(|of| of.to_string() == kept.of) else { return Ok(None) };
        Ok(serde_json::from_str(&kept.body).ok().map(|replay| (replay, last + 1)))
    }

    fn keep(&self, store: &mut Store, layout: &Layout, of: Fingerprint) {
        let Ok(body) = serde_json::to_string(self) else { return };
        let kept = KeptReplay { of: of.to_string(), body };
        // Where it cannot be kept, because another program is writing, the next replay takes as long as this one did.
        let _ = store.keep_replay(self.fit.model().train(), layout.name(), &kept);
    }

    /// Nothing taken in yet.
    pub(crate) fn empty(train: TrainId, highest: SpeedStep) -> Self {
        Self::beginning(train, highest, None)
    }

    fn beginning(train: TrainId, highest: SpeedStep, profile: Option<&SpeedProfile>) -> Self {
        let mut fit = MotionFit::new(train, highest);
        if let Some(profile) = profile {
            fit.take_stated(&profile.stated().0);
        }
        Self {
            fit,
            profile: profile.map(|profile| profile.source.clone()),
            turnouts: TurnoutStates::unknown(),
            turnouts_of_file: TurnoutStates::unknown(),
            recordings: Vec::new(),
            runs: 0,
            events: 0,
            newest: None,
            left_out: Vec::new(),
        }
    }

    /// Whether anything was found.
    pub const fn is_empty(&self) -> bool {
        self.runs == 0
    }

    /// A step at which sensors were passed moves the train. Those at which it stalled show by themselves when they are
    /// tried again.
    fn note_steps(&mut self) {
        for step in (1..=self.fit.model().highest().get()).filter_map(SpeedStep::new) {
            let passed = |approach| self.fit.model().speed(step, approach).count > 0;
            if passed(Approach::Below) || passed(Approach::Above) {
                self.fit.note_use(step, StepUse::Moves);
            }
        }
    }

    /// Takes in runs in order.
    fn take_all(
        &mut self,
        layout: &Layout,
        sections: &SectionIndex,
        store: &Store,
        runs: &[StoredReplayRun],
    ) -> Result<(), StoreError> {
        let train = self.fit.model().train();
        for of_recording in runs.chunk_by(|one, next| one.key == next.key) {
            let shared = of_recording.iter().find(|stored| stored.is_live && stored.is_shared(train));
            let assigned = match shared {
                Some(shared) => store.assigned_detections(layout, shared.key)?,
                None => AssignedDetections::default(),
            };
            of_recording.iter().for_each(|stored| self.take_stored(layout, sections, stored, &assigned));
        }
        Ok(())
    }

    fn take_stored(
        &mut self,
        layout: &Layout,
        sections: &SectionIndex,
        stored: &StoredReplayRun,
        assigned: &AssignedDetections,
    ) {
        let StoredReplayRun { recording, is_live, moving, run, rhythm, .. } = stored;
        let train = self.fit.model().train();
        let own = moving.iter().find(|at_start| at_start.train == train);
        let events = || run.events.iter().map(|raw| &raw.event);
        let begin = |step, is_shared| RunBegin {
            recording,
            is_live: *is_live,
            is_shared,
            step,
            began_at: run.began_at,
        };
        match own {
            Some(own) if !stored.is_shared(train) => {
                let events = events().map(|event| (*event, false));
                self.take_run(layout, sections, begin(own.step, false), events, rhythm);
            }
            Some(own) if assigned.knows(train) => {
                let own_events = own_events(layout, assigned, train, events());
                self.take_run(layout, sections, begin(own.step, true), own_events, rhythm);
            }
            own => {
                if own.is_some() {
                    self.left_out.push((recording.clone(), run.id));
                }
                if *is_live {
                    events().for_each(|event| note_turnout(&mut self.turnouts, event));
                }
            }
        }
    }

    /// Takes in what the train did in a run: how that began, the events that concern the train, in order and less those that a person
    /// excluded, each with whether the train was lost before it, and the rhythm of the link.
    pub(crate) fn take_run(
        &mut self,
        layout: &Layout,
        sections: &SectionIndex,
        begin: RunBegin<'_>,
        events: impl Iterator<Item = (Event, bool)>,
        rhythm: &PollTimingEstimator,
    ) {
        let train = self.fit.model().train();
        if self.recordings.last().is_none_or(|last| last != begin.recording) {
            let last = self.newest.zip(begin.began_at);
            if last.is_some_and(|(newest, began)| began - newest >= ANOTHER_SESSION) {
                self.fit.begin_session(sections);
            }
            self.recordings.push(begin.recording.to_owned());
            self.turnouts_of_file = TurnoutStates::unknown();
        }
        self.runs += 1;
        self.fit.begin_run(begin.step);
        let turnouts = if begin.is_live { &mut self.turnouts } else { &mut self.turnouts_of_file };
        let mut reader = RunReader::new(train, begin.step);
        let mut fitted: Option<Timestamp> = None;
        let mut changes = StepChanges::default();
        let mut directions = DirectionFinder::default();
        for (event, was_lost) in events {
            note_turnout(turnouts, &event);
            let Some(read) = reader.take(&event, rhythm.timing()) else { continue };
            if begin.is_shared && is_left_out(&mut self.fit, &read.event, &mut changes) {
                continue;
            }
            // A session that drove several trains has already found where each of them passed.
            let found = match begin.is_shared {
                true => Some(read.event),
                false => directions.take(layout, turnouts, train, &read.event),
            };
            let time = read.event.time;
            let starts = matches!(read.event.kind, EventKind::Speed { step, .. } if step != SpeedStep::STAND);
            if starts && time - *fitted.get_or_insert(time) >= REFIT_AFTER {
                fitted = Some(time);
                self.fit.refit(sections);
            }
            if was_lost {
                self.fit.lose_place();
            }
            if read.was_pushed {
                // How long it was stuck says nothing of how it starts and runs.
                self.fit.interrupt();
            }
            if let Some(event) = found {
                self.fit.take(layout, turnouts, &event);
            }
            self.events += 1;
            let at = begin.began_at.map(|began_at| began_at + (time - Timestamp::ZERO));
            self.newest = self.newest.max(at);
        }
    }
}

/// Whether an event is left out because the train changes its step too often; that breaks the chain of what it did, as it does while a
/// session learns.
fn is_left_out(fit: &mut MotionFit, event: &Event, changes: &mut StepChanges) -> bool {
    match event.kind {
        EventKind::Speed { step, .. } => {
            let is_left_out = changes.take(step);
            if is_left_out {
                fit.interrupt();
            }
            is_left_out
        }
        EventKind::Sensor(_) => changes.are_too_many(),
        _ => false,
    }
}

/// What a train did among the events of a run that others moved in, too, each event with whether the train was lost before it.
pub(crate) fn own_events<'e>(
    layout: &Layout,
    assigned: &AssignedDetections,
    train: TrainId,
    events: impl Iterator<Item = &'e Event>,
) -> impl Iterator<Item = (Event, bool)> {
    let mut last = Timestamp::from_ns(i64::MIN);
    events.filter_map(move |event| assigned.own(layout, train, event)).map(move |event| {
        let is_report = matches!(event.kind, EventKind::Sensor(_));
        let before = if is_report { std::mem::replace(&mut last, event.time) } else { event.time };
        (event, assigned.was_lost(train, before, event.time))
    })
}

/// A run as a store keeps it, with the rhythm of the link of its recording.
struct StoredReplayRun {
    key: RecordingKey,
    recording: String,
    is_live: bool,
    moving: Vec<TrainAtStart>,
    run: Run,
    rhythm: PollTimingEstimator,
}

impl StoredReplayRun {
    /// Whether a train moved in it, and others, too.
    fn is_shared(&self, train: TrainId) -> bool {
        self.moving.len() > 1 && self.moving.iter().any(|at_start| at_start.train == train)
    }
}

/// How the lengths of a layout compare with the times from sensor to sensor in some runs.
fn lengths_of(layout: &Layout, sections: &SectionIndex, runs: &[StoredReplayRun]) -> SurveyTest {
    let mut test = LayoutTest::default();
    for StoredReplayRun { moving, run, .. } in runs {
        test.take_run(layout, sections, moving.len(), run.events.iter().map(|raw| &raw.event));
    }
    test.lengths(sections)
}

/// How a run begins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunBegin<'r> {
    /// The recording that it is of.
    pub(crate) recording: &'r str,
    /// Whether that is a live session, after which turnouts lie as they lay.
    pub(crate) is_live: bool,
    /// Whether other trains moved in it, too.
    pub(crate) is_shared: bool,
    /// The step at which the train had been running for long; 0 at rest.
    pub(crate) step: SpeedStep,
    /// When the clock of the run stood at zero, since the Unix epoch.
    pub(crate) began_at: Option<Timestamp>,
}

fn note_turnout(turnouts: &mut TurnoutStates, event: &Event) {
    if let EventKind::Turnout { turnout, curved } = event.kind {
        turnouts.set(turnout, Leg::from_curved(curved));
    }
}
