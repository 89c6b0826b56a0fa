//! `footplate simulate pacing`: trains hold speeds, arrive in time and follow each other, and are scored by the simulator's truth.

use std::io::Write;

use clap::Args;
use footplate_eval::pacing::{Page, Scored, score};

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::score_form::ScoreForm;
use super::series::Series;

/// Let calibrated trains hold speeds that none of their steps has, arrive in time and follow each other, and score them by the truth.
///
/// Each seed is a layout with three trains. What is asked of them is asked of a simpler driver in the same world, too.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate pacing --seeds 1..4 --markdown")]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series,
    #[command(flatten)]
    form: ScoreForm,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let scored = self.series.score("pacing", score)?;
        let page = Page { scored: &scored, asked: self.series.asked("") };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = scored.iter().filter_map(|scored| self.failure(scored)).collect();
        Ok(name_failed(&failed))
    }

    /// What the driver did not carry out, or trains came to grief over: how others drive them is no check of ours.
    fn failure(&self, scored: &Scored) -> Option<FailedRun> {
        let (train, trouble) = scored.troubles().next()?;
        let again = self.series.again("pacing", scored.seed, "");
        Some(FailedRun { what: format!("seed {}, train {train}: {trouble}", scored.seed), again })
    }
}
