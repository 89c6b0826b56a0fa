//! Trains with orders of every kind run through zones, and are scored by their true speeds there.

mod page;
mod passage;
mod ride;

use anyhow::{Context, ensure};
use footplate_core::track::{Layout, Zone};
use footplate_core::{EdgeId, Length, Speed, StretchId, TimeSpan, TrainId};
use footplate_sim::LivingSwitches;

pub use self::page::Page;
use self::ride::{Ridden, Task, ride};
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains};

const TRAINS: [TrainId; 3] = [TrainId(24), TrainId(58), TrainId(63)];
/// Zones at once on the circuit, ...
const ZONES: usize = 2;
/// ... each of neighbouring edges with at least this length (mm), ...
const LONG_ENOUGH: f64 = 250.0;
/// ... with limits between these (mm/s): faster than the slowest step of most trains, slower than any runs.
const LIMITS: [f64; 2] = [170.0, 280.0];

/// The results of one seed.
pub struct Scored {
    /// The seed.
    pub seed: u64,
    rides: Vec<Ridden>,
}

impl Scored {
    /// The first train that did not carry out its order, and why.
    pub fn failures(&self) -> Vec<String> {
        let failed = |ride: &Ridden| Some(format!("train {}: {}", ride.train, ride.trouble.as_deref()?));
        self.rides.iter().find_map(failed).into_iter().collect()
    }
}

/// Scores the trains of one seed.
///
/// # Errors
/// The layout has no circuit, or no room for a train.
pub fn score(layout: &Layout, seed: u64, budget: TimeSpan) -> anyhow::Result<Scored> {
    let circuit = LongestCircuit::of(layout);
    ensure!(!circuit.nodes.is_empty(), "no train can run round on this layout with all turnouts straight");
    let prepared = PreparedTrains::prepare(layout, seed, &TRAINS, &LivingSwitches::well_kept(), budget)?;
    let mut choice = Choice::new(seed);
    let mut rides = Vec::new();
    for nth in 0..TRAINS.len() {
        let restricted = restricted(layout, &circuit, &mut choice)?;
        let draw = choice.between(0.0, 1e9) as u64;
        for task in Task::ALL {
            // A follower has the next train of the list ahead.
            let trains = [TRAINS[nth], TRAINS[(nth + 1) % TRAINS.len()]];
            rides.push(ride([layout, &restricted], &prepared, &circuit, trains, task, draw)?);
        }
    }
    Ok(Scored { seed, rides })
}

/// The layout with zones on the circuit.
fn restricted(layout: &Layout, circuit: &LongestCircuit, choice: &mut Choice) -> anyhow::Result<Layout> {
    let mut taken: Vec<StretchId> = Vec::new();
    let mut found = layout.clone();
    for nth in 0..ZONES {
        let stretches = loop {
            let begins = choice.between(0.0, circuit.edges.len() as f64) as usize;
            let stretches =
                some_of(layout, circuit.edges.iter().cycle().skip(begins).take(circuit.edges.len()));
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

/// The edges of a zone that begins with the first.
fn some_of<'e>(layout: &Layout, edges: impl Iterator<Item = &'e EdgeId>) -> Vec<StretchId> {
    let mut length = Length::ZERO;
    let long_enough = |edge: &&EdgeId| {
        let goes_on = length.as_mm() < LONG_ENOUGH;
        length += layout.edge(**edge).map_or(Length::ZERO, |edge| edge.length);
        goes_on
    };
    edges.take_while(long_enough).map(|edge| edge.stretch()).collect()
}
