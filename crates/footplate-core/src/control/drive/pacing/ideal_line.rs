//! The straight line of a train that runs at one speed.

use crate::ids::NodeId;
use crate::time::Timestamp;
use crate::tracking::TrackContext;
use crate::units::{Length, Speed};

use super::surveyed_path::surveyed_distance;

/// A speed held from a place and a time on, in surveyed lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::control::drive) struct IdealLine {
    /// The contact from which ways are counted.
    pub(in crate::control::drive) node: NodeId,
    /// The surveyed way past it ...
    pub(in crate::control::drive) way: Length,
    /// ... at this time.
    pub(in crate::control::drive) time: Timestamp,
    pub(in crate::control::drive) speed: Speed,
}

impl IdealLine {
    /// Surveyed way past the contact (m).
    pub(super) fn place(&self, time: Timestamp) -> f64 {
        (self.way + self.speed * (time - self.time)).as_m()
    }

    /// The same line counted from another contact, for a train that is near it: one that was passed since, or one before
    /// if a report has turned out to be another train's. `None` if no way leads from one to the other.
    pub(super) fn recount_from(
        self,
        context: TrackContext<'_>,
        node: NodeId,
        now: Timestamp,
    ) -> Option<Self> {
        if node == self.node {
            // Once more if it has been round since.
            let circuit_length = surveyed_distance(context, node, node);
            let laps = circuit_length.map_or(0.0, |circuit_length| {
                libm::round((self.place(now) / circuit_length.as_m()).max(0.0))
            });
            let way = self.way - circuit_length.unwrap_or(Length::ZERO) * laps;
            return Some(Self { way, ..self });
        }
        let after = surveyed_distance(context, self.node, node).map(|between| self.way - between);
        let before = surveyed_distance(context, node, self.node).map(|between| self.way + between);
        let off = |way: &Length| Self { way: *way, ..self }.place(now).abs();
        let way = after.into_iter().chain(before).min_by(|one, other| off(one).total_cmp(&off(other)))?;
        Some(Self { node, way, ..self })
    }
}
