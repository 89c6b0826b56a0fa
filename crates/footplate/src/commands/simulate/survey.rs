//! `footplate simulate survey`: a layout of which one length is known, surveyed by driving, and scored by the truth.

use std::io::Write;
use std::num::NonZeroUsize;

use anyhow::Context;
use clap::Args;
use footplate_core::TimeSpan;
use footplate_eval::seeds::Seeds;
use footplate_eval::survey::{Page, Surveyed, longest_between_sensors, score};
use footplate_store::layout_named;

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::score_form::ScoreForm;
use crate::counted::counted;
use crate::spread::each;

/// Survey a layout of which one length is known by driving random trains, and score the lengths by the truth.
///
/// All lengths but one are taken from the layout. Each seed is a world with rails of its own; its trains are calibrated one
/// after the other from nothing known, and the lengths follow from all of them together.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate survey --seeds 1..5 --markdown")]
pub(super) struct Arguments {
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = TRACK_A)]
    layout: String,
    /// The seed of the world, or of many: 1..30.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    seeds: Seeds,
    /// How many trains survey it.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=8))]
    trains: u8,
    /// Track time of each train, in seconds.
    #[arg(long, value_name = "S", default_value_t = 450, value_parser = clap::value_parser!(u16).range(30..=3600))]
    budget: u16,
    #[command(flatten)]
    form: ScoreForm,
    /// How many worlds at once; without it, as many as there are cores. The result is the same.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

/// The layout where none is named.
const TRACK_A: &str = "track-a";
impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = layout_named(&self.layout)?.layout;
        let known = longest_between_sensors(&layout)
            .with_context(|| format!("{}: no edge leads from sensor to sensor", self.layout))?;
        let seeds: Vec<u64> = self.seeds.iter().collect();
        let budget = TimeSpan::from_s(f64::from(self.budget));
        let worlds = each("surveying", &seeds, self.threads, |seed| {
            score(&layout, known, self.trains, budget, *seed)
        })?;
        let edge = layout.edges().nth(2 * usize::from(known.0)).map(|(_, edge)| edge);
        let edge = edge.context("the known edge is of this layout")?;
        let known = [edge.from, edge.to].map(|node| layout.node_name(node).to_owned());
        let page = Page { worlds: &worlds, known, asked: self.asked() };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = worlds.iter().filter_map(|world| self.failure(world)).collect();
        Ok(name_failed(&failed))
    }

    fn failure(&self, world: &Surveyed) -> Option<FailedRun> {
        (world.faults > 0).then(|| FailedRun {
            what: format!("seed {}: {} on the way", world.seed, counted(world.faults, "incident")),
            again: format!("simulate survey {}", self.asked_of(&world.seed.to_string())),
        })
    }

    /// What was asked for, as on the command line.
    fn asked(&self) -> String {
        format!("{} --markdown", self.asked_of(self.seeds.written()))
    }

    fn asked_of(&self, seeds: &str) -> String {
        let mut asked = format!("--seeds {seeds}");
        if self.layout != TRACK_A {
            asked = format!("--layout {} {asked}", self.layout);
        }
        if self.trains != 2 {
            asked += &format!(" --trains {}", self.trains);
        }
        if self.budget != 450 {
            asked += &format!(" --budget {}", self.budget);
        }
        asked
    }
}
