//! How far a train has come since it was found: places along its way as one growing number, for a curve over time.

use footplate_core::track::Layout;
use footplate_core::tracking::WayPoint;
use footplate_core::{Length, NodeId, Speed, TimeSpan, Timestamp};

/// The way of one train, from contact to contact by the survey and between them as it is believed.
#[derive(Debug)]
pub(super) struct WayTravelled {
    node: NodeId,
    /// The way up to that node.
    to_node: Length,
    /// The way up to where the train was last.
    last: Length,
    /// The contact that was passed last, and when.
    passed: Option<(NodeId, Timestamp)>,
}

impl WayTravelled {
    /// Begins where a train was found.
    pub(super) const fn from(at: WayPoint) -> Self {
        Self { node: at.node, to_node: Length::ZERO, last: at.way, passed: None }
    }

    /// The train is there now; how far it has come.
    pub(super) fn goes_on(&mut self, layout: &Layout, at: WayPoint) -> Length {
        if at.node != self.node {
            let hop = layout.hops_from(self.node).find(|hop| hop.to == at.node);
            // Where a contact was missed or the train has turned around, the curve goes on from where it was.
            self.to_node = hop.map_or(self.last - at.way, |hop| self.to_node + hop.length);
            self.node = at.node;
        }
        self.last = self.to_node + at.way;
        self.last
    }

    /// The train passes a contact; the middle of the time since the one before and its mean speed in that time, if the two
    /// are neighbours.
    pub(super) fn passes(
        &mut self,
        layout: &Layout,
        node: NodeId,
        time: Timestamp,
    ) -> Option<(Timestamp, Speed)> {
        self.goes_on(layout, WayPoint { node, way: Length::ZERO });
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

    /// The way up to the contact that was passed last.
    pub(super) const fn at_contact(&self) -> Length {
        self.to_node
    }
}

#[cfg(test)]
mod tests {
    use footplate_store::layout_named;

    use super::*;

    #[test]
    fn a_way_grows_by_the_survey_at_contacts_and_never_jumps_where_one_was_missed() {
        let layout = layout_named("track-a").expect("built in").layout;
        let node = |name| layout.node_named(name).expect("a contact");
        let hop = layout.hops_from(node("C13")).next().expect("a hop");
        let (to, length) = (hop.to, hop.length);
        let at = |node, mm| WayPoint { node, way: Length::from_mm(mm) };
        let mut way = WayTravelled::from(at(node("C13"), 0.0));
        assert_eq!(way.passes(&layout, node("C13"), Timestamp::from_s(10.0)), None);
        assert_eq!(way.goes_on(&layout, at(node("C13"), 120.0)).as_mm().round(), 120.0);
        // Two seconds over the hop: its length is in the layout file.
        let (middle, mean) = way.passes(&layout, to, Timestamp::from_s(12.0)).expect("neighbours");
        assert_eq!(middle, Timestamp::from_s(11.0));
        assert!((mean.as_m_per_s() - length.as_m() / 2.0).abs() < 1e-9);
        assert_eq!(way.at_contact(), length);
        // The other way round no hop leads back: the curve goes on where it was.
        let before = way.goes_on(&layout, at(to, 50.0));
        let after = way.goes_on(&layout, at(node("C13"), 30.0));
        assert!((after - before).abs().as_mm() < 1e-9);
    }
}
