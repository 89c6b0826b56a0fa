//! `footplate simulate driving`: random trains calibrated and driven in the simulator, and scored by its truth.

use std::io::Write;

use clap::Args;
use footplate_eval::driving::{Page, ScoredTrain, score};
use footplate_sim::LawFamily;

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::seed_scores::ScoreForm;
use super::series::Series;
use crate::link::law_named;

/// Calibrate random trains from nothing known, drive them to exact stops, and score both by the truth.
///
/// Each seed is six trains, one for each law of speed change. Beside the calibrated driver the same world is driven by
/// one that knows the truth, and as published course projects drive. A train that comes to grief is a failed check: its
/// seed is named, with the command that runs only that train again.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate driving --seeds 1..5 --markdown")]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series,
    /// Only trains with this law of speed change.
    #[arg(long, value_parser = law_named)]
    law: Option<LawFamily>,
    #[command(flatten)]
    form: ScoreForm,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = self.series.layout()?;
        let seeds = self.series.seeds.iter();
        let jobs: Vec<(u64, LawFamily)> = seeds
            .flat_map(|seed| LawFamily::ALL.map(|law| (seed, law)))
            .filter(|(_, law)| self.is_asked(*law))
            .collect();
        let budget = self.series.budget();
        let trains = self.series.each("driving", &jobs, |(seed, law)| score(&layout, *seed, *law, budget))?;
        let only = self.law.map_or_else(String::new, |law| format!(" --law {law}"));
        let page = Page { trains: &trains, asked: self.series.asked(&only) };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = trains.iter().filter_map(|train| self.failure(train)).collect();
        Ok(name_failed(&failed))
    }

    fn is_asked(&self, law: LawFamily) -> bool {
        self.law.is_none_or(|only| only == law)
    }

    /// What went wrong with a train that we drove: how others drive it is no check of ours.
    fn failure(&self, train: &ScoredTrain) -> Option<FailedRun> {
        let incidents = train.incidents();
        (!incidents.is_empty()).then(|| {
            let (seed, law) = (train.seed, train.law);
            let again = self.series.again("driving", seed, &format!(" --law {law}"));
            let what = format!("seed {seed}, law {law}: {}", incidents.join("; "));
            FailedRun { what, again }
        })
    }
}
