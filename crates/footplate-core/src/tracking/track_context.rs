//! What a train runs on: the layout, its sections and the known positions of its turnouts.

use crate::ids::{NodeId, SensorId};
use crate::model::survey::SectionIndex;
use crate::track::{Hop, Layout, TurnoutStates};

/// The track under a train; references only, copied freely.
#[derive(Debug, Clone, Copy)]
pub struct TrackContext<'g> {
    /// The layout.
    pub layout: &'g Layout,
    /// Its sections, which carry the lengths.
    pub sections: &'g SectionIndex,
    /// How the turnouts lie.
    pub turnouts: &'g TurnoutStates,
}

impl<'g> TrackContext<'g> {
    /// The one open hop that leads on from a node; `None` where the path divides over a turnout whose position is unknown.
    pub fn hop_from(&self, node: NodeId) -> Option<Hop<'g>> {
        let mut open = self.layout.open_hops_from(node, self.turnouts);
        let hop = open.next()?;
        open.next().is_none().then_some(hop)
    }

    /// The hops ahead of a node in order, as the turnouts lie: round and round on a circuit, or until the path ends or is
    /// unknown.
    pub fn hops_ahead(&self, from: NodeId) -> impl Iterator<Item = Hop<'g>> + use<'g> {
        let context = *self;
        let mut node = Some(from);
        core::iter::from_fn(move || {
            let hop = context.hop_from(node?)?;
            node = hop.sensor.map(|_| hop.to);
            Some(hop)
        })
    }

    /// The node of a sensor.
    pub fn node_of(&self, sensor: SensorId) -> Option<NodeId> {
        self.layout.sensor_node(sensor)
    }
}
