//! `footplate simulate worlds`: promises kept on worlds that the estimator is not built on.

mod figures;
mod page;
mod sessions;
mod timed;
mod world;

use std::io::Write;
use std::num::NonZeroUsize;

use clap::Args;
use footplate_core::TimeSpan;

use self::page::Page;
use self::sessions::{ScoredWorld, score};
use self::world::WorldName;
use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::score_form::ScoreForm;
use crate::commands::written_layout::WrittenLayout;
use crate::counted::counted;
use crate::spread::each;
use footplate_eval::seeds::Seeds;

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
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = TRACK_A)]
    layout: String,
    /// The seed of the worlds, or of many: 1..30.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    seeds: Seeds,
    /// Only this world; may be repeated. Left out, all of them.
    #[arg(long = "world", value_name = "NAME", value_parser = WorldName::parse)]
    worlds: Vec<WorldName>,
    /// Sessions after the calibration.
    #[arg(long, value_name = "N", default_value_t = SESSIONS, value_parser = clap::value_parser!(u8).range(1..=20))]
    sessions: u8,
    /// Stops in each session.
    #[arg(long, value_name = "N", default_value_t = STOPS, value_parser = clap::value_parser!(u16).range(1..=1000))]
    stops: u16,
    /// Track time that the calibration may take, in seconds.
    #[arg(long, value_name = "S", default_value_t = BUDGET_S, value_parser = clap::value_parser!(u16).range(30..=3600))]
    budget: u16,
    #[command(flatten)]
    form: ScoreForm,
    /// How many worlds at once; without it, as many as there are cores. The result is the same.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

/// The layout where none is named.
const TRACK_A: &str = "track-a";
/// Sessions in which learning goes on.
const SESSIONS: u8 = 3;
/// Stops in a session: with fewer, a share of 85 % is often chance.
const STOPS: u16 = 30;
/// Track time of a calibration, in s.
const BUDGET_S: u16 = 300;

/// How long trains are driven in one world.
#[derive(Debug, Clone, Copy)]
struct Extent {
    sessions: u8,
    stops: u16,
    budget: TimeSpan,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let written = WrittenLayout::named(&self.layout)?;
        let names = if self.worlds.is_empty() { WorldName::every() } else { self.worlds.clone() };
        let jobs: Vec<(WorldName, u64)> =
            names.iter().flat_map(|name| self.seeds.iter().map(|seed| (*name, seed))).collect();
        let budget = TimeSpan::from_s(f64::from(self.budget));
        let extent = Extent { sessions: self.sessions, stops: self.stops, budget };
        let scored =
            each("worlds", &jobs, self.threads, |(name, seed)| score(&written, *name, *seed, extent))?;
        let page = Page { names: &names, worlds: &scored, asked: self.asked() };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = scored.iter().filter_map(|world| self.failure(world)).collect();
        Ok(name_failed(&failed))
    }

    /// A world in which a train came to grief.
    fn failure(&self, world: &ScoredWorld) -> Option<FailedRun> {
        (world.incidents > 0).then(|| FailedRun {
            what: format!("seed {}, {}: {}", world.seed, world.name, counted(world.incidents, "incident")),
            again: format!("simulate worlds --seed {} --world {}{}", world.seed, world.name, self.settings()),
        })
    }

    /// What was asked for, as on the command line.
    fn asked(&self) -> String {
        let worlds: String = self.worlds.iter().map(|name| format!(" --world {name}")).collect();
        format!("--seeds {}{worlds}{} --markdown", self.seeds.written(), self.settings())
    }

    fn settings(&self) -> String {
        let mut settings = String::new();
        if self.layout != TRACK_A {
            settings += &format!(" --layout {}", self.layout);
        }
        for (name, asked, usual) in [
            ("sessions", u16::from(self.sessions), u16::from(SESSIONS)),
            ("stops", self.stops, STOPS),
            ("budget", self.budget, BUDGET_S),
        ] {
            if asked != usual {
                settings += &format!(" --{name} {asked}");
            }
        }
        settings
    }
}
