//! `footplate simulate disasters`: something happens to trains, and what becomes of them is scored by the truth.

mod attributed;
mod figures;
mod kind;
mod page;
mod scene;

use std::io::Write;
use std::num::NonZeroUsize;

use anyhow::ensure;
use clap::Args;
use footplate_core::track::Layout;
use footplate_core::{TimeSpan, TrainId};
use footplate_sim::LivingSwitches;
use footplate_store::layout_named;

use self::attributed::{Attributed, attributed};
use self::kind::Kind;
use self::page::Page;
use self::scene::{OTHER, Outcomes, Scene, TRAIN};
use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::rehearsal::{Rehearsal, Way};
use super::seeds::Seeds;
use super::written_scores::ScoreForm;
use crate::counted::counted;
use crate::spread::each;

/// A third train, for telling trains apart.
const THIRD: TrainId = TrainId(63);

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

/// All of one seed.
struct Scored {
    seed: u64,
    runs: Vec<(Kind, Outcomes)>,
    /// With how many trains running.
    attributed: Vec<(usize, Attributed)>,
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
        let failed = scored.runs.iter().filter_map(|(kind, run)| {
            let what = if run.mishaps > 0 {
                counted(run.mishaps, "mishap")
            } else if *kind != Kind::Faultless && run.noticed.is_none() {
                "not noticed".to_owned()
            } else {
                return None;
            };
            Some(FailedRun {
                what: format!("seed {}, {}: {what}", scored.seed, kind.says()),
                again: again.clone(),
            })
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

/// Everything that happens to the trains of one seed.
fn score(layout: &Layout, seed: u64, budget: TimeSpan) -> anyhow::Result<Scored> {
    let way = Way::round(layout);
    ensure!(!way.nodes.is_empty(), "no train can run round on this layout with all turnouts straight");
    let trains = [TRAIN, OTHER, THIRD];
    let stage = Rehearsal::prepare(layout, seed, &trains, &LivingSwitches::well_kept(), budget)?;
    let mut runs = Vec::new();
    for (nth, kind) in Kind::ALL.into_iter().enumerate() {
        let asked = seed.wrapping_mul(Kind::ALL.len() as u64).wrapping_add(nth as u64);
        runs.push((kind, Scene::new(layout, &stage, &way, asked)?.run(kind, &way, seed)?));
    }
    let mut counted = Vec::new();
    for count in 2..=trains.len() {
        let running = trains.get(..count).unwrap_or_default();
        counted.push((count, attributed(&stage, &way, running)?));
    }
    Ok(Scored { seed, runs, attributed: counted })
}
