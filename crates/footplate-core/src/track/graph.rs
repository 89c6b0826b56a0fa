//! The track graph: nodes in pairs, edges in pairs, and the edges that leave each node.
//!
//! The two nodes of a place are numbered 2p and 2p + 1, the two edges of a stretch 2s and 2s + 1. So the
//! reverse of a node and the twin of an edge differ in one bit, and exist by construction. Edges may be 0 mm
//! long: no formula here divides by a length.

use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId, SensorId, StretchId, TurnoutId};
use crate::track::hop::Hops;
use crate::track::{Block, Crossing, HopId, Leg, StretchLength, Survey, TurnoutStates, Zone};
use crate::units::Length;

impl NodeId {
    /// The node of the same place in the opposite direction of travel.
    #[inline]
    #[must_use]
    pub const fn reverse(self) -> Self {
        Self(self.0 ^ 1)
    }

    pub(crate) const fn first_of(pair: usize) -> Self {
        Self(2 * pair as u16)
    }

    pub(crate) const fn pair(self) -> usize {
        self.0 as usize / 2
    }
}

impl EdgeId {
    /// The edge over the same rails in the opposite direction.
    #[inline]
    #[must_use]
    pub const fn twin(self) -> Self {
        Self(self.0 ^ 1)
    }

    /// The rails themselves, the same for an edge and its twin.
    #[inline]
    #[must_use]
    pub const fn stretch(self) -> StretchId {
        StretchId(self.0 / 2)
    }
}

/// One direction of travel over one place.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: NodeKind,
    /// The edges that leave it.
    pub outgoing: OutgoingEdges,
}

/// The kind of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NodeKind {
    /// A sensor, or the entry of a block.
    Sensor(SensorId),
    /// The boundary of a block, in the direction that leads onto track without a detector.
    Boundary,
    /// A turnout, approached at its toe.
    Branch(TurnoutId),
    /// A turnout, approached on one of its legs.
    Merge(TurnoutId),
    /// The end of a track, for trains that enter the layout there.
    Enter,
    /// The end of a track, for trains that leave the layout there.
    Exit,
}

/// The edges that leave a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutgoingEdges {
    /// One edge.
    Ahead(EdgeId),
    /// One edge for each leg of a turnout.
    Legs {
        /// The edge while the turnout is set straight.
        straight: EdgeId,
        /// The edge while the turnout is set curved.
        curved: EdgeId,
    },
    /// None: the track ends.
    Ended,
}

impl OutgoingEdges {
    /// The edges, the straight leg before the curved one.
    pub fn edges(self) -> impl DoubleEndedIterator<Item = EdgeId> {
        let (first, second) = match self {
            Self::Ahead(edge) => (Some(edge), None),
            Self::Legs { straight, curved } => (Some(straight), Some(curved)),
            Self::Ended => (None, None),
        };
        first.into_iter().chain(second)
    }
}

/// A stretch of rail in one direction of travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Where it begins.
    pub from: NodeId,
    /// The leg on which it begins, if it begins at a branch.
    pub leg: Option<Leg>,
    /// Where it ends.
    pub to: NodeId,
    /// Its estimated length, which may be zero.
    pub length: Length,
    /// The length as surveyed, with its uncertainty.
    pub known: StretchLength,
}

/// A checked layout. Ids that it does not have give `None` or no edges.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    pub(crate) name: String,
    pub(crate) survey: Survey,
    pub(crate) nodes: Vec<Node>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) names: BTreeMap<String, NodeId>,
    /// By the sensor's number.
    pub(crate) sensors: Vec<Option<NodeId>>,
    /// The branch of each turnout.
    pub(crate) turnouts: BTreeMap<TurnoutId, NodeId>,
    pub(crate) never_both_curved: Vec<[TurnoutId; 2]>,
    /// The partner of each turnout that is in a pair.
    pub(crate) partners: BTreeMap<TurnoutId, TurnoutId>,
    pub(crate) hops: Hops,
    /// One standard deviation of hops whose total length is better known than their edges, in both directions.
    pub(crate) distances: BTreeMap<HopId, Length>,
    pub(crate) zones: Vec<Zone>,
    /// The zone of each restricted stretch, as an index into `zones`.
    pub(crate) restricted: BTreeMap<StretchId, usize>,
    pub(crate) blocks: Vec<Block>,
    /// The block of each entry, as an index into `blocks`.
    pub(crate) entered: BTreeMap<SensorId, usize>,
    /// The two directions of each sensor that reports one number for both, by either; the first has that number.
    pub(crate) undirected: BTreeMap<SensorId, [SensorId; 2]>,
    pub(crate) crossings: Vec<Crossing>,
}

impl Layout {
    /// The name of the layout.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How well the lengths are known.
    pub const fn survey(&self) -> &Survey {
        &self.survey
    }

    /// One standard deviation of the length of a hop, if the survey knows it better than its edges.
    pub fn surveyed_distance(&self, hop: HopId) -> Option<Length> {
        self.distances.get(&hop).copied()
    }

    /// Whether the length of every stretch was measured or estimated.
    pub fn is_measured(&self) -> bool {
        self.edges.iter().all(|edge| edge.known != StretchLength::Unknown)
    }

    /// A node.
    #[inline]
    pub fn node(&self, node: NodeId) -> Option<&Node> {
        self.nodes.get(usize::from(node.0))
    }

    /// All nodes in the order of their numbers.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = (NodeId, &Node)> {
        self.nodes.iter().enumerate().map(|(number, node)| (NodeId(number as u16), node))
    }

    /// The name of a node, or `?` for a node of another layout.
    pub fn node_name(&self, node: NodeId) -> &str {
        self.node(node).map_or("?", |node| node.name.as_str())
    }

    /// The node of a name.
    pub fn node_named(&self, name: &str) -> Option<NodeId> {
        self.names.get(name).copied()
    }

    /// The node at which a sensor reports.
    #[inline]
    pub fn sensor_node(&self, sensor: SensorId) -> Option<NodeId> {
        self.sensors.get(usize::from(sensor.0)).copied().flatten()
    }

    /// The sensor at a node.
    #[inline]
    pub fn sensor_at(&self, node: NodeId) -> Option<SensorId> {
        match self.node(node)?.kind {
            NodeKind::Sensor(sensor) => Some(sensor),
            _ => None,
        }
    }

    /// The sensor of a name.
    pub fn sensor_named(&self, name: &str) -> Option<SensorId> {
        self.sensor_at(self.node_named(name)?)
    }

    /// The name of a sensor, the name of a detector's block, or `?` for a sensor of another layout.
    pub fn sensor_name(&self, sensor: SensorId) -> &str {
        let of_block = || self.block_of_detector(sensor).map_or("?", |block| block.name.as_str());
        self.sensor_node(sensor).map_or_else(of_block, |node| self.node_name(node))
    }

    /// All sensors in the order of their numbers.
    pub fn sensors(&self) -> impl Iterator<Item = (SensorId, NodeId)> {
        (0..).zip(&self.sensors).filter_map(|(number, node)| Some((SensorId(number), (*node)?)))
    }

    /// All turnouts in the order of their numbers, with their branches.
    pub fn turnouts(&self) -> impl ExactSizeIterator<Item = (TurnoutId, NodeId)> {
        self.turnouts.iter().map(|(turnout, branch)| (*turnout, *branch))
    }

    /// The branch of a turnout.
    pub fn branch(&self, turnout: TurnoutId) -> Option<NodeId> {
        self.turnouts.get(&turnout).copied()
    }

    /// Pairs of turnouts of which at most one may be set curved.
    pub fn never_both_curved(&self) -> &[[TurnoutId; 2]] {
        &self.never_both_curved
    }

    /// The turnout in the same place that has to be set straight before this one may be set curved.
    pub fn never_curved_with(&self, turnout: TurnoutId) -> Option<TurnoutId> {
        self.partners.get(&turnout).copied()
    }

    /// A pair of turnouts in one place that are both known to be curved, which is illegal.
    pub fn illegal_pair(&self, turnouts: &TurnoutStates) -> Option<[TurnoutId; 2]> {
        let is_curved = |turnout: &TurnoutId| turnouts.get(*turnout) == Some(Leg::Curved);
        self.never_both_curved.iter().find(|pair| pair.iter().all(is_curved)).copied()
    }

    /// An edge.
    #[inline]
    pub fn edge(&self, edge: EdgeId) -> Option<&Edge> {
        self.edges.get(usize::from(edge.0))
    }

    /// All edges in the order of their numbers.
    pub fn edges(&self) -> impl ExactSizeIterator<Item = (EdgeId, &Edge)> {
        self.edges.iter().enumerate().map(|(number, edge)| (EdgeId(number as u16), edge))
    }

    /// Number of stretches: edges without their twins.
    pub fn stretch_count(&self) -> usize {
        self.edges.len() / 2
    }

    /// Total length of all rails.
    pub fn total_length(&self) -> Length {
        self.edges.iter().map(|edge| edge.length).sum::<Length>() / 2.0
    }

    /// The edge from one node to another, if one leads there directly; the shorter one of two legs.
    pub fn edge_between(&self, from: NodeId, to: NodeId) -> Option<EdgeId> {
        self.outgoing(from)
            .edges()
            .filter_map(|id| Some((id, self.edge(id)?)))
            .filter(|(_, edge)| edge.to == to)
            .min_by(|(_, one), (_, other)| one.length.as_m().total_cmp(&other.length.as_m()))
            .map(|(id, _)| id)
    }

    /// The edges that leave a node.
    #[inline]
    pub fn outgoing(&self, node: NodeId) -> OutgoingEdges {
        self.node(node).map_or(OutgoingEdges::Ended, |node| node.outgoing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::{oval, oval_plan};
    use alloc::vec;

    #[test]
    fn every_node_has_a_reverse_and_every_edge_an_equally_long_twin() {
        let layout = oval();
        for (id, _) in layout.nodes() {
            assert_eq!(id.reverse().reverse(), id);
            assert!(layout.node(id.reverse()).is_some());
        }
        for (id, edge) in layout.edges() {
            let twin = layout.edge(id.twin()).unwrap();
            assert_eq!((twin.from, twin.to), (edge.to.reverse(), edge.from.reverse()));
            assert_eq!(twin.length, edge.length);
            assert_eq!(id.stretch(), id.twin().stretch());
            assert!(layout.outgoing(edge.from).edges().any(|leaving| leaving == id));
        }
        assert!((layout.total_length().as_mm() - 1_540.0).abs() < 1e-9, "{:?}", layout.total_length());
    }

    #[test]
    fn turnouts_in_one_place_are_never_both_curved() {
        let mut plan = oval_plan();
        plan.never_both_curved = vec![[TurnoutId(1), TurnoutId(2)]];
        let layout = Layout::build(&plan).unwrap();
        assert_eq!(layout.never_curved_with(TurnoutId(2)), Some(TurnoutId(1)));
        assert_eq!(layout.never_curved_with(TurnoutId(3)), None);
        let mut states: TurnoutStates = [(TurnoutId(1), Leg::Curved)].into_iter().collect();
        assert_eq!(layout.illegal_pair(&states), None);
        states.set(TurnoutId(2), Leg::Curved);
        assert_eq!(layout.illegal_pair(&states), Some([TurnoutId(1), TurnoutId(2)]));
        assert_eq!(oval().illegal_pair(&states), None);
    }

    #[test]
    fn names_and_numbers_lead_to_each_other() {
        let layout = oval();
        let node = layout.node_named("B2").unwrap();
        assert_eq!(layout.sensor_at(node), Some(SensorId(3)));
        assert_eq!(layout.sensor_node(SensorId(3)), Some(node));
        assert_eq!(layout.sensor_name(SensorId(3)), "B2");
        assert_eq!(layout.node_name(layout.branch(TurnoutId(2)).unwrap()), "BR2");
        assert_eq!(layout.sensor_named("BR2"), None);
        assert_eq!(layout.node_named("b2"), None);
        assert_eq!(layout.sensor_name(SensorId(u16::MAX)), "?");
        assert_eq!(layout.outgoing(NodeId(u16::MAX)), OutgoingEdges::Ended);
    }
}
