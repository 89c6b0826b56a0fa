//! Layouts of which one length is known, surveyed by driving random trains, and scored by the true lengths.

mod page;

use anyhow::anyhow;
use footplate_core::model::survey::{SectionIndex, TrackSurvey};
use footplate_core::track::{Hop, Layout, StretchLength, Survey};
use footplate_core::{HALF_95, Length, StretchId, TimeSpan, TrainId};
use footplate_sim::LivingSwitches;
use footplate_sim::living::LivingLayout;

pub use self::page::Page;
use crate::rehearsal::Rehearsal;

/// The number of the first train; the others follow.
const FIRST_TRAIN: u16 = 24;
/// How well a person measures the one length with a tape.
const TAPE: Length = Length::from_mm(2.0);

/// One world: trains calibrated on the layout without its lengths, and what follows.
///
/// # Errors
/// When no train can run on the layout.
pub fn score(
    layout: &Layout,
    known: StretchId,
    trains: u8,
    budget: TimeSpan,
    seed: u64,
) -> anyhow::Result<Surveyed> {
    let trains: Vec<TrainId> = (0..u16::from(trains)).map(|nth| TrainId(FIRST_TRAIN + nth)).collect();
    let switches = LivingSwitches::well_kept();
    let truth = LivingLayout::draw(layout, seed, &trains, &switches)?;
    let bare = without_lengths(layout, known, &truth)?;
    let rehearsal = Rehearsal::prepare_believing(layout, &bare, seed, &trains, &switches, budget)?;
    let sections = SectionIndex::of(&bare);
    let models: Vec<_> = trains.iter().filter_map(|train| rehearsal.models.get(train)).collect();
    let survey = TrackSurvey::of(&bare, &sections, &models).ok_or_else(|| anyhow!("no train ran"))?;
    let mut surveyed = Surveyed {
        seed,
        distances: Vec::new(),
        unseen: 0,
        scale: survey.scale(),
        mishaps: rehearsal.world().mishaps().len(),
    };
    let mut seen = Vec::new();
    let known_hop = layout
        .hops()
        .find(|hop| hop.edges.iter().any(|edge| edge.stretch() == known) && is_between_sensors(layout, hop));
    let felt = |hop: &Hop<'_>| felt_mm(&rehearsal, &trains, layout, hop);
    // A survey by trains cannot be nearer than what they feel, which is by this factor longer on the known edge.
    let factor = known_hop.and_then(|hop| Some(felt(&hop)? / true_mm(&truth, &hop))).unwrap_or(1.0);
    for hop in layout.hops().filter(|hop| is_between_sensors(layout, hop)) {
        let Some(section) = sections.section(hop.id).filter(|section| !seen.contains(section)) else {
            continue;
        };
        seen.push(section);
        let Some([length, uncertainty]) = survey.distance(section).map(|known| known.map(Length::as_mm))
        else {
            surveyed.unseen += 1;
            continue;
        };
        let true_mm = true_mm(&truth, &hop);
        surveyed.distances.push(Distance {
            from: layout.node_name(hop.from).to_owned(),
            to: layout.node_name(hop.to).to_owned(),
            true_mm,
            off_mm: length - true_mm,
            uncertainty_mm: uncertainty,
            felt_off_mm: felt(&hop).map_or(0.0, |felt| felt / factor - true_mm),
            is_known: known_hop.is_some_and(|known| sections.section(known.id) == Some(section)),
        });
    }
    Ok(surveyed)
}

/// What came of one world.
pub struct Surveyed {
    /// The seed.
    pub seed: u64,
    distances: Vec<Distance>,
    /// Distances between sensors over which no train ran.
    unseen: usize,
    /// One standard deviation of the factor that all have in common, as the survey says.
    scale: f64,
    /// How often trains came to grief.
    pub mishaps: usize,
}

/// A distance from sensor to sensor.
struct Distance {
    from: String,
    to: String,
    true_mm: f64,
    /// How much longer the survey has it.
    off_mm: f64,
    /// One standard deviation that the survey says of it.
    uncertainty_mm: f64,
    /// How much longer it would be by a survey that knows exactly what trains feel, mean of both directions.
    felt_off_mm: f64,
    is_known: bool,
}

impl Distance {
    fn is_inside(&self) -> bool {
        self.off_mm.abs() <= HALF_95 * self.uncertainty_mm
    }
}

fn is_between_sensors(layout: &Layout, hop: &Hop<'_>) -> bool {
    hop.sensor.is_some() && layout.sensor_at(hop.from).is_some()
}

/// The longest edge from sensor to sensor: the one that a person would measure.
pub fn longest_between_sensors(layout: &Layout) -> Option<StretchId> {
    let single = layout.hops().filter(|hop| is_between_sensors(layout, hop) && hop.edges.len() == 1);
    let longest = single.max_by(|one, other| one.length.as_m().total_cmp(&other.length.as_m()))?;
    longest.edges.first().map(|edge| edge.stretch())
}

/// The layout as it is before anything was measured but one edge, and that truly.
fn without_lengths(layout: &Layout, known: StretchId, truth: &LivingLayout<'_>) -> anyhow::Result<Layout> {
    let lengths: Vec<StretchLength> = layout
        .edges()
        .step_by(2)
        .map(|(id, _)| {
            let measured = truth.truth().track().length(id);
            if id.stretch() == known { StretchLength::Measured(measured) } else { StretchLength::Unknown }
        })
        .collect();
    Ok(layout.surveyed(&lengths, Survey::taped(TAPE, "one edge, with a tape".to_owned()))?)
}

fn true_mm(world: &LivingLayout<'_>, hop: &Hop<'_>) -> f64 {
    hop.edges.iter().map(|edge| world.truth().track().length(*edge).as_mm()).sum()
}

/// How long a hop feels in the mean of all trains and both directions.
fn felt_mm(rehearsal: &Rehearsal<'_>, trains: &[TrainId], layout: &Layout, hop: &Hop<'_>) -> Option<f64> {
    let back: Vec<_> = hop.edges.iter().rev().map(|edge| edge.twin()).collect();
    let sensors =
        [hop.from, hop.to].map(|node| Some([layout.sensor_at(node)?, layout.sensor_at(node.reverse())?]));
    let [Some([from, from_back]), Some([to, to_back])] = sensors else { return None };
    let truth = rehearsal.world().truth();
    let felt = trains.iter().flat_map(|train| {
        [truth.felt(*train, hop.edges, from, to), truth.felt(*train, &back, to_back, from_back)]
    });
    let felt: Vec<f64> = felt.flatten().map(Length::as_mm).collect();
    Some(felt.iter().sum::<f64>() / felt.len().max(1) as f64)
}
