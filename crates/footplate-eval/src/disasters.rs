//! Engines exchanged, wheels soiled, stations restarted, trains lifted: and what a watched driver makes of it.

mod attributed;
mod figures;
mod kind;
mod page;
mod scene;

use anyhow::ensure;
use footplate_core::track::Layout;
use footplate_core::{TimeSpan, TrainId};
use footplate_sim::LivingSwitches;

use self::attributed::{Attributed, attributed};
use self::kind::Kind;
pub use self::page::Page;
use self::scene::{OTHER, Outcomes, Scene, TRAIN};
use crate::rehearsal::{Rehearsal, Way};

/// A third train, for telling trains apart.
const THIRD: TrainId = TrainId(63);

/// All of one seed.
pub struct Scored {
    /// The seed.
    pub seed: u64,
    /// What happened, and what came of it.
    runs: Vec<(Kind, Outcomes)>,
    /// With how many trains running.
    attributed: Vec<(usize, Attributed)>,
}

impl Scored {
    /// What came to grief, and what was not noticed although something had happened.
    #[must_use]
    pub fn troubles(&self) -> Vec<String> {
        let troubles = self.runs.iter().filter_map(|(kind, run)| {
            let what = match run.mishaps {
                0 if *kind == Kind::Faultless || run.noticed.is_some() => return None,
                0 => "not noticed".to_owned(),
                1 => "1 mishap".to_owned(),
                mishaps => format!("{mishaps} mishaps"),
            };
            Some(format!("{}: {what}", kind.says()))
        });
        troubles.collect()
    }
}

/// Everything that happens to the trains of one seed.
///
/// # Errors
/// When no train can run round on the layout.
pub fn score(layout: &Layout, seed: u64, budget: TimeSpan) -> anyhow::Result<Scored> {
    let way = Way::round(layout);
    ensure!(!way.nodes.is_empty(), "no train can run round on this layout with all turnouts straight");
    let trains = [TRAIN, OTHER, THIRD];
    let stage = Rehearsal::prepare(layout, seed, &trains, &LivingSwitches::well_kept(), budget)?;
    let mut runs = Vec::new();
    for (nth, kind) in Kind::ALL.into_iter().enumerate() {
        let asked = seed.wrapping_mul(Kind::ALL.len() as u64).wrapping_add(nth as u64);
        runs.push((kind, Scene::new(layout, &stage, &way, asked)?.run(kind, &way, seed)?));
    }
    let mut counted = Vec::new();
    for count in 2..=trains.len() {
        let running = trains.get(..count).unwrap_or_default();
        counted.push((count, attributed(&stage, &way, running)?));
    }
    Ok(Scored { seed, runs, attributed: counted })
}
