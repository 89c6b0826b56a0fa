//! The running demo: railway, clock, journal and display.

use std::io;
use std::time::Duration;

use footplate_core::control::Machine;
use footplate_core::{SpeedStep, Timestamp, TrainId};
use footplate_store::{Journal, MotionFile, TrainAtStart};
use serde::Serialize;
use serde_json::json;

use super::outcome::{Learnt, LearntStep, MadeStop};
use super::railway::{Railway, SharedRecord};
use super::screen::{Screen, TrainPicture};
use crate::clock::{Stopwatch, now};
use crate::commands::calibrate::minutes;
use crate::dashboard::ReadOnlyDashboard;
use crate::link::Speed;
use crate::session_journal::{Scribe, SessionJournal};

/// The running demo.
pub(super) struct Demo<'r, 'l, 'o> {
    pub(super) railway: Railway<'r, 'l>,
    pub(super) screen: Screen<'o>,
    stopwatch: Stopwatch,
    speed: Speed,
    record: SharedRecord,
    pictures: Vec<TrainPicture>,
    /// Faults that have been reported.
    faults_reported: usize,
    broken: bool,
    pub(super) learnt: Vec<Learnt>,
    /// Models to store with the session.
    pub(super) models: Vec<MotionFile>,
    pub(super) stops: Vec<MadeStop>,
    /// The dashboard.
    pub(super) dashboard_view: Option<ReadOnlyDashboard>,
}

/// The answer to commands from the dashboard.
const DRIVES_ITSELF: &str = "the demonstration runs by itself: use `footplate serve` to command trains";

impl<'r, 'l, 'o> Demo<'r, 'l, 'o> {
    pub(super) fn new(
        railway: Railway<'r, 'l>,
        screen: Screen<'o>,
        speed: Speed,
        record: SharedRecord,
        trains: &[TrainId],
    ) -> Self {
        let pictures = trains.iter().map(|train| TrainPicture::waiting(*train, "waits")).collect();
        let (learnt, stops) = (Vec::new(), Vec::new());
        let stopwatch = Stopwatch::start();
        Self {
            railway,
            screen,
            stopwatch,
            speed,
            record,
            pictures,
            faults_reported: 0,
            broken: false,
            learnt,
            models: Vec::new(),
            stops,
            dashboard_view: None,
        }
    }

    pub(super) fn now(&self) -> Timestamp {
        self.railway.now()
    }

    /// Real time since the start.
    pub(super) fn wall(&self) -> Duration {
        self.stopwatch.elapsed()
    }

    /// Whether a fault occurred that only an operator could correct.
    pub(super) const fn is_broken(&self) -> bool {
        self.broken
    }

    /// Runs one turn of the loop; returns its notices.
    pub(super) fn advance<M: Machine>(&mut self, machine: &mut M) -> anyhow::Result<Vec<M::Notice>> {
        let notices = self.railway.advance(machine)?;
        let now = self.now();
        if self.dashboard_view.as_mut().is_some_and(|dashboard| dashboard.is_halted(now, DRIVES_ITSELF)) {
            anyhow::bail!("emergency stop from the dashboard: all trains stopped, track power off");
        }
        self.report_faults()?;
        let acknowledged = self.record.0.borrow().journal.as_ref().map(SessionJournal::acknowledged);
        if let Some(acknowledged) = acknowledged {
            self.screen.acknowledged(acknowledged)?;
        }
        if self.screen.is_due() {
            self.draw()?;
        }
        Ok(notices)
    }

    /// Makes a train the active one.
    pub(super) fn set_active(&mut self, train: TrainId, activity: &str, detail: &str) {
        for picture in &mut self.pictures {
            picture.is_active = picture.train == train;
            if picture.train == train {
                picture.activity = activity.to_owned();
                picture.detail = detail.to_owned();
            }
        }
    }

    /// Makes a train inactive.
    pub(super) fn set_idle(&mut self, train: TrainId, activity: &str) {
        if let Some(picture) = self.picture_of(train) {
            picture.is_active = false;
            picture.activity = activity.to_owned();
            picture.detail = String::new();
        }
    }

    /// Updates the display of a train.
    pub(super) fn set_detail(&mut self, train: TrainId, detail: &str, steps: Option<Vec<LearntStep>>) {
        if let Some(picture) = self.picture_of(train) {
            picture.detail = detail.to_owned();
            if let Some(steps) = steps {
                picture.steps = steps;
            }
        }
    }

    /// Reports a calibration.
    pub(super) fn learnt(&mut self, learnt: Learnt) -> io::Result<()> {
        self.set_detail(learnt.train, "", Some(learnt.steps.clone()));
        self.publish(&learnt.sentence());
        self.screen.learnt(&learnt)?;
        self.learnt.push(learnt);
        Ok(())
    }

    /// Reports a stop.
    pub(super) fn stopped(&mut self, stop: MadeStop) -> io::Result<()> {
        self.publish(&stop.sentence());
        self.screen.stopped(&stop)?;
        self.stops.push(stop);
        Ok(())
    }

    /// Prints a line on the dashboard.
    fn publish(&self, text: &str) {
        if let Some(dashboard_view) = &self.dashboard_view {
            dashboard_view.say(self.now(), text);
        }
    }

    /// Begins a run of the journal in which only this train takes part.
    pub(super) fn begin_run(&mut self, train: TrainId) {
        if let Some(journal) = &mut self.record.0.borrow_mut().journal {
            journal.begin_run(&[TrainAtStart { train, step: SpeedStep::STAND }]);
        }
    }

    /// Begins recording a machine; `None` without a store.
    pub(super) fn begin_machine(
        &mut self,
        kind: &'static str,
        beginning: &impl Serialize,
    ) -> anyhow::Result<Option<Scribe>> {
        let mut record = self.record.0.borrow_mut();
        let Some(journal) = &mut record.journal else { return Ok(None) };
        Ok(journal.begin_machine(kind, serde_json::to_string(beginning)?))
    }

    /// Ends the session and writes the journal out.
    pub(super) fn end(&mut self) -> anyhow::Result<()> {
        self.screen.clear()?;
        self.railway.close();
        let journal = self.record.0.borrow_mut().journal.take();
        if let Some(journal) = journal {
            let (kept, journal) = journal.finish();
            self.screen.acknowledged(kept.acknowledged)?;
            if let Some(trouble) = kept.trouble {
                anyhow::bail!("the session was not recorded completely: {trouble}");
            }
            if let Some(mut store) = journal.map(Journal::end) {
                for model in &self.models {
                    model.keep(&mut store, now(), now())?;
                }
            }
        }
        Ok(())
    }

    fn picture_of(&mut self, train: TrainId) -> Option<&mut TrainPicture> {
        self.pictures.iter_mut().find(|picture| picture.train == train)
    }

    fn report_faults(&mut self) -> io::Result<()> {
        let new: Vec<_> =
            self.railway.world().incidents().iter().skip(self.faults_reported).copied().collect();
        for fault in new {
            self.faults_reported += 1;
            self.broken = true;
            self.screen
                .record(&json!({ "mishap": fault.to_string(), "train": fault.train.map(|train| train.0) }))?;
            self.screen.mention(&format!("  {fault}"))?;
        }
        Ok(())
    }

    fn draw(&mut self) -> io::Result<()> {
        let speed = match self.speed {
            Speed::Unpaced => "as fast as it goes".to_owned(),
            Speed::Times(times) => format!("{times:.0} × real time"),
        };
        let session = format!(
            "{} on the railway's clock, {speed}; {} events",
            minutes(self.now() - Timestamp::ZERO),
            self.record.0.borrow().events
        );
        self.screen.picture(&session, &self.pictures)
    }
}
