//! The inputs of a driving session, as they are recorded: enough to build its script runner again for a replay.

use std::path::Path;

use anyhow::Context;
use footplate_core::control::{Driver, Learning};
use footplate_core::link::TimeModel;
use footplate_core::model::MotionFit;
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, Leg, TurnoutStates};
use footplate_core::{SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_store::{Journal, NewMachine, Schedule, Store};
use serde::{Deserialize, Serialize};

use super::reader::Known;
use super::script::{CommandSource, step};
use super::script_runner::ScriptRunner;
use crate::clock::{local, now_after};
use crate::commands::written_layout::WrittenLayout;
use crate::session_journal::{IfUnkept, PROGRAM, SessionJournal, WhenFull};

/// Everything that a [`ScriptRunner`] is built from, both in a live session and in its replay.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct DriveBeginning {
    pub(super) layout: String,
    /// The known positions of turnouts.
    pub(super) turnouts: Vec<(TurnoutId, Leg)>,
    /// The motion model of each train.
    pub(super) models: Vec<MotionModel>,
    /// The running fits that the session continues.
    pub(super) fits: Vec<MotionFit>,
    #[serde(rename = "giver")]
    pub(super) source: CommandSource,
    /// The lines of the script that are known at the beginning.
    pub(super) script: Vec<String>,
    /// Whether no more lines will come.
    pub(super) is_complete: bool,
    /// The longest wait, in seconds; `None` for the default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) wait_limit_s: Option<f64>,
    /// The saved schedules of the layout.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) schedules: Vec<Schedule>,
    /// The delays of the link; sessions of older versions assumed the slowest link.
    #[serde(default)]
    pub(super) link: TimeModel,
    /// Whether the railway is simulated and ends with its program; absent from sessions of older versions.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) is_simulated: bool,
}

impl DriveBeginning {
    /// The kind of this machine in a store.
    pub(crate) const KIND: &'static str = "drive";

    /// A simulated session whose script arrives line by line, with trains as an earlier session handed them over.
    pub(crate) fn line_by_line(
        written: &WrittenLayout,
        turnouts: &TurnoutStates,
        (models, fits): (Vec<MotionModel>, Vec<MotionFit>),
    ) -> Self {
        Self {
            layout: written.text.clone(),
            turnouts: written.legs(turnouts),
            models,
            fits,
            source: CommandSource::Script,
            script: Vec::new(),
            is_complete: false,
            wait_limit_s: None,
            schedules: Vec::new(),
            link: TimeModel::default(),
            is_simulated: true,
        }
    }

    /// The same with an operator, whose new order replaces the one before.
    pub(crate) fn of_a_person(self) -> Self {
        Self { source: CommandSource::Person, ..self }
    }

    /// Begins a session in the store at `path`, whose journal records it; the clock of the link reads `at` now.
    ///
    /// # Errors
    /// The store cannot be written.
    pub(super) fn journal(
        &self,
        path: &Path,
        layout: &Layout,
        at: Timestamp,
        when_full: WhenFull,
    ) -> anyhow::Result<SessionJournal> {
        let store = Store::open_or_create(path)?;
        let now = now_after(store.newest_stamp()?);
        let began_at = Some(now + (Timestamp::ZERO - at));
        let name = format!("drive {}", local(now));
        let mut journal = Journal::begin(store, &name, layout.name(), began_at, &[], now)?;
        let body = serde_json::to_string(self)?;
        journal.begin_machine(NewMachine { kind: Self::KIND, program: PROGRAM, body: &body }, now)?;
        Ok(SessionJournal::start(journal, began_at, when_full, IfUnkept::Stop)?)
    }

    pub(crate) fn layout(&self) -> &str {
        &self.layout
    }

    /// Builds the script runner.
    ///
    /// # Errors
    /// The layout or a line of the script is invalid.
    pub(crate) fn script_runner(self) -> anyhow::Result<ScriptRunner> {
        let layout = WrittenLayout::of("the layout of the session", self.layout)?.layout;
        let highest = self.models.iter().map(|model| (model.train(), model.highest()));
        let highest: std::collections::BTreeMap<TrainId, SpeedStep> = highest.collect();
        let known = Known { layout: &layout, trains: &highest, schedules: &self.schedules };
        let mut steps = Vec::new();
        for line in &self.script {
            let read = step(line, known).map_err(|mistake| anyhow::anyhow!("{mistake}"));
            steps.extend(read.with_context(|| format!("the line `{line}` of the script"))?);
        }
        let mut driver = Driver::new(layout.clone(), self.turnouts.into_iter().collect());
        driver.set_link(self.link);
        self.models.into_iter().for_each(|model| driver.add_train(model));
        let mut script_runner =
            ScriptRunner::new(driver, Learning::new(&layout, self.fits), self.source, steps);
        script_runner.set_saved(self.schedules);
        if let Some(seconds) = self.wait_limit_s {
            script_runner.set_wait_limit(TimeSpan::from_s(seconds));
        }
        if self.is_complete {
            script_runner.complete();
        }
        Ok(script_runner)
    }
}
