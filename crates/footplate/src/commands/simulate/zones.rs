//! `footplate simulate zones`: trains are ordered about on a layout with speed restrictions, and their true speeds in these are scored.

mod page;
mod passage;
mod ride;

use std::io::Write;

use anyhow::{Context, ensure};
use clap::Args;
use footplate_core::track::{Layout, Zone};
use footplate_core::{EdgeId, Length, Speed, StretchId, TimeSpan, TrainId};
use footplate_sim::LivingSwitches;

use self::page::Page;
use self::ride::{Ridden, Told, ride};
use super::super::Outcome;
use super::again::{FailedRun, name_failed};
use super::driving::choice::Choice;
use super::rehearsal::{Rehearsal, Way};
use super::series::Series;
use super::written_scores::ScoreForm;

/// Let calibrated trains run, stop, hold speeds, arrive in time and follow each other over speed restrictions, and score their true speeds there.
///
/// Each seed is a layout with three trains and other restrictions for each of them; zones of its own are not heeded.
#[derive(Args)]
#[command(after_help = "Example: footplate simulate zones --seeds 1..4 --markdown")]
pub(super) struct Arguments {
    #[command(flatten)]
    series: Series,
    #[command(flatten)]
    form: ScoreForm,
}

const TRAINS: [TrainId; 3] = [TrainId(24), TrainId(58), TrainId(63)];
/// Zones at once on a way round, ...
const ZONES: usize = 2;
/// ... each of edges next to each other of at least so many mm, ...
const LONG_ENOUGH: f64 = 250.0;
/// ... with limits between these (mm/s): faster than the slowest step of most trains, slower than any runs.
const LIMITS: [f64; 2] = [170.0, 280.0];

/// All of one seed.
struct Scored {
    seed: u64,
    rides: Vec<Ridden>,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let scored = self.series.score("zones", score)?;
        let page = Page { scored: &scored, asked: self.series.asked() };
        self.form.write(&page, output)?;
        let failed: Vec<FailedRun> = scored.iter().filter_map(|scored| self.failure(scored)).collect();
        Ok(name_failed(&failed))
    }

    fn failure(&self, scored: &Scored) -> Option<FailedRun> {
        let found = scored.rides.iter().find_map(|ride| Some((ride, ride.trouble.as_ref()?)));
        let (ride, trouble) = found?;
        let again = self.series.again("zones", scored.seed);
        Some(FailedRun { what: format!("seed {}, train {}: {trouble}", scored.seed, ride.train), again })
    }
}

/// Everything that is asked of the trains of one seed.
fn score(layout: &Layout, seed: u64, budget: TimeSpan) -> anyhow::Result<Scored> {
    let way = Way::round(layout);
    ensure!(!way.nodes.is_empty(), "no train can run round on this layout with all turnouts straight");
    let stage = Rehearsal::prepare(layout, seed, &TRAINS, &LivingSwitches::well_kept(), budget)?;
    let mut choice = Choice::new(seed);
    let mut rides = Vec::new();
    for nth in 0..TRAINS.len() {
        let restricted = restricted(layout, &way, &mut choice)?;
        let draw = choice.between(0.0, 1e9) as u64;
        for told in Told::ALL {
            // Whoever follows has the train before it in the list ahead.
            let trains = [TRAINS[nth], TRAINS[(nth + 1) % TRAINS.len()]];
            rides.push(ride([layout, &restricted], &stage, &way, trains, told, draw)?);
        }
    }
    Ok(Scored { seed, rides })
}

/// The layout with zones on the way round.
fn restricted(layout: &Layout, way: &Way, choice: &mut Choice) -> anyhow::Result<Layout> {
    let mut taken: Vec<StretchId> = Vec::new();
    let mut found = layout.clone();
    for nth in 0..ZONES {
        let stretches = loop {
            let begins = choice.between(0.0, way.edges.len() as f64) as usize;
            let stretches = some_of(layout, way.edges.iter().cycle().skip(begins).take(way.edges.len()));
            if stretches.iter().all(|stretch| !taken.contains(stretch)) {
                break stretches;
            }
        };
        taken.extend(&stretches);
        let limit = Speed::from_mm_per_s(choice.between(LIMITS[0], LIMITS[1]));
        let zone = Zone { name: format!("zone {nth}"), limit };
        found = found.with_zone(zone, stretches).context("a zone of edges that are in no other")?;
    }
    Ok(found)
}

/// As many edges from the first on as make a zone.
fn some_of<'e>(layout: &Layout, edges: impl Iterator<Item = &'e EdgeId>) -> Vec<StretchId> {
    let mut length = Length::ZERO;
    let long_enough = |edge: &&EdgeId| {
        let goes_on = length.as_mm() < LONG_ENOUGH;
        length += layout.edge(**edge).map_or(Length::ZERO, |edge| edge.length);
        goes_on
    };
    edges.take_while(long_enough).map(|edge| edge.stretch()).collect()
}
