//! The lengths of a layout from what trains made of them: a survey without a tape.
//!
//! Letters: `x` length of an edge less what was thought of it, `l` what train `t` makes of a section, `m` what was thought of
//! that, `g` factor by which the train feels everything longer. Each section that a train ran over says
//! `Σ x + c − g l = l − m`, give or take what the train does not know of it and what it alone feels. `c` is what all trains
//! feel of the section's curves and slopes, and where its sensors close: no second train adds to that. Each `g` is free, so that trains tell how long sections are against each other; how long all of them are
//! the measured edges tell. All unknowns are found together, with edges as they were known before as measurements of their
//! own (Gauss, 1821); rows that are off count less (Huber, 1964).

use alloc::string::ToString as _;
use alloc::vec;
use alloc::vec::Vec;

use super::section_index::SectionIndex;
use crate::linalg::{NormalEquations, Solution};
use crate::model::{MotionFit, PATH_LENGTH_SPREAD, section_variance};
use crate::track::{Hop, Layout, LayoutError, StretchLength, Survey, SurveyedDistance};
use crate::units::Length;

/// Sensors close within this of where a tape would be laid, one standard deviation (m): half a pickup's springiness and a
/// sensor's own length.
const SENSOR_PLACE: f64 = 0.005;
/// The part of its variance that what trains feel of a section, and where its sensors close, have in common: curves and sensors
/// are the same, bogies and pickups are not.
const IN_COMMON: f64 = 0.5;
/// An edge that was not measured is held to the usual lengths of edges by so much less than one of known length: what is usual
/// elsewhere is no measure of this layout's scale.
const LOOSER: f64 = 3.0;
/// A train may feel everything longer by any factor.
const ANY_FACTOR: f64 = 10.0;
/// An edge of no length, where two turnouts are one (m).
const EXACT: f64 = 1e-4;
/// Rows beyond this many standard deviations count linearly.
const HUBER: f64 = 2.5;
/// How often rows are weighed anew.
const WEIGHED: usize = 4;
/// No distance is known better than to this (m).
const LEAST: f64 = 0.001;

/// Lengths of edges and distances between sensors, with their uncertainty.
#[derive(Debug, Clone)]
pub struct TrackSurvey {
    /// By stretch, its length and one standard deviation (m); `None` where it was measured before and no train added to it.
    edges: Vec<Option<(f64, f64)>>,
    /// By section, its length and one standard deviation (m), for those that a train ran over.
    sections: Vec<Option<(f64, f64)>>,
    /// One standard deviation of the factor that all of them have in common.
    scale: f64,
}

/// What a train says of a section.
struct Row {
    section: usize,
    train: usize,
    path_length: f64,
    variance: f64,
}

impl TrackSurvey {
    /// The survey that follows from what is known of trains on a layout with these sections. `None` if no train has run over any
    /// section.
    pub fn of(layout: &Layout, sections: &SectionIndex, trains: &[&MotionFit]) -> Option<Self> {
        let rows: Vec<Row> =
            trains.iter().enumerate().flat_map(|(train, fit)| rows_of(sections, train, fit)).collect();
        if rows.is_empty() {
            return None;
        }
        let hops = hops_of(layout, sections);
        let (count, edges) =
            (layout.stretch_count(), |section: usize| hops.get(section).and_then(Option::as_ref));
        let terms = |row: &Row| {
            let mut terms = edges(row.section).map(terms_of).unwrap_or_default();
            terms.push((count + row.train, -row.path_length));
            terms.push((count + trains.len() + row.section, 1.0));
            terms
        };
        let mut known = prior(layout, trains.len());
        known.extend((0..sections.len()).map(|section| {
            let length = sections.surveyed_length(section);
            let path_length =
                rows.iter().find(|row| row.section == section).map_or(length, |row| row.path_length);
            (0.0, IN_COMMON * path_length_variance(path_length))
        }));
        let mut weights = vec![1.0; rows.len()];
        let mut solution: Option<Solution> = None;
        for _ in 0..WEIGHED {
            let mut equations = NormalEquations::new(known.len());
            for (unknown, (value, variance)) in known.iter().enumerate() {
                equations.add(&[(unknown, 1.0)], *value, *variance);
            }
            for (terms, variance) in distances(layout) {
                equations.add(&terms, 0.0, variance);
            }
            for (row, weight) in rows.iter().zip(&weights) {
                let longer = row.path_length - sections.surveyed_length(row.section);
                equations.add(&terms(row), longer, row.variance / weight);
            }
            let found = equations.solve()?;
            for (row, weight) in rows.iter().zip(&mut weights) {
                let sum: f64 =
                    terms(row).iter().map(|(unknown, slope)| slope * value(&found, *unknown)).sum();
                let off = row.path_length - sections.surveyed_length(row.section) - sum;
                *weight = (HUBER * libm::sqrt(row.variance) / off.abs().max(f64::MIN_POSITIVE)).min(1.0);
            }
            // Where only sums are known, their parts may come out below nothing.
            for ((unknown, known), (_, edge)) in known.iter_mut().enumerate().zip(layout.edges().step_by(2)) {
                if value(&found, unknown) < -edge.length.as_m() {
                    *known = (-edge.length.as_m(), EXACT * EXACT);
                }
            }
            solution = Some(found);
        }
        let solution = solution?;
        let run_over = |section: usize| rows.iter().any(|row| row.section == section);
        let found: Vec<Option<(f64, f64)>> = (0..sections.len())
            .map(|section| {
                let hop = edges(section).filter(|_| run_over(section))?;
                let terms = terms_of(hop);
                let longer: f64 = terms.iter().map(|(edge, part)| part * value(&solution, *edge)).sum();
                let variance = solution.variance_of(&terms);
                Some((sections.surveyed_length(section) + longer, libm::sqrt(variance.max(LEAST * LEAST))))
            })
            .collect();
        let scale = common_scale(&solution, &found, edges);
        let touched = |edge: usize| {
            let on = |section: &usize| {
                edges(*section).is_some_and(|hop| terms_of(hop).iter().any(|(e, _)| *e == edge))
            };
            (0..sections.len()).filter(|section| run_over(*section)).any(|section| on(&section))
        };
        let lengths = layout.edges().step_by(2).enumerate().map(|(stretch, (_, edge))| {
            let length = (edge.length.as_m() + value(&solution, stretch)).max(0.0);
            let before = edge.known.estimate(layout.survey()).1.as_m();
            touched(stretch).then(|| (length, libm::sqrt(solution.variance(stretch)).min(before)))
        });
        Some(Self { edges: lengths.collect(), sections: found, scale })
    }

    /// The distance from sensor to sensor over a section and one standard deviation of it, what all distances have in common
    /// included; `None` where no train ran.
    pub fn distance(&self, section: usize) -> Option<[Length; 2]> {
        let (length, deviation) = self.sections.get(section).copied().flatten()?;
        Some([Length::from_m(length), Length::from_m(deviation)])
    }

    /// One standard deviation of the factor that all lengths have in common, as a part.
    pub const fn scale(&self) -> f64 {
        self.scale
    }

    /// The layout with these lengths.
    ///
    /// # Errors
    /// The lengths make no layout, such as turnouts in one place that lie in a ring.
    pub fn applied_to(&self, layout: &Layout, sections: &SectionIndex) -> Result<Layout, LayoutError> {
        let before = layout.edges().step_by(2).map(|(_, edge)| edge.known);
        let lengths: Vec<StretchLength> = before
            .zip(&self.edges)
            .map(|(before, found)| match (before, found) {
                // Two turnouts in one place are there by construction.
                (StretchLength::Measured(Length::ZERO), _) | (_, None) => before,
                (_, Some((length, uncertainty))) => StretchLength::Estimated {
                    length: Length::from_m(*length),
                    uncertainty: Length::from_m(*uncertainty),
                },
            })
            .collect();
        let hops = hops_of(layout, sections);
        let distances = hops.iter().flatten().filter_map(|hop| {
            let section = sections.section(hop.id)?;
            let [_, uncertainty] = self.distance(section)?.map(Length::as_m);
            let paths = layout.hops_from(hop.from).filter(|other| other.to == hop.to).count();
            let edges = hop.edges.iter().filter_map(|edge| lengths.get(usize::from(edge.stretch().0)));
            let sum: Length = edges.map(|edge| edge.estimate(layout.survey()).0).sum();
            let shared = self.scale * sum.as_m();
            let own = libm::sqrt((uncertainty * uncertainty - shared * shared).max(LEAST * LEAST));
            (paths == 1).then(|| SurveyedDistance {
                from: layout.node_name(hop.from).to_string(),
                to: layout.node_name(hop.to).to_string(),
                length: sum,
                uncertainty: Length::from_m(own),
            })
        });
        let survey = Survey { scale: self.scale, distances: distances.collect(), ..layout.survey().clone() };
        layout.surveyed(&lengths, survey)
    }
}

/// The hop from sensor to sensor that stands for each section.
fn hops_of<'l>(layout: &'l Layout, sections: &SectionIndex) -> Vec<Option<Hop<'l>>> {
    let mut hops = vec![None; sections.len()];
    for hop in layout.hops().filter(|hop| hop.sensor.is_some() && layout.sensor_at(hop.from).is_some()) {
        let slot = sections.section(hop.id).and_then(|section| hops.get_mut(section));
        if let Some(slot) = slot.filter(|slot| slot.is_none()) {
            *slot = Some(hop);
        }
    }
    hops
}

/// The edges of a hop; one that it passes twice counts twice.
fn terms_of(hop: &Hop<'_>) -> Vec<(usize, f64)> {
    let mut terms: Vec<(usize, f64)> = Vec::new();
    for edge in hop.edges.iter().map(|edge| usize::from(edge.stretch().0)) {
        match terms.iter_mut().find(|(known, _)| *known == edge) {
            Some((_, times)) => *times += 1.0,
            None => terms.push((edge, 1.0)),
        }
    }
    terms
}

/// What one train says, less what it was commanded beforehand.
fn rows_of(sections: &SectionIndex, train: usize, fit: &MotionFit) -> Vec<Row> {
    let fitted_with = fit.survey_test().applied_to(sections);
    let known: Vec<(usize, f64, f64)> =
        fit.model().sections().filter(|(section, ..)| sections.surveyed_length(*section) > 0.0).collect();
    let part = |section: usize, variance: f64| {
        let length = sections.surveyed_length(section);
        variance / (length * length)
    };
    // The factor is free: what the model does not know of it is no part of what single sections are known to.
    let shared = known.iter().map(|(section, _, v)| part(*section, *v)).fold(f64::INFINITY, f64::min);
    let rows = known.iter().filter_map(|(section, longer, variance)| {
        let length = sections.surveyed_length(*section);
        let before = section_variance(&fitted_with, *section);
        let own = ((part(*section, *variance) - shared) * length * length).max(LEAST * LEAST);
        // Posterior less prior: what the train itself has seen.
        let information = 1.0 / own - 1.0 / before;
        if information <= 0.0 {
            return None;
        }
        let path_length = length + longer / (own * information);
        let variance = 1.0 / information + (1.0 - IN_COMMON) * path_length_variance(path_length);
        Some(Row { section: *section, train, path_length, variance })
    });
    rows.collect()
}

/// Variance (m²) of what a train makes of a section of this length (m), however often it runs over it.
fn path_length_variance(path_length: f64) -> f64 {
    let feels = PATH_LENGTH_SPREAD * path_length;
    feels * feels + 2.0 * SENSOR_PLACE * SENSOR_PLACE
}

/// What is known beforehand of each unknown, edges and then factors, with the variance.
fn prior(layout: &Layout, trains: usize) -> Vec<(f64, f64)> {
    let edges = layout.edges().step_by(2).map(|(_, edge)| {
        let deviation = match edge.known {
            StretchLength::Measured(Length::ZERO) => EXACT,
            StretchLength::Unknown => LOOSER * edge.known.estimate(layout.survey()).1.as_m(),
            known => known.estimate(layout.survey()).1.as_m().max(EXACT),
        };
        (0.0, deviation * deviation)
    });
    edges.chain(core::iter::repeat_n((0.0, ANY_FACTOR * ANY_FACTOR), trains)).collect()
}

/// Distances that were known better than their edges, with their variances.
fn distances(layout: &Layout) -> Vec<(Vec<(usize, f64)>, f64)> {
    let known = layout.hops().filter(|hop| hop.from <= hop.to.reverse());
    let known = known.filter_map(|hop| {
        let deviation = layout.surveyed_distance(hop.id)?.as_m().max(LEAST);
        Some((terms_of(&hop), deviation * deviation))
    });
    known.collect()
}

/// One standard deviation of what all sections that were run over have in common, as a part.
fn common_scale<'h, 'l: 'h>(
    solution: &Solution,
    found: &[Option<(f64, f64)>],
    edges: impl Fn(usize) -> Option<&'h Hop<'l>>,
) -> f64 {
    let mut all: Vec<(usize, f64)> = Vec::new();
    let mut length = 0.0;
    for (section, found) in found.iter().enumerate() {
        let (Some((path_length, _)), Some(hop)) = (found, edges(section)) else { continue };
        length += path_length;
        for (edge, times) in terms_of(hop) {
            match all.iter_mut().find(|(known, _)| *known == edge) {
                Some((_, part)) => *part += times,
                None => all.push((edge, times)),
            }
        }
    }
    if length > 0.0 { libm::sqrt(solution.variance_of(&all).max(0.0)) / length } else { 0.0 }
}

fn value(solution: &Solution, unknown: usize) -> f64 {
    solution.values.get(unknown).copied().unwrap_or(0.0)
}
