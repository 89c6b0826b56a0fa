//! Layouts with one known length, surveyed by the runs of random trains and compared with the true lengths.

mod page;

use anyhow::anyhow;
use footplate_core::model::survey::{SectionIndex, TrackSurvey};
use footplate_core::track::{Hop, Layout, StretchLength, Survey};
use footplate_core::{HALF_95, Length, StretchId, TimeSpan, TrainId};
use footplate_sim::LivingSwitches;
use footplate_sim::living::LivingLayout;

pub use self::page::Page;
use crate::testbed::PreparedTrains;

/// The number of the first train; the others follow.
const FIRST_TRAIN: u16 = 24;
/// The standard deviation of the one length measured with a tape.
const TAPE: Length = Length::from_mm(2.0);

/// Calibrates trains in one world on a layout without lengths, and scores the survey that follows.
///
/// # Errors
/// No train can run on the layout.
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
    let prepared = PreparedTrains::prepare_on(layout, &bare, seed, &trains, &switches, budget)?;
    let sections = SectionIndex::of(&bare);
    let fits: Vec<_> = trains.iter().filter_map(|train| prepared.fits.get(train)).collect();
    let survey = TrackSurvey::of(&bare, &sections, &fits).ok_or_else(|| anyhow!("no train ran"))?;
    let mut surveyed = Surveyed {
        seed,
        distances: Vec::new(),
        not_run: 0,
        scale: survey.scale(),
        incidents: prepared.incidents_since(0),
    };
    let mut seen = Vec::new();
    let known_hop = layout
        .hops()
        .find(|hop| hop.edges.iter().any(|edge| edge.stretch() == known) && is_between_sensors(layout, hop));
    let path_length = |hop: &Hop<'_>| path_length_mm(&prepared, &trains, layout, hop);
    // Scales path lengths such that the known edge has its true length, as the survey does.
    let factor = known_hop.and_then(|hop| Some(path_length(&hop)? / true_mm(&truth, &hop))).unwrap_or(1.0);
    for hop in layout.hops().filter(|hop| is_between_sensors(layout, hop)) {
        let Some(section) = sections.section(hop.id).filter(|section| !seen.contains(section)) else {
            continue;
        };
        seen.push(section);
        let Some([length, uncertainty]) = survey.distance(section).map(|known| known.map(Length::as_mm))
        else {
            surveyed.not_run += 1;
            continue;
        };
        let true_mm = true_mm(&truth, &hop);
        surveyed.distances.push(Distance {
            from: layout.node_name(hop.from).to_owned(),
            to: layout.node_name(hop.to).to_owned(),
            true_mm,
            off_mm: length - true_mm,
            uncertainty_mm: uncertainty,
            path_off_mm: path_length(&hop).map_or(0.0, |path_length| path_length / factor - true_mm),
            is_known: known_hop.is_some_and(|known| sections.section(known.id) == Some(section)),
        });
    }
    Ok(surveyed)
}

/// The result of one world.
pub struct Surveyed {
    /// The seed.
    pub seed: u64,
    distances: Vec<Distance>,
    /// Distances between sensors over which no train ran.
    not_run: usize,
    /// The standard deviation of the common scale, as stated by the survey.
    scale: f64,
    /// What happened in the simulated world, in words.
    pub incidents: Vec<String>,
}

/// The distance from one sensor to another.
struct Distance {
    from: String,
    to: String,
    true_mm: f64,
    /// The surveyed length minus the true one.
    off_mm: f64,
    /// The standard deviation that the survey states.
    uncertainty_mm: f64,
    /// The same error for a survey that knows all path lengths exactly, mean of both directions: the lower bound.
    path_off_mm: f64,
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

/// The longest edge between two sensors: the one to measure with a tape.
pub fn longest_between_sensors(layout: &Layout) -> Option<StretchId> {
    let single = layout.hops().filter(|hop| is_between_sensors(layout, hop) && hop.edges.len() == 1);
    let longest = single.max_by(|one, other| one.length.as_m().total_cmp(&other.length.as_m()))?;
    longest.edges.first().map(|edge| edge.stretch())
}

/// The layout without lengths, except the true length of one edge.
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

/// The mean path length of a hop over all trains and both directions.
fn path_length_mm(
    prepared: &PreparedTrains<'_>,
    trains: &[TrainId],
    layout: &Layout,
    hop: &Hop<'_>,
) -> Option<f64> {
    let back: Vec<_> = hop.edges.iter().rev().map(|edge| edge.twin()).collect();
    let sensors =
        [hop.from, hop.to].map(|node| Some([layout.sensor_at(node)?, layout.sensor_at(node.reverse())?]));
    let [Some([from, from_back]), Some([to, to_back])] = sensors else { return None };
    let truth = prepared.world().truth();
    let path_length = trains.iter().flat_map(|train| {
        [truth.path_length(*train, hop.edges, from, to), truth.path_length(*train, &back, to_back, from_back)]
    });
    let path_length: Vec<f64> = path_length.flatten().map(Length::as_mm).collect();
    Some(path_length.iter().sum::<f64>() / path_length.len().max(1) as f64)
}
