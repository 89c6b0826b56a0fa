//! Holding speeds between those of steps, arriving in time and following another train, compared with simpler drivers.

mod arrive;
mod counted;
mod follow;
mod hold;
mod page;
mod tracked;

use anyhow::ensure;
use footplate_core::track::Layout;
use footplate_core::{TimeSpan, TrainId};
use footplate_sim::LivingSwitches;

use self::arrive::{Arrived, arrive};
use self::counted::By;
use self::follow::{Followed, Kept, follow};
use self::hold::{Held, hold};
pub use self::page::Page;
use crate::seeds::Choice;
use crate::testbed::{GRIEF, LongestCircuit, PreparedTrains};

/// Three trains, in the order in which they follow each other.
const TRAINS: [TrainId; 3] = [TrainId(24), TrainId(58), TrainId(63)];

/// Gaps between them (s or mm), and for how long each is kept (s).
const GAPS: [(Kept, f64); 3] = [(Kept::Time, 1.5), (Kept::Time, 3.0), (Kept::Length, 150.0)];
const FOLLOWED_FOR: f64 = 600.0;

/// The results of one seed.
pub struct Scored {
    /// The seed.
    pub seed: u64,
    held: Vec<Held>,
    arrived: Vec<Arrived>,
    followed: Vec<Followed>,
}

impl Scored {
    /// The first train that Footplate drove and whose order failed, and why; before all others one that came to grief.
    pub fn failures(&self) -> Vec<String> {
        let worst = self.troubles().min_by_key(|(_, trouble)| !trouble.starts_with(GRIEF));
        worst.map(|(train, trouble)| format!("train {train}: {trouble}")).into_iter().collect()
    }

    fn troubles(&self) -> impl Iterator<Item = (TrainId, &str)> {
        let held = self.held.iter().map(|held| (held.by, held.train, &held.trouble));
        let arrived = self.arrived.iter().map(|arrived| (arrived.by, arrived.train, &arrived.trouble));
        let followed = self.followed.iter().map(|run| (run.by, run.train, &run.trouble));
        let ours = held.chain(arrived).chain(followed).filter(|(by, ..)| *by == By::Footplate);
        ours.filter_map(|(_, train, trouble)| Some((train, trouble.as_deref()?)))
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
    let (mut held, mut arrived) = (Vec::new(), Vec::new());
    for train in TRAINS {
        held.extend(hold(layout, &prepared, &circuit, train, &mut choice)?);
        arrived.extend(arrive(layout, &prepared, &circuit, train, &mut choice)?);
    }
    let followed = follow(&prepared, &circuit, &TRAINS, (&GAPS, FOLLOWED_FOR), &mut choice)?;
    Ok(Scored { seed, held, arrived, followed })
}
