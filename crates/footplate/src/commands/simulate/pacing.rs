//! `footplate simulate pacing`: trains hold speeds, arrive in time and follow each other, and are scored by the simulator's truth.

mod arrive;
mod counted;
pub(in crate::commands::simulate) mod figures;
mod follow;
mod hold;
mod page;
mod tracked;

use std::io::Write;

use anyhow::ensure;
use clap::Args;
use footplate_core::track::Layout;
use footplate_core::{TimeSpan, TrainId};
use footplate_sim::LivingSwitches;

use self::arrive::{Arrived, arrive};
use self::follow::{Followed, Kept, follow};
use self::hold::{Held, hold};
use self::page::Page;
use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::driving::choice::Choice;
use super::rehearsal::{Rehearsal, Way};
use super::series::Series;
use super::written_scores::ScoreForm;

/// Let calibrated trains hold speeds that none of their steps has, arrive in time and follow each other, and score them by the truth.
///
/// Each seed is a layout with three trains. What is asked of them is asked of a simpler driver in the same world, too.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate pacing --seeds 1..4 --markdown")]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series,
    #[command(flatten)]
    form: ScoreForm,
}

/// Three trains, in the order in which they would follow each other.
const TRAINS: [TrainId; 3] = [TrainId(24), TrainId(58), TrainId(63)];

/// Gaps between them (s or mm), and for how long each is kept (s).
const GAPS: [(Kept, f64); 3] = [(Kept::Time, 1.5), (Kept::Time, 3.0), (Kept::Length, 150.0)];
const FOLLOWED_FOR: f64 = 600.0;

/// All of one seed.
struct Scored {
    seed: u64,
    held: Vec<Held>,
    arrived: Vec<Arrived>,
    followed: Vec<Followed>,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let scored = self.series.score("pacing", score)?;
        let page = Page { scored: &scored, asked: self.series.asked() };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = scored.iter().filter_map(|scored| self.failure(scored)).collect();
        Ok(name_failed(&failed))
    }

    /// What the driver did not carry out, or trains came to grief over: how others drive them is no check of ours.
    fn failure(&self, scored: &Scored) -> Option<FailedRun> {
        let (train, trouble) = scored.troubles().next()?;
        let again = self.series.again("pacing", scored.seed);
        Some(FailedRun { what: format!("seed {}, train {train}: {trouble}", scored.seed), again })
    }
}

impl Scored {
    /// What went wrong with trains that we drove.
    fn troubles(&self) -> impl Iterator<Item = (TrainId, &str)> {
        let held = self.held.iter().filter(|held| held.by == hold::By::Driver);
        let held = held.filter_map(|held| Some((held.train, held.trouble.as_deref()?)));
        let arrived = self.arrived.iter().filter(|arrived| arrived.by == arrive::By::Driver);
        let arrived = arrived.filter_map(|arrived| Some((arrived.train, arrived.trouble.as_deref()?)));
        let followed = self.followed.iter().filter(|followed| followed.by == follow::By::Driver);
        let followed = followed.filter_map(|followed| Some((followed.train, followed.trouble.as_deref()?)));
        held.chain(arrived).chain(followed)
    }
}

/// Everything that is asked of the trains of one seed.
fn score(layout: &Layout, seed: u64, budget: TimeSpan) -> anyhow::Result<Scored> {
    let way = Way::round(layout);
    ensure!(!way.nodes.is_empty(), "no train can run round on this layout with all turnouts straight");
    let stage = Rehearsal::prepare(layout, seed, &TRAINS, &LivingSwitches::well_kept(), budget)?;
    let mut choice = Choice::new(seed);
    let (mut held, mut arrived) = (Vec::new(), Vec::new());
    for train in TRAINS {
        held.extend(hold(layout, &stage, &way, train, &mut choice)?);
        arrived.extend(arrive(layout, &stage, &way, train, &mut choice)?);
    }
    let followed = follow(&stage, &way, &TRAINS, (&GAPS, FOLLOWED_FOR), &mut choice)?;
    Ok(Scored { seed, held, arrived, followed })
}
