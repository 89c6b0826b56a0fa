//! Known lengths: measured by tape, estimated from runs of trains, or unknown.

use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;

use crate::track::build::{checked, is_plausible};
use crate::track::{HopId, Layout, LayoutError};
use crate::units::Length;

/// The uncertainty of the lengths of a layout, and its origin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Survey {
    /// One standard deviation of the length of an edge that has none of its own.
    pub uncertainty: Length,
    /// The origin of that figure.
    pub origin: String,
    /// One standard deviation of the common scale of all lengths, as a fraction: lengths estimated from runs depend
    /// on the few that were measured. Zero if every edge was measured.
    pub scale: f64,
    /// Distances between neighbouring sensors that are known better than the edges between them.
    pub distances: Vec<SurveyedDistance>,
}

impl Survey {
    /// Every edge was measured independently, with one standard deviation for all.
    pub const fn taped(uncertainty: Length, origin: String) -> Self {
        Self { uncertainty, origin, scale: 0.0, distances: Vec::new() }
    }
}

/// A distance between two neighbouring sensors: the sum of the edges between them is better known than each edge.
#[derive(Debug, Clone, PartialEq)]
pub struct SurveyedDistance {
    /// The name of the node it begins at.
    pub from: String,
    /// The name of the node it ends at; a single path without another sensor leads there.
    pub to: String,
    /// The sum of the edges between them, to a millimetre.
    pub length: Length,
    /// One standard deviation of it, without the common scale.
    pub uncertainty: Length,
}

/// The length of a stretch of rail and how it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StretchLength {
    /// Measured, with the uncertainty of the survey; zero is legal between turnouts in one place.
    Measured(Length),
    /// Estimated, with an uncertainty of its own.
    Estimated {
        /// The length.
        length: Length,
        /// One standard deviation of it.
        uncertainty: Length,
    },
    /// Not measured.
    Unknown,
}

impl From<Length> for StretchLength {
    fn from(length: Length) -> Self {
        Self::Measured(length)
    }
}

/// Mean and standard deviation of the length of an edge that was not measured. Edges of layouts are 50 to 2000 mm
/// long, and short ones are more frequent: those of the built-in layouts are 0 to 875 mm, 248 mm in the mean.
const USUAL: (Length, Length) = (Length::from_mm(350.0), Length::from_mm(350.0));

/// Edges are rarely shorter (built-in layouts: one in ten, not counting those between turnouts in one place).
const SHORTEST_USUAL: Length = Length::from_mm(100.0);

impl StretchLength {
    /// The most likely length and one standard deviation of it.
    #[must_use]
    pub fn estimate(self, survey: &Survey) -> (Length, Length) {
        match self {
            Self::Measured(length) => (length, survey.uncertainty),
            Self::Estimated { length, uncertainty } => (length, uncertainty),
            Self::Unknown => USUAL,
        }
    }

    /// A lower bound of the length (about two standard deviations), for stops and throws before its end.
    #[must_use]
    pub fn shortest(self) -> Length {
        match self {
            Self::Measured(length) => length,
            Self::Estimated { length, uncertainty } => {
                (length + -2.0 * uncertainty).max(length.min(SHORTEST_USUAL))
            }
            Self::Unknown => SHORTEST_USUAL,
        }
    }
}

impl Layout {
    /// The same layout with other lengths, by stretch, and their survey.
    ///
    /// # Errors
    /// As [`build`](Self::build), for stretches and distances.
    pub fn surveyed(&self, lengths: &[StretchLength], survey: Survey) -> Result<Self, LayoutError> {
        let mut layout = Self { survey, ..self.clone() };
        for (stretch, known) in lengths.iter().enumerate() {
            let length = checked(stretch, *known, &layout.survey)?;
            let first = 2 * stretch;
            let before = layout.edges.get(first).map_or(Length::ZERO, |edge| edge.length);
            for edge in layout.edges.get_mut(first..first + 2).into_iter().flatten() {
                (edge.length, edge.known) = (length, *known);
            }
            // A crossing stays at its part of the edge.
            for at in layout.crossings.iter_mut().flat_map(|crossing| &mut crossing.tracks) {
                if usize::from(at.edge.0) == first && before > Length::ZERO {
                    at.offset = at.offset * (length / before);
                }
            }
        }
        layout.with_hops()
    }
}

/// One standard deviation of each surveyed distance by its hop, in both directions.
pub(super) fn surveyed_distances(layout: &Layout) -> Result<BTreeMap<HopId, Length>, LayoutError> {
    let mut known = BTreeMap::new();
    for (distance, entry) in layout.survey.distances.iter().enumerate() {
        if !is_plausible(entry.uncertainty) {
            return Err(LayoutError::IllegalDistanceUncertainty { distance, found: entry.uncertainty });
        }
        let find = |name: &String| {
            let unknown =
                || LayoutError::NoDistance { distance, from: entry.from.clone(), to: entry.to.clone() };
            layout.node_named(name).filter(|node| layout.sensor_at(*node).is_some()).ok_or_else(unknown)
        };
        let (from, to) = (find(&entry.from)?, find(&entry.to)?);
        for (from, to) in [(from, to), (to.reverse(), from.reverse())] {
            let mut hops = layout.hops_from(from).filter(|hop| hop.to == to);
            let (Some(hop), None) = (hops.next(), hops.next()) else {
                let (from, to) = (entry.from.clone(), entry.to.clone());
                return Err(LayoutError::NoDistance { distance, from, to });
            };
            // Files contain rounded lengths.
            let off = (hop.length - entry.length).abs();
            if off.as_mm().is_nan() || off > Length::from_mm(1.0) {
                let (found, edges) = (entry.length, hop.length);
                return Err(LayoutError::UnequalDistance { distance, found, edges });
            }
            known.insert(hop.id, entry.uncertainty);
        }
    }
    Ok(known)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::EdgeId;
    use crate::track::Position;
    use crate::track::example::{oval, oval_plan};
    use alloc::vec;
    use std::string::ToString;

    fn distance(from: &str, to: &str, mm: f64) -> SurveyedDistance {
        let (from, to) = (from.to_string(), to.to_string());
        SurveyedDistance { from, to, length: Length::from_mm(mm), uncertainty: Length::from_mm(3.0) }
    }

    #[test]
    fn an_edge_without_a_length_has_the_usual_length_and_may_be_short() {
        let mut plan = oval_plan();
        plan.stretches[6].length = StretchLength::Unknown;
        let layout = Layout::build(&plan).unwrap();
        assert!(!layout.is_measured() && oval().is_measured());
        let hop = |from: &str| layout.hops_from(layout.node_named(from).unwrap()).next().unwrap();
        assert_eq!(hop("D1").length, Length::from_mm(350.0));
        assert_eq!(layout.least_length(&hop("D1")), Length::from_mm(100.0));
        assert!((layout.least_length(&hop("B1")).as_mm() - 300.0).abs() < 1e-9);
        plan.stretches[8].length = StretchLength::Unknown;
        let layout = Layout::build(&plan).unwrap();
        let end = layout.hops_from(layout.node_named("E1").unwrap()).next().unwrap();
        assert_eq!(layout.least_length(&end), Length::ZERO, "a train has to stop at the last sensor");
    }

    #[test]
    fn lengths_from_a_survey_come_with_their_uncertainty_and_the_distances_between_sensors() {
        let layout = oval();
        let mut lengths: Vec<StretchLength> = layout.edges().step_by(2).map(|(_, edge)| edge.known).collect();
        let uncertainty = Length::from_mm(80.0);
        lengths[0] = StretchLength::Estimated { length: Length::from_mm(120.0), uncertainty };
        let survey = Survey { distances: vec![distance("A1", "B1", 320.0)], ..layout.survey().clone() };
        let surveyed = layout.surveyed(&lengths, survey).unwrap();
        let hop = surveyed.hops_from(surveyed.node_named("B2").unwrap()).next().unwrap();
        assert!((hop.length.as_mm() - 320.0).abs() < 1e-9);
        assert_eq!(surveyed.surveyed_distance(hop.id), Some(Length::from_mm(3.0)));
        assert_eq!(surveyed.least_length(&hop), Length::from_mm(314.0));
    }

    #[test]
    fn a_crossing_stays_at_its_part_of_an_edge_of_another_length() {
        let at = |edge, mm| Position { edge, offset: Length::from_mm(mm) };
        // Stated from the other end of the first edge, of 100 mm.
        let layout = oval().with_crossing([at(EdgeId(1), 25.0), at(EdgeId(14), 10.0)]).unwrap();
        let mut lengths: Vec<StretchLength> = layout.edges().step_by(2).map(|(_, edge)| edge.known).collect();
        lengths[0] = StretchLength::Measured(Length::from_mm(60.0));
        let surveyed = layout.surveyed(&lengths, layout.survey().clone()).unwrap();
        let offsets = surveyed.crossings()[0].tracks.map(|at| at.offset.as_mm().round());
        assert_eq!(offsets, [45.0, 10.0]);
    }

    #[test]
    fn a_distance_that_is_not_the_sum_of_its_edges_is_rejected() {
        let layout = oval();
        let lengths: Vec<StretchLength> = layout.edges().step_by(2).map(|(_, edge)| edge.known).collect();
        let refusal = |given: SurveyedDistance| {
            let survey = Survey { distances: vec![given], ..layout.survey().clone() };
            layout.surveyed(&lengths, survey).unwrap_err().to_string()
        };
        assert_eq!(
            refusal(distance("A1", "B1", 380.0)),
            "a distance of 380 mm is not the sum of the edges between, 300 mm: correct one or the other"
        );
        assert!(
            refusal(distance("A1", "D1", 600.0))
                .starts_with("there is no single path from sensor `A1` to `D1`")
        );
        let mut survey = layout.survey().clone();
        survey.scale = 1.5;
        let plan = crate::track::LayoutPlan { survey, ..oval_plan() };
        let error = Layout::build(&plan).unwrap_err();
        assert_eq!(error.to_string(), "an uncertainty of the scale of 150 % is not between 0 and 100 %");
    }
}
