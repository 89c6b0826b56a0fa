//! Trains hold speeds that none of their steps has, arrive in time and follow each other; so does a simpler driver.

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
use self::follow::{Followed, Kept, follow};
use self::hold::{Held, hold};
pub use self::page::Page;
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains};

/// Three trains, in the order in which they would follow each other.
const TRAINS: [TrainId; 3] = [TrainId(24), TrainId(58), TrainId(63)];

/// Gaps between them (s or mm), and for how long each is kept (s).
const GAPS: [(Kept, f64); 3] = [(Kept::Time, 1.5), (Kept::Time, 3.0), (Kept::Length, 150.0)];
const FOLLOWED_FOR: f64 = 600.0;

/// All of one seed.
pub struct Scored {
    /// The seed.
    pub seed: u64,
    held: Vec<Held>,
    arrived: Vec<Arrived>,
    followed: Vec<Followed>,
}

impl Scored {
    /// What went wrong with trains that we drove.
    pub fn troubles(&self) -> impl Iterator<Item = (TrainId, &str)> {
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
///
/// # Errors
/// When no train can run round on the layout.
pub fn score(layout: &Layout, seed: u64, budget: TimeSpan) -> anyhow::Result<Scored> {
    let way = LongestCircuit::of(layout);
    ensure!(!way.nodes.is_empty(), "no train can run round on this layout with all turnouts straight");
    let stage = PreparedTrains::prepare(layout, seed, &TRAINS, &LivingSwitches::well_kept(), budget)?;
    let mut choice = Choice::new(seed);
    let (mut held, mut arrived) = (Vec::new(), Vec::new());
    for train in TRAINS {
        held.extend(hold(layout, &stage, &way, train, &mut choice)?);
        arrived.extend(arrive(layout, &stage, &way, train, &mut choice)?);
    }
    let followed = follow(&stage, &way, &TRAINS, (&GAPS, FOLLOWED_FOR), &mut choice)?;
    Ok(Scored { seed, held, arrived, followed })
}
