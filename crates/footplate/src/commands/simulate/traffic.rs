//! `footplate simulate traffic`: several trains sent to random places for hours, and scored by the simulator's truth.

use std::io::Write;
use std::num::NonZeroUsize;

use clap::Args;
use footplate_core::TimeSpan;
use footplate_core::track::Layout;
use footplate_eval::seeds::Seeds;
use footplate_eval::traffic::{Asked, LONGEST_NOWHERE_S, Page, Session, Tally};
use footplate_store::layout_named;

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::score_form::ScoreForm;
use crate::spread::each;

/// Send several calibrated trains to random places, one after the other, and count what comes of it by the truth.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate traffic --trains 4 --hours 0.5 --seeds 1..4 --markdown")]
pub(super) struct Arguments {
    /// The layout: the name of a built-in one or a layout file.
    #[arg(long, default_value = "track-a")]
    layout: String,
    /// How many trains.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=6))]
    trains: u8,
    /// Track time, in hours.
    #[arg(long, value_name = "H", default_value_t = 1.0)]
    hours: f64,
    /// The seed of trains, rails, faults and destinations, or many: 1..30.
    #[arg(long, visible_alias = "seed", value_name = "N", default_value = "1", value_parser = Seeds::parse)]
    seeds: Seeds,
    /// Track time that the calibration of each train may take, in seconds.
    #[arg(long, value_name = "S", default_value_t = 300, value_parser = clap::value_parser!(u16).range(30..=3600))]
    budget: u16,
    /// The same again with the track between contacts reserved as a whole, as block systems do, to compare with.
    #[arg(long)]
    baseline: bool,
    /// Tell everything that happens while it happens.
    #[arg(long)]
    talk: bool,
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
        let asked = Asked {
            trains: usize::from(self.trains),
            time: TimeSpan::from_s(self.hours * 3600.0),
            budget: TimeSpan::from_s(f64::from(self.budget)),
            by_blocks: false,
        };
        let tallies = self.tallies(&layout, &seeds, asked)?;
        let by_blocks = if self.baseline {
            self.tallies(&layout, &seeds, Asked { by_blocks: true, ..asked })?
        } else {
            Vec::new()
        };
        let page = Page { tallies: &tallies, by_blocks: &by_blocks, asked: self.asked() };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = tallies.iter().filter_map(|tally| self.failed(tally)).collect();
        Ok(name_failed(&failed))
    }

    fn tallies(&self, layout: &Layout, seeds: &[u64], asked: Asked) -> anyhow::Result<Vec<Tally>> {
        each("traffic", seeds, self.threads, |seed| {
            Ok(Session::new(layout, *seed, asked, self.talk)?.run(asked.time))
        })
    }

    /// What must never become of trains, if it did, and how to have it again with all that is said.
    fn failed(&self, tally: &Tally) -> Option<FailedRun> {
        let mut what: Vec<String> = tally.incidents.iter().map(|incident| format!("{incident:?}")).collect();
        let intrusions = tally.intrusions.iter();
        what.extend(intrusions.map(|(at, train)| {
            format!("train {train} on track that it does not hold at {:.2} s", at.as_s())
        }));
        if tally.starved > LONGEST_NOWHERE_S {
            what.push(format!("a train came nowhere for {:.0} s", tally.starved));
        }
        let again = self.asked().replace(&format!("--seeds {}", self.seeds.written()), "");
        let again = again.replace("--markdown", "").replace("--baseline", "");
        let again = again.split_whitespace().collect::<Vec<_>>().join(" ");
        (!what.is_empty()).then(|| FailedRun {
            what: format!("seed {}: {}", tally.seed, what.join(", ")),
            again: format!("simulate traffic {again} --seed {} --talk", tally.seed),
        })
    }

    /// What was asked for, as on the command line.
    fn asked(&self) -> String {
        let mut asked = format!(
            "--trains {} --hours {} --seeds {} --markdown",
            self.trains,
            self.hours,
            self.seeds.written()
        );
        if self.layout != "track-a" {
            asked = format!("--layout {} {asked}", self.layout);
        }
        if self.budget != 300 {
            asked = format!("--budget {} {asked}", self.budget);
        }
        if self.baseline {
            asked = format!("--baseline {asked}");
        }
        asked
    }
}
