//! `footplate simulate zones`: trains are ordered about on a layout with speed restrictions, and their true speeds in these are scored.

use std::io::Write;

use clap::Args;
use footplate_eval::zones::{Page, Scored, score};

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::score_form::ScoreForm;
use super::series::Series;

/// Let calibrated trains run, stop, hold speeds, arrive in time and follow each other over speed restrictions, and score their true speeds there.
///
/// Each seed is a layout with three trains and other restrictions for each of them; zones of its own are not heeded.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate zones --seeds 1..4 --markdown")]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series,
    #[command(flatten)]
    form: ScoreForm,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let scored = self.series.score("zones", score)?;
        let page = Page { scored: &scored, asked: self.series.asked("") };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = scored.iter().filter_map(|scored| self.failure(scored)).collect();
        Ok(name_failed(&failed))
    }

    fn failure(&self, scored: &Scored) -> Option<FailedRun> {
        let (train, trouble) = scored.trouble()?;
        let again = self.series.again("zones", scored.seed, "");
        Some(FailedRun { what: format!("seed {}, train {train}: {trouble}", scored.seed), again })
    }
}
