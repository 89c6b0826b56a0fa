//! The distance that a train has travelled since it was located, as one growing number for charts.

use footplate_core::track::Layout;
use footplate_core::tracking::PathPoint;
use footplate_core::{Length, NodeId, Speed, TimeSpan, Timestamp};

/// The distance of one train: from sensor to sensor by the survey, between sensors by the estimate.
#[derive(Debug)]
pub(super) struct TravelledDistance {
    node: NodeId,
    /// The distance at that node.
    to_node: Length,
    /// The distance at the last position.
    last: Length,
    /// The last sensor passed, and when.
    passed: Option<(NodeId, Timestamp)>,
}

impl TravelledDistance {
    /// Starts where the train was located.
    pub(super) const fn from(at: PathPoint) -> Self {
        Self { node: at.node, to_node: Length::ZERO, last: at.distance, passed: None }
    }

    /// Moves to a position; returns the distance.
    pub(super) fn advance_to(&mut self, layout: &Layout, at: PathPoint) -> Length {
        if at.node != self.node {
            let hop = layout.hops_from(self.node).find(|hop| hop.to == at.node);
            // After a missed detection or a reversal the distance continues from its last value.
            self.to_node = hop.map_or(self.last - at.distance, |hop| self.to_node + hop.length);
            self.node = at.node;
        }
        self.last = self.to_node + at.distance;
        self.last
    }

    /// Moves to a sensor; returns the middle of the time since the sensor before and the mean speed in that time, if
    /// the two are neighbours.
    pub(super) fn pass_sensor(
        &mut self,
        layout: &Layout,
        node: NodeId,
        time: Timestamp,
    ) -> Option<(Timestamp, Speed)> {
        self.advance_to(layout, PathPoint { node, distance: Length::ZERO });
        let (from, before) = self.passed.replace((node, time))?;
        let hop = layout.hops_from(from).find(|hop| hop.to == node)?;
        let took = time - before;
        (took.as_s() > 0.0).then(|| {
            (
                before + TimeSpan::from_ns(took.as_ns() / 2),
                Speed::from_m_per_s(hop.length.as_m() / took.as_s()),
            )
        })
    }

    /// The distance at the last sensor.
    pub(super) const fn at_sensor(&self) -> Length {
        self.to_node
    }
}

#[cfg(test)]
mod tests {
    use footplate_store::layout_named;

    use super::*;

    #[test]
    fn the_distance_grows_by_the_survey_and_never_jumps_after_a_missed_detection() {
        let layout = layout_named("track-a").expect("built in").layout;
        let node = |name| layout.node_named(name).expect("a sensor");
        let hop = layout.hops_from(node("C13")).next().expect("a hop");
        let (to, length) = (hop.to, hop.length);
        let at = |node, mm| PathPoint { node, distance: Length::from_mm(mm) };
        let mut travelled = TravelledDistance::from(at(node("C13"), 0.0));
        assert_eq!(travelled.pass_sensor(&layout, node("C13"), Timestamp::from_s(10.0)), None);
        assert_eq!(travelled.advance_to(&layout, at(node("C13"), 120.0)).as_mm().round(), 120.0);
        // Two seconds over the hop; its length comes from the layout file.
        let (middle, mean) = travelled.pass_sensor(&layout, to, Timestamp::from_s(12.0)).expect("neighbours");
        assert_eq!(middle, Timestamp::from_s(11.0));
        assert!((mean.as_m_per_s() - length.as_m() / 2.0).abs() < 1e-9);
        assert_eq!(travelled.at_sensor(), length);
        // No hop leads back in the other direction: the distance continues from its last value.
        let before = travelled.advance_to(&layout, at(to, 50.0));
        let after = travelled.advance_to(&layout, at(node("C13"), 30.0));
        assert!((after - before).abs().as_mm() < 1e-9);
    }
}
