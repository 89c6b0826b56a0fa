//! `footplate simulate disasters`: something happens to trains, and what becomes of them is scored by the truth.

use std::io::Write;
use std::num::NonZeroUsize;

use clap::Args;
use footplate_core::TimeSpan;
use footplate_eval::disasters::{Page, Scored, score};
use footplate_eval::seeds::Seeds;
use footplate_store::layout_named;

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::score_form::ScoreForm;
use crate::spread::each;

/// Exchange engines, soil wheels, restart the station, lift trains: and see what a watched driver makes of it.
///
/// Each seed is a layout with its trains, on which everything happens in turn, each time as if nothing had happened before,
/// and once nothing at all.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate disasters --seeds 1..5 --markdown")]
pub(super) struct Arguments {
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = "track-a")]
    layout: String,
    /// The seed of the trains, or of many: 1..30.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    seeds: Seeds,
    /// Track time that a calibration may take, in seconds.
    #[arg(long, value_name = "S", default_value_t = 240, value_parser = clap::value_parser!(u16).range(30..=3600))]
    budget: u16,
    #[command(flatten)]
    form: ScoreForm,
    /// How many seeds at once; without it, as many as there are cores. The result is the same.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = layout_named(&self.layout)?.layout;
        let seeds: Vec<u64> = self.seeds.iter().collect();
        let budget = TimeSpan::from_s(f64::from(self.budget));
        let scored = each("disasters", &seeds, self.threads, |seed| score(&layout, *seed, budget))?;
        let page = Page { scored: &scored, asked: self.asked() };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = scored.iter().flat_map(|scored| self.failures(scored)).collect();
        Ok(name_failed(&failed))
    }

    /// What came to grief, or was not noticed although something had happened.
    fn failures(&self, scored: &Scored) -> Vec<FailedRun> {
        let mut again = format!("simulate disasters --seed {}", scored.seed);
        if self.layout != "track-a" {
            again += &format!(" --layout {}", self.layout);
        }
        if self.budget != 240 {
            again += &format!(" --budget {}", self.budget);
        }
        let failed = scored.failures().into_iter().map(|trouble| FailedRun {
            what: format!("seed {}, {trouble}", scored.seed),
            again: again.clone(),
        });
        failed.collect()
    }

    /// What was asked for, as on the command line.
    fn asked(&self) -> String {
        let mut asked = format!("--seeds {} --markdown", self.seeds.written());
        if self.layout != "track-a" {
            asked = format!("--layout {} {asked}", self.layout);
        }
        if self.budget != 240 {
            asked = format!("--budget {} {asked}", self.budget);
        }
        asked
    }
}
