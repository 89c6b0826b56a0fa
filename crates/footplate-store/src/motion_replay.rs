//! How a train moves, learnt anew from what a store has kept of the sessions in which it was driven.
//!
//! The events are the truth and a model is what follows from them, so a session that was killed loses nothing: the next one
//! replays what was written down and goes on from there. Events that a person has excluded are left out, and where a run
//! ends the chain of what the train did is broken.
//!
//! A fit to hours of running takes its time, and most of what is replayed has been replayed before. So the store keeps how far
//! the last replay came behind its last run, with a fingerprint of all that it follows from: the next one goes on from there,
//! to the same numbers to the last bit. Where anything differs, be it one excluded event, all is replayed.

mod fingerprint;

use fingerprint::Fingerprint;
use footplate_core::calibration::SectionIndex;
use footplate_core::calibration::motion::MotionFit;
use footplate_core::calibration::motion::StepUse;
use footplate_core::track::{Layout, Leg, TurnoutStates};
use footplate_core::{Approach, EventKind, RunId, SpeedStep, TimeSpan, Timestamp, TrainId};

use serde::{Deserialize, Serialize};

use crate::recording::Run;
use crate::store::{KeptReplay, Store, StoreError};

/// How often the model is fitted anew on the way, at starts from rest: what is thought of a command depends on whether the
/// train stood, and so on how fast it is known to stop.
const REFIT_AFTER: TimeSpan = TimeSpan::from_ms(20_000);

/// A train that runs and is told one step more when no contact and no command has been for so long was pushed: it had not come
/// where it should, and the calibration took it for stuck. No trip of an experiment takes as long between two of either.
const PUSHED_AFTER: TimeSpan = TimeSpan::from_ms(4_000);

/// What sessions told of one train.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MotionReplay {
    /// What follows from it, fitted.
    pub fit: MotionFit,
    /// How the turnouts lay at the end, as far as was said.
    pub turnouts: TurnoutStates,
    /// Sessions in which the train was driven, by name.
    pub recordings: Vec<String>,
    /// Runs that were used.
    pub runs: usize,
    /// Commands to the train and reports that were used.
    pub events: usize,
    /// When the last of them was, since the Unix epoch, where the runs tell.
    pub newest: Option<Timestamp>,
    /// Runs that were not used: other trains moved, too, and nobody has told their contacts apart.
    pub left_out: Vec<(String, RunId)>,
}

impl MotionReplay {
    /// Replays everything that a store held at a date of a train on a layout; `highest` is the highest step of its
    /// decoder. Recordings that were read from files count as well.
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
        let mut runs: Vec<(String, Run)> = Vec::new();
        for recording in store.recordings(as_of)?.iter().filter(|stored| stored.layout == layout.name()) {
            let stored = store.runs(recording.key, as_of)?;
            runs.extend(stored.iter().map(|run| (recording.name.clone(), run.accepted())));
        }
        let mut fingerprint = Fingerprint::of(layout, train, highest);
        let behind: Vec<Fingerprint> = runs
            .iter()
            .map(|(recording, run)| {
                fingerprint = fingerprint.with(recording, run);
                fingerprint
            })
            .collect();
        let (mut replay, gone) =
            Self::kept(store, layout, train, &behind)?.unwrap_or_else(|| (Self::empty(train, highest), 0));
        let sections = SectionIndex::of(layout);
        for (recording, run) in runs.iter().skip(gone) {
            replay.take(layout, &sections, recording, run);
        }
        if !replay.is_empty() && gone < runs.len() {
            replay.keep(store, layout, fingerprint);
        }
        replay.fit.refit(&sections);
        replay.note_steps(highest);
        Ok(replay)
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

    fn empty(train: TrainId, highest: SpeedStep) -> Self {
        Self {
            fit: MotionFit::new(train, highest),
            turnouts: TurnoutStates::unknown(),
            recordings: Vec::new(),
            runs: 0,
            events: 0,
            newest: None,
            left_out: Vec::new(),
        }
    }

    /// Whether anything was found.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.runs == 0
    }

    /// A step at which contacts were passed moves the train. Those at which it stalled show by themselves when they are
    /// tried again.
    fn note_steps(&mut self, highest: SpeedStep) {
        for step in (1..=highest.get()).filter_map(SpeedStep::new) {
            let passed = |approach| self.fit.model().speed(step, approach).count > 0;
            if passed(Approach::Below) || passed(Approach::Above) {
                self.fit.note_use(step, StepUse::Moves);
            }
        }
    }

    fn take(&mut self, layout: &Layout, sections: &SectionIndex, recording: &str, run: &Run) {
        let mut fitted: Option<Timestamp> = None;
        let (mut told, mut last, mut is_pushed) = (SpeedStep::STAND, Timestamp::ZERO, false);
        let moving: Vec<TrainId> = run.moving().iter().map(|at_start| at_start.train).collect();
        let train = self.fit.model().train();
        self.fit.interrupt();
        let is_own = moving == [train];
        if moving.contains(&train) && !is_own {
            self.left_out.push((recording.to_owned(), run.id));
        }
        for raw in &run.events {
            let is_about_it = match raw.event.kind {
                EventKind::Turnout { turnout, curved } => {
                    self.turnouts.set(turnout, Leg::from_curved(curved));
                    false
                }
                EventKind::Sensor(_) => true,
                EventKind::Speed { train: of, .. }
                | EventKind::Reverse { train: of }
                | EventKind::Stopped { train: of, .. } => of == train,
            };
            if is_own && is_about_it {
                let starts =
                    matches!(raw.event.kind, EventKind::Speed { step, .. } if step != SpeedStep::STAND);
                if starts && fitted.is_none_or(|fitted| raw.event.time - fitted >= REFIT_AFTER) {
                    fitted = Some(raw.event.time);
                    self.fit.refit(sections);
                }
                match raw.event.kind {
                    EventKind::Speed { step, .. } => {
                        let is_one_more = told > SpeedStep::STAND && step.get() == told.get() + 1;
                        is_pushed |= is_one_more && raw.event.time - last >= PUSHED_AFTER;
                        told = step;
                    }
                    // How long it was stuck says nothing of how it starts and runs.
                    EventKind::Sensor(_) if core::mem::take(&mut is_pushed) => self.fit.interrupt(),
                    _ => {}
                }
                last = raw.event.time;
                self.fit.take(layout, &self.turnouts, &raw.event);
                self.events += 1;
                let at = run.began_at.map(|began_at| began_at + (raw.event.time - Timestamp::ZERO));
                self.newest = self.newest.max(at);
            }
        }
        if is_own {
            self.runs += 1;
            if self.recordings.last().is_none_or(|last| last != recording) {
                self.recordings.push(recording.to_owned());
            }
        }
    }
}
