//! Which layout, seeds and calibrations a scorer is asked for, one job for each seed.

use std::num::NonZeroUsize;

use clap::Args;
use footplate_core::TimeSpan;
use footplate_core::track::Layout;
use footplate_store::layout_named;

use crate::spread::each;
use footplate_eval::seeds::Seeds;

/// What is the same for all jobs.
#[derive(Debug, Clone, Args)]
pub(super) struct Series {
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = "track-a")]
    layout: String,
    /// The seed of the trains, or of many: 1..30.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    seeds: Seeds,
    /// Track time that each calibration may take, in seconds.
    #[arg(long, value_name = "S", default_value_t = 300, value_parser = clap::value_parser!(u16).range(30..=3600))]
    budget: u16,
    /// How many seeds at once; without it, as many as there are cores. The result is the same.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

impl Series {
    /// Scores every seed with the layout and the time that a calibration may take; `what` is said beside the bar.
    pub(super) fn score<T: Send>(
        &self,
        what: &'static str,
        score: impl Fn(&Layout, u64, TimeSpan) -> anyhow::Result<T> + Sync,
    ) -> anyhow::Result<Vec<T>> {
        let layout = layout_named(&self.layout)?.layout;
        let seeds: Vec<u64> = self.seeds.iter().collect();
        let budget = TimeSpan::from_s(f64::from(self.budget));
        each(what, &seeds, self.threads, |seed| score(&layout, *seed, budget))
    }

    /// What was asked for, as on the command line.
    pub(super) fn asked(&self) -> String {
        format!("--seeds {}{} --markdown", self.seeds.written(), self.settings())
    }

    /// What asks a scorer for one seed again.
    pub(super) fn again(&self, scorer: &str, seed: u64) -> String {
        format!("simulate {scorer} --seed {seed}{}", self.settings())
    }

    fn settings(&self) -> String {
        let mut settings = String::new();
        if self.layout != "track-a" {
            settings += &format!(" --layout {}", self.layout);
        }
        if self.budget != 300 {
            settings += &format!(" --budget {}", self.budget);
        }
        settings
    }
}
