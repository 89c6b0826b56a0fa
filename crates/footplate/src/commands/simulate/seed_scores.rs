//! `footplate simulate pacing`, `zones` and `disasters`: calibrated trains, with one score for each seed.

use std::io::{self, Write};

use clap::Args;
use footplate_eval::seeds::{FRESH, seeds_sentence};
use footplate_eval::written_scores::WrittenScores;
use footplate_eval::{disasters, pacing, zones};

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::series::Series;

/// The seeds of a score, and its form.
#[derive(Debug, Args)]
pub(super) struct SeedScores<const BUDGET_S: u16 = 300> {
    #[command(flatten)]
    series: Series<BUDGET_S>,
    #[command(flatten)]
    form: ScoreForm,
}

impl<const BUDGET_S: u16> SeedScores<BUDGET_S> {
    pub(super) fn pacing(&self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let scored = self.series.score("pacing", pacing::score)?;
        let failed = self.failed("pacing", scored.iter().map(|scored| (scored.seed, scored.failures())));
        self.form.write(&pacing::Page { scored, asked: self.series.asked("") }, output)?;
        Ok(name_failed(&failed))
    }

    pub(super) fn zones(&self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let scored = self.series.score("zones", zones::score)?;
        let failed = self.failed("zones", scored.iter().map(|scored| (scored.seed, scored.failures())));
        self.form.write(&zones::Page { scored, asked: self.series.asked("") }, output)?;
        Ok(name_failed(&failed))
    }

    pub(super) fn disasters(&self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let scored = self.series.score("disasters", disasters::score)?;
        let failed = self.failed("disasters", scored.iter().map(|scored| (scored.seed, scored.failures())));
        self.form.write(&disasters::Page { scored, asked: self.series.asked("") }, output)?;
        Ok(name_failed(&failed))
    }

    fn failed(&self, scorer: &str, failures: impl Iterator<Item = (u64, Vec<String>)>) -> Vec<FailedRun> {
        let failed = |(seed, failures): (u64, Vec<String>)| {
            let again = self.series.again(scorer, seed, "");
            let runs = failures.into_iter();
            runs.map(move |what| FailedRun { what: format!("seed {seed}, {what}"), again: again.clone() })
        };
        failures.flat_map(failed).collect()
    }
}

/// The form that was asked for; a text for people without a word.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct ScoreForm {
    /// Write the scores as a page of the documentation.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    /// Write the scores as JSON.
    #[arg(long)]
    json: bool,
    /// Write only how often what must not happen did, as rows of a table, each with its 95 % interval (Wilson).
    #[arg(long, conflicts_with_all = ["json", "markdown"])]
    rates: bool,
}

impl ScoreForm {
    pub(super) fn write<S: WrittenScores>(self, scores: &S, output: &mut dyn Write) -> io::Result<()> {
        if self.rates {
            return scores.rates().iter().try_for_each(|rate| writeln!(output, "{}", rate.row(S::SCORER)));
        }
        if self.json {
            return scores.write_json(output);
        }
        if self.markdown {
            let head = scores.head();
            writeln!(output, "{head}\n{}\n", seeds_sentence(head.contains(FRESH)))?;
        }
        scores.write_text(output)
    }
}
