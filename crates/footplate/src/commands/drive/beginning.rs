//! How a session of driving begins, as it is kept: all that its script runner is made of.

use anyhow::Context;
use footplate_core::control::Driver;
use footplate_core::link::TimeModel;
use footplate_core::model::MotionFit;
use footplate_core::model::MotionModel;
use footplate_core::track::{Leg, TurnoutStates};
use footplate_core::{SpeedStep, TimeSpan, TrainId, TurnoutId};
use serde::{Deserialize, Serialize};

use super::learning::Learning;
use super::reader::Known;
use super::script::step;
use super::script_runner::{Giver, ScriptRunner};
use crate::commands::written_layout::WrittenLayout;

/// All that a [`ScriptRunner`] is made of. A session and its replay both make theirs of it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct DriveBeginning {
    /// The text of the layout.
    pub(super) layout: String,
    /// How turnouts lie, as far as that is known.
    pub(super) turnouts: Vec<(TurnoutId, Leg)>,
    /// How each train moves.
    pub(super) models: Vec<MotionModel>,
    /// What trains taught before, to learn on from.
    pub(super) fits: Vec<MotionFit>,
    pub(super) giver: Giver,
    /// Lines that are known from the beginning ...
    pub(super) script: Vec<String>,
    /// ... and whether more may come.
    pub(super) is_complete: bool,
    /// Seconds for which it waits at most, if that was said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) wait_limit_s: Option<f64>,
    /// How long the link takes; sessions of older versions supposed the slowest.
    #[serde(default)]
    pub(super) link: TimeModel,
}

impl DriveBeginning {
    /// The name of such a machine in a store.
    pub(crate) const KIND: &'static str = "drive";

    /// A session whose script arrives line by line, with trains as an earlier session handed them over.
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
            giver: Giver::Script,
            script: Vec::new(),
            is_complete: false,
            wait_limit_s: None,
            link: TimeModel::default(),
        }
    }

    /// The text of the layout.
    pub(crate) fn layout(&self) -> &str {
        &self.layout
    }

    /// The script runner that begins so.
    ///
    /// # Errors
    /// What makes no script runner: the text of the layout, or a line of the script.
    pub(crate) fn script_runner(self) -> anyhow::Result<ScriptRunner> {
        let layout = WrittenLayout::of("the layout of the session", self.layout)?.layout;
        let highest = self.models.iter().map(|model| (model.train(), model.highest()));
        let highest: std::collections::BTreeMap<TrainId, SpeedStep> = highest.collect();
        let known = Known { layout: &layout, trains: &highest };
        let mut steps = Vec::new();
        for line in &self.script {
            let read = step(line, known).map_err(|mistake| anyhow::anyhow!("{mistake}"));
            steps.extend(read.with_context(|| format!("the line `{line}` of the script"))?);
        }
        let mut driver = Driver::new(layout.clone(), self.turnouts.into_iter().collect());
        driver.set_link(self.link);
        self.models.into_iter().for_each(|model| driver.add_train(model));
        let mut script_runner =
            ScriptRunner::new(driver, Learning::new(&layout, self.fits), self.giver, steps);
        if let Some(seconds) = self.wait_limit_s {
            script_runner.set_wait_limit(TimeSpan::from_s(seconds));
        }
        if self.is_complete {
            script_runner.complete();
        }
        Ok(script_runner)
    }
}
