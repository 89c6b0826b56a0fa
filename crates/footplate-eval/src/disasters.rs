//! Faults of trains and station, and how a supervised driver copes: another engine under the same address, dirty
//! wheels, a restarted station, a lifted train.

mod association;
mod disturbed_run;
mod figures;
mod kind;
mod page;

use anyhow::ensure;
use footplate_core::track::Layout;
use footplate_core::{TimeSpan, TrainId};
use footplate_sim::LivingSwitches;

use self::association::{AssociationCounts, associations};
use self::disturbed_run::{DisturbedRun, OTHER, Outcomes, TRAIN};
use self::kind::Kind;
pub use self::page::Page;
use crate::testbed::{LongestCircuit, PreparedTrains};

/// A third train, for data association.
const THIRD: TrainId = TrainId(63);

/// The results of one seed.
pub struct Scored {
    /// The seed.
    pub seed: u64,
    /// One result for each kind of disturbance.
    runs: Vec<(Kind, Outcomes)>,
    /// Data association by the number of running trains.
    associations: Vec<(usize, AssociationCounts)>,
}

impl Scored {
    /// What happened to trains in the simulated world, and disturbances that were not detected.
    pub fn failures(&self) -> Vec<String> {
        let failures = self.runs.iter().filter_map(|(kind, run)| {
            let what = run.failure(*kind)?;
            Some(format!("{}: {what}", kind.description()))
        });
        failures.collect()
    }
}

/// Scores all disturbances with the trains of one seed.
///
/// # Errors
/// The layout has no circuit.
pub fn score(layout: &Layout, seed: u64, budget: TimeSpan) -> anyhow::Result<Scored> {
    let circuit = LongestCircuit::of(layout);
    ensure!(!circuit.nodes.is_empty(), "no train can run round on this layout with all turnouts straight");
    let trains = [TRAIN, OTHER, THIRD];
    let prepared = PreparedTrains::prepare(layout, seed, &trains, &LivingSwitches::well_kept(), budget)?;
    let mut runs = Vec::new();
    for (nth, kind) in Kind::ALL.into_iter().enumerate() {
        let asked = seed.wrapping_mul(Kind::ALL.len() as u64).wrapping_add(nth as u64);
        runs.push((kind, DisturbedRun::new(layout, &prepared, &circuit, asked)?.run(kind, &circuit, seed)?));
    }
    let mut counted = Vec::new();
    for count in 2..=trains.len() {
        let running = trains.get(..count).unwrap_or_default();
        counted.push((count, associations(&prepared, &circuit, running)?));
    }
    Ok(Scored { seed, runs, associations: counted })
}
