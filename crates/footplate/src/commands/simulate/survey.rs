//! `footplate simulate survey`: a layout of which one length is known, surveyed by driving, and scored by the truth.

use std::io::Write;

use anyhow::Context;
use clap::Args;
use footplate_eval::survey::{Page, Surveyed, longest_between_sensors, score};

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::seed_scores::ScoreForm;
use super::series::Series;

/// Survey a layout of which one length is known by driving random trains, and score the lengths by the truth.
///
/// All lengths but one are taken from the layout. Each seed is a world with rails of its own; its trains are calibrated one
/// after the other from nothing known, and the lengths follow from all of them together.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate survey --seeds 1..5 --markdown")]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series<450>,
    /// How many trains survey it.
    #[arg(long, value_name = "N", default_value_t = TRAINS, value_parser = clap::value_parser!(u8).range(1..=8))]
    trains: u8,
    #[command(flatten)]
    form: ScoreForm,
}

/// Trains that survey a layout.
const TRAINS: u8 = 2;

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = self.series.layout()?;
        let known = longest_between_sensors(&layout)
            .with_context(|| format!("{}: no edge leads from sensor to sensor", self.series.layout))?;
        let worlds = self
            .series
            .score("surveying", |layout, seed, budget| score(layout, known, self.trains, budget, seed))?;
        let edge = layout.edges().nth(2 * usize::from(known.0)).map(|(_, edge)| edge);
        let edge = edge.context("the known edge is of this layout")?;
        let known = [edge.from, edge.to].map(|node| layout.node_name(node).to_owned());
        let page = Page { worlds: &worlds, known, asked: self.series.asked(&self.own()) };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = worlds.iter().filter_map(|world| self.failure(world)).collect();
        Ok(name_failed(&failed))
    }

    fn failure(&self, world: &Surveyed) -> Option<FailedRun> {
        (!world.incidents.is_empty()).then(|| FailedRun {
            what: format!("seed {}: {}", world.seed, world.incidents.join("; ")),
            again: self.series.again("survey", world.seed, &self.own()),
        })
    }

    /// Its own argument, as on the command line.
    fn own(&self) -> String {
        if self.trains == TRAINS { String::new() } else { format!(" --trains {}", self.trains) }
    }
}
