//! `footplate simulate disasters`: something happens to trains, and what becomes of them is scored by the truth.

use std::io::Write;

use clap::Args;
use footplate_eval::disasters::{Page, Scored, score};

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::score_form::ScoreForm;
use super::series::Series;

/// Exchange engines, soil wheels, restart the station, lift trains: and see what a watched driver makes of it.
///
/// Each seed is a layout with its trains, on which everything happens in turn, each time as if nothing had happened before,
/// and once nothing at all.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate disasters --seeds 1..5 --markdown")]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series<240>,
    #[command(flatten)]
    form: ScoreForm,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let scored = self.series.score("disasters", score)?;
        let page = Page { scored: &scored, asked: self.series.asked("") };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = scored.iter().flat_map(|scored| self.failures(scored)).collect();
        Ok(name_failed(&failed))
    }

    /// What came to grief, or was not noticed although something had happened.
    fn failures(&self, scored: &Scored) -> Vec<FailedRun> {
        let failed = scored.failures().into_iter().map(|trouble| FailedRun {
            what: format!("seed {}, {trouble}", scored.seed),
            again: self.series.again("disasters", scored.seed, ""),
        });
        failed.collect()
    }
}
