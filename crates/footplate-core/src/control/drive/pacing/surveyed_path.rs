//! The way ahead of a train as the survey has it, beside the way as the train feels it.

use crate::ids::NodeId;
use crate::model::MotionModel;
use crate::tracking::TrackContext;
use crate::units::Length;

/// Contact-to-contact hops looked at: 3 m of the densest known track.
const MAX_HOPS: usize = 12;

/// Hops ahead of a contact, by their ends in both measures (m past the contact).
#[derive(Debug, Clone, Copy)]
pub(super) struct SurveyedPath {
    ends: [[f64; 2]; MAX_HOPS],
    count: usize,
}

impl SurveyedPath {
    /// The way ahead of a node as the turnouts lie.
    pub(super) fn ahead(context: TrackContext<'_>, model: &MotionModel, node: NodeId) -> Self {
        let mut way = Self { ends: [[0.0; 2]; MAX_HOPS], count: 0 };
        let (mut felt, mut surveyed) = (0.0, 0.0);
        for (hop, end) in context.hops_ahead(node).zip(&mut way.ends) {
            felt += model.length(context.sections, &hop)[0].as_m();
            surveyed += hop.length.as_m();
            *end = [felt, surveyed];
            way.count += 1;
        }
        way
    }

    /// The way as the train feels it, for what is planned in its own measure.
    pub(super) const fn unscaled() -> Self {
        Self { ends: [[0.0; 2]; MAX_HOPS], count: 0 }
    }

    /// The surveyed way to where the train feels it has come so far: in proportion within a hop, and beyond the hops that
    /// are known as within the last.
    pub(super) fn surveyed(&self, way: f64) -> f64 {
        let ([mut felt, mut surveyed], mut slope) = ([0.0, 0.0], 1.0);
        for (nth, [until, there]) in self.ends.iter().take(self.count).enumerate() {
            if *until > felt {
                slope = (there - surveyed) / (until - felt);
            }
            // The last one goes on for ever.
            if way <= *until || nth + 1 == self.count {
                break;
            }
            [felt, surveyed] = [*until, *there];
        }
        surveyed + (way - felt) * slope
    }
}

/// The surveyed way from one contact to the next time another is passed: once round if it is the same.
pub(super) fn surveyed_distance(context: TrackContext<'_>, from: NodeId, to: NodeId) -> Option<Length> {
    let mut way = Length::ZERO;
    for hop in context.hops_ahead(from).take(context.layout.nodes().len()) {
        way += hop.length;
        if hop.to == to {
            return Some(way);
        }
    }
    None
}
