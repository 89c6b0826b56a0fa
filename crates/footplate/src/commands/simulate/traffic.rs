//! `footplate simulate traffic`: several trains sent to random places for hours, and scored by the simulator's truth.

use std::io::Write;

use clap::Args;
use footplate_core::TimeSpan;
use footplate_eval::traffic::{Asked, LONGEST_NOWHERE_S, Page, Session, Tally};

use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::long::number_of_hours;
use super::seed_scores::ScoreForm;
use super::series::Series;

/// Send several calibrated trains to random places, one after the other, and count what comes of it by the truth.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate traffic --trains 4 --hours 0.5 --seeds 1..4 --markdown")]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series,
    /// How many trains.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=6))]
    trains: u8,
    /// Track time, in hours.
    #[arg(long, value_name = "H", default_value_t = 1.0, value_parser = number_of_hours)]
    hours: f64,
    /// The same again with the track between sensors reserved as a whole, as block systems do, to compare with.
    #[arg(long)]
    baseline: bool,
    /// Tell everything that happens while it happens.
    #[arg(long)]
    talk: bool,
    #[command(flatten)]
    form: ScoreForm,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let asked = Asked {
            trains: usize::from(self.trains),
            time: TimeSpan::from_s(self.hours * 3600.0),
            budget: self.series.budget(),
            by_blocks: false,
        };
        let tallies = self.tallies(asked)?;
        let by_blocks =
            if self.baseline { self.tallies(Asked { by_blocks: true, ..asked })? } else { Vec::new() };
        let baseline = if self.baseline { " --baseline" } else { "" };
        let page = Page {
            tallies: &tallies,
            by_blocks: &by_blocks,
            asked: self.series.asked(&format!("{}{baseline}", self.own())),
        };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = tallies.iter().filter_map(|tally| self.failed(tally)).collect();
        Ok(name_failed(&failed))
    }

    fn tallies(&self, asked: Asked) -> anyhow::Result<Vec<Tally>> {
        self.series.score("traffic", |layout, seed, _| {
            Ok(Session::new(layout, seed, asked, self.talk)?.run(asked.time))
        })
    }

    /// The incidents and other failures of a session, and the command that repeats it with all notices.
    fn failed(&self, tally: &Tally) -> Option<FailedRun> {
        let mut what: Vec<String> = tally.incidents.iter().map(|incident| format!("{incident:?}")).collect();
        let intrusions = tally.intrusions.iter();
        what.extend(intrusions.map(|(at, train)| {
            format!("train {train} on track that it does not hold at {:.2} s", at.as_s())
        }));
        if tally.starved > LONGEST_NOWHERE_S {
            what.push(format!("a train came nowhere for {:.0} s", tally.starved));
        }
        (!what.is_empty()).then(|| FailedRun {
            what: format!("seed {}: {}", tally.seed, what.join(", ")),
            again: self.series.again("traffic", tally.seed, &(self.own() + " --talk")),
        })
    }

    /// Its own arguments, as on the command line.
    fn own(&self) -> String {
        format!(" --trains {} --hours {}", self.trains, self.hours)
    }
}
