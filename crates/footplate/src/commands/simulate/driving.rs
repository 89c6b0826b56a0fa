//! `footplate simulate driving`: random trains calibrated and driven in the simulator, and scored by its truth.

use std::io::Write;
use std::num::NonZeroUsize;

use clap::Args;
use footplate_core::TimeSpan;
use footplate_eval::driving::{Page, ScoredTrain, score};
use footplate_eval::seeds::Seeds;
use footplate_sim::LawFamily;
use footplate_store::layout_named;

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::score_form::ScoreForm;
use crate::counted::counted;
use crate::link::law_named;
use crate::spread::each;

/// Calibrate random trains from nothing known, drive them to exact stops, and score both by the truth.
///
/// Each seed is six trains, one for each law of speed change. Beside the calibrated driver the same world is driven by
/// one that knows the truth, and as published course projects drive. A train that comes to grief is a failed check: its
/// seed is named, with the command that runs only that train again.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate driving --seeds 1..5 --markdown")]
pub(super) struct Arguments {
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = TRACK_A)]
    layout: String,
    /// The seed of the trains, or of many: 1..30.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    seeds: Seeds,
    /// Only trains with this law of speed change.
    #[arg(long, value_parser = law_named)]
    law: Option<LawFamily>,
    /// Track time that a calibration may take, in seconds.
    #[arg(long, value_name = "S", default_value_t = 300, value_parser = clap::value_parser!(u16).range(30..=3600))]
    budget: u16,
    #[command(flatten)]
    form: ScoreForm,
    /// How many trains at once; without it, as many as there are cores. The result is the same.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

/// The layout where none is named.
const TRACK_A: &str = "track-a";

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = layout_named(&self.layout)?.layout;
        let seeds = self.seeds.iter();
        let jobs: Vec<(u64, LawFamily)> = seeds
            .flat_map(|seed| LawFamily::ALL.map(|law| (seed, law)))
            .filter(|(_, law)| self.is_asked(*law))
            .collect();
        let budget = TimeSpan::from_s(f64::from(self.budget));
        let trains = each("driving", &jobs, self.threads, |(seed, law)| score(&layout, *seed, *law, budget))?;
        let page = Page { trains: &trains, asked: self.asked() };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = trains.iter().filter_map(|train| self.failure(train)).collect();
        Ok(name_failed(&failed))
    }

    fn is_asked(&self, law: LawFamily) -> bool {
        self.law.is_none_or(|only| only == law)
    }

    /// What went wrong with a train that we drove: how others drive it is no check of ours.
    fn failure(&self, train: &ScoredTrain) -> Option<FailedRun> {
        let incidents = train.faults();
        (incidents > 0).then(|| {
            let (seed, law) = (train.seed, train.law);
            let mut again = format!("simulate driving --seed {seed} --law {law} --budget {}", self.budget);
            if self.layout != TRACK_A {
                again += &format!(" --layout {}", self.layout);
            }
            let what = format!("seed {seed}, law {law}: {} on the way", counted(incidents, "incident"));
            FailedRun { what, again }
        })
    }

    /// What was asked for, as on the command line.
    fn asked(&self) -> String {
        let mut asked = format!("--seeds {} --markdown", self.seeds.written());
        if let Some(law) = self.law {
            asked = format!("--law {law} {asked}");
        }
        if self.layout != TRACK_A {
            asked = format!("--layout {} {asked}", self.layout);
        }
        if self.budget != 300 {
            asked = format!("--budget {} {asked}", self.budget);
        }
        asked
    }
}
