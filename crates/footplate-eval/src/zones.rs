//! Trains run over speed restrictions, whatever they are ordered to do, and are scored by their true speeds there.

mod page;
mod passage;
mod ride;

use anyhow::{Context, ensure};
use footplate_core::track::{Layout, Zone};
use footplate_core::{EdgeId, Length, Speed, StretchId, TimeSpan, TrainId};
use footplate_sim::LivingSwitches;

pub use self::page::Page;
use self::ride::{Ridden, Told, ride};
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains};

const TRAINS: [TrainId; 3] = [TrainId(24), TrainId(58), TrainId(63)];
/// Zones at once on a way round, ...
const ZONES: usize = 2;
/// ... each of edges next to each other of at least so many mm, ...
const LONG_ENOUGH: f64 = 250.0;
/// ... with limits between these (mm/s): faster than the slowest step of most trains, slower than any runs.
const LIMITS: [f64; 2] = [170.0, 280.0];

/// All of one seed.
pub struct Scored {
    /// The seed.
    pub seed: u64,
    rides: Vec<Ridden>,
}

impl Scored {
    /// The first train that did not do what it was ordered, and why.
    #[must_use]
    pub fn trouble(&self) -> Option<(TrainId, &str)> {
        self.rides.iter().find_map(|ride| Some((ride.train, ride.trouble.as_deref()?)))
    }
}

/// Everything that is asked of the trains of one seed.
///
/// # Errors
/// When no train can run round on the layout.
pub fn score(layout: &Layout, seed: u64, budget: TimeSpan) -> anyhow::Result<Scored> {
    let way = LongestCircuit::of(layout);
    ensure!(!way.nodes.is_empty(), "no train can run round on this layout with all turnouts straight");
    let stage = PreparedTrains::prepare(layout, seed, &TRAINS, &LivingSwitches::well_kept(), budget)?;
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
fn restricted(layout: &Layout, way: &LongestCircuit, choice: &mut Choice) -> anyhow::Result<Layout> {
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
