//! `footplate simulate worlds`: promises kept on worlds that the estimator is not built on.

mod figures;
mod page;
mod sessions;
mod timed;
mod world;

use std::io::Write;

use clap::Args;

use self::page::Page;
use self::sessions::{Extent, ScoredWorld, score};
use self::world::WorldName;
use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::seed_scores::ScoreForm;
use super::series::Series;
use crate::commands::written_layout::WrittenLayout;

/// Calibrate a train once, then drive sessions of stops in which it goes on learning, in worlds whose physics are drawn
/// from wide ranges; score each stop against the 95 % promise that was made for it.
///
/// Between sessions the model goes through the text that a store keeps of it, the train cools down, and voltage, load and
/// cleanness change where the world says so.
#[derive(Args)]
#[command(
    after_help = "Example: footplate simulate worlds --seeds 1..4 --world sticky-starts --markdown\n\nWorlds: usual, \
                  asymmetric-sensors, load-and-gradient, sticky-starts, decoder-momentum, warm-up, sessions, \
                  other-laws, interface, second-model, all, early-start"
)]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series,
    /// Only this world; may be repeated. Left out, all of them.
    #[arg(long = "world", value_name = "NAME", value_parser = WorldName::parse)]
    worlds: Vec<WorldName>,
    /// Sessions after the calibration.
    #[arg(long, value_name = "N", default_value_t = SESSIONS, value_parser = clap::value_parser!(u8).range(1..=20))]
    sessions: u8,
    /// Stops in each session.
    #[arg(long, value_name = "N", default_value_t = STOPS, value_parser = clap::value_parser!(u16).range(1..=1000))]
    stops: u16,
    #[command(flatten)]
    form: ScoreForm,
}

/// Sessions in which learning goes on.
const SESSIONS: u8 = 3;
/// Stops in a session: with fewer, a share of 85 % is often chance.
const STOPS: u16 = 30;

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let written = WrittenLayout::named(&self.series.layout)?;
        let names = if self.worlds.is_empty() { WorldName::every() } else { self.worlds.clone() };
        let jobs: Vec<(WorldName, u64)> =
            names.iter().flat_map(|name| self.series.seeds.iter().map(|seed| (*name, seed))).collect();
        let extent = Extent { sessions: self.sessions, stops: self.stops, budget: self.series.budget() };
        let scored =
            self.series.each("worlds", &jobs, |(name, seed)| score(&written, *name, *seed, extent))?;
        let only: String = self.worlds.iter().map(|name| format!(" --world {name}")).collect();
        let page =
            Page { names: &names, worlds: &scored, asked: self.series.asked(&(only + &self.extent())) };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = scored.iter().filter_map(|world| self.failure(world)).collect();
        Ok(name_failed(&failed))
    }

    /// A world in which a train came to grief.
    fn failure(&self, world: &ScoredWorld) -> Option<FailedRun> {
        (!world.incidents.is_empty()).then(|| FailedRun {
            what: format!("seed {}, {}: {}", world.seed, world.name, world.incidents.join("; ")),
            again: self.series.again(
                "worlds",
                world.seed,
                &format!(" --world {}{}", world.name, self.extent()),
            ),
        })
    }

    /// The sessions and stops, as on the command line.
    fn extent(&self) -> String {
        let mut extent = String::new();
        if self.sessions != SESSIONS {
            extent += &format!(" --sessions {}", self.sessions);
        }
        if self.stops != STOPS {
            extent += &format!(" --stops {}", self.stops);
        }
        extent
    }
}
