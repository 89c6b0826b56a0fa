//! The layout, the seeds and the calibrations of a score, and the command that repeats it.

use std::num::NonZeroUsize;

use clap::Args;
use footplate_core::TimeSpan;
use footplate_core::track::Layout;
use footplate_eval::seeds::Seeds;
use footplate_store::layout_named;

use crate::spread::each;

/// The layout where none is named.
const TRACK_A: &str = "track-a";

/// What is the same for all runs of a score; a calibration may take `BUDGET_S` seconds unless another time is given.
#[derive(Debug, Clone, Args)]
pub(super) struct Series<const BUDGET_S: u16 = 300> {
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = TRACK_A)]
    pub(super) layout: String,
    /// The seed of a world, or of many: 1..30.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    pub(super) seeds: Seeds,
    // Clap keeps one default for all `BUDGET_S`.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u16).range(30..=3600),
          help = format!("Track time that each calibration may take, in seconds [default: {BUDGET_S}]"))]
    budget: Option<u16>,
    /// How many runs at once; without it, as many as there are cores. The result is the same.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

impl<const BUDGET_S: u16> Series<BUDGET_S> {
    /// Reads the layout.
    ///
    /// # Errors
    /// There is no such layout, or it is invalid.
    pub(super) fn layout(&self) -> anyhow::Result<Layout> {
        Ok(layout_named(&self.layout)?.layout)
    }

    /// Track time that each calibration may take.
    pub(super) fn budget(&self) -> TimeSpan {
        TimeSpan::from_s(f64::from(self.budget.unwrap_or(BUDGET_S)))
    }

    /// Does `work` for each job on several threads; `what` is shown beside the bar.
    pub(super) fn each<J: Sync, T: Send>(
        &self,
        what: &'static str,
        jobs: &[J],
        work: impl Fn(&J) -> anyhow::Result<T> + Sync,
    ) -> anyhow::Result<Vec<T>> {
        each(what, jobs, self.threads, work)
    }

    /// Scores every seed with the layout and the time that a calibration may take.
    pub(super) fn score<T: Send>(
        &self,
        what: &'static str,
        score: impl Fn(&Layout, u64, TimeSpan) -> anyhow::Result<T> + Sync,
    ) -> anyhow::Result<Vec<T>> {
        let layout = self.layout()?;
        let seeds: Vec<u64> = self.seeds.iter().collect();
        self.each(what, &seeds, |seed| score(&layout, *seed, self.budget()))
    }

    /// The arguments of the command line; `own` are those of the scorer, each after a space.
    pub(super) fn asked(&self, own: &str) -> String {
        format!("--seeds {}{own}{} --markdown", self.seeds.written(), self.settings())
    }

    /// The command that repeats one seed of a scorer.
    pub(super) fn again(&self, scorer: &str, seed: u64, own: &str) -> String {
        format!("simulate {scorer} --seed {seed}{own}{}", self.settings())
    }

    fn settings(&self) -> String {
        let mut settings = String::new();
        if self.layout != TRACK_A {
            settings += &format!(" --layout {}", self.layout);
        }
        if let Some(budget) = self.budget.filter(|budget| *budget != BUDGET_S) {
            settings += &format!(" --budget {budget}");
        }
        settings
    }
}
