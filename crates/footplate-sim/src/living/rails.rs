//! The true rails of a whole layout, edge by edge, ready to be run over.

use footplate_core::track::{Layout, Leg, NodeKind, OutgoingEdges};
use footplate_core::{EdgeId, NodeId, SensorId, TurnoutId};

use crate::physics_range::PhysicsRange;
use crate::track::TrueTrack;

/// One direction of travel over a stretch of rail.
#[derive(Debug, Clone)]
pub(crate) struct Rail {
    pub(crate) length_mm: f64,
    /// Speed on it over speed on a level straight one.
    pub(crate) factor: f64,
    /// Gradient, upwards positive.
    pub(crate) grade: f64,
    /// Sensors for this direction, in order, by how far along the edge they close.
    pub(crate) sensors: Vec<(f64, SensorId)>,
    /// Where dirty spots begin.
    pub(crate) dirty: Vec<f64>,
    /// What comes after it.
    pub(crate) ahead: Ahead,
    /// The turnout from whose toe it leads away, and by which leg.
    pub(crate) leaves: Option<(TurnoutId, Leg)>,
    /// The turnout into whose leg it leads.
    pub(crate) enters: Option<(TurnoutId, Leg)>,
    /// The detector of the block that it is in, ...
    pub(crate) block: Option<SensorId>,
    /// ... and of the block that ends where it begins.
    pub(crate) ends_block: Option<SensorId>,
}

/// What comes after an edge.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Ahead {
    Edge(EdgeId),
    Points { turnout: TurnoutId, straight: EdgeId, curved: EdgeId },
    End,
}

/// All edges of a layout as they really are.
#[derive(Debug, Clone)]
pub(crate) struct Rails<'l> {
    pub(crate) layout: &'l Layout,
    pub(crate) track: TrueTrack,
    rails: Vec<Rail>,
    /// By the sensor's number: how much it scatters from pass to pass (standard deviation in mm).
    scatter_mm: Vec<f64>,
}

impl<'l> Rails<'l> {
    pub(crate) fn new(layout: &'l Layout, mut track: TrueTrack, range: PhysicsRange, seed: u64) -> Self {
        let mut draws = PhysicsRange::draws(seed).split();
        let mut scatter_mm = Vec::new();
        for (sensor, _) in layout.sensors() {
            let (further_mm, scatter) = range.sensor_offset_and_scatter(&mut draws);
            // Where the rails are cut is the same place in both directions.
            let is_entry = layout.block_of_entry(sensor).is_some();
            let further_mm = if is_entry { -track.sensor_offset(sensor).as_mm() } else { further_mm };
            track.move_sensor(sensor, further_mm);
            let slot = usize::from(sensor.0);
            scatter_mm.resize(scatter_mm.len().max(slot + 1), 0.0);
            scatter_mm[slot] = scatter;
        }
        let mut rails: Vec<Rail> = layout
            .edges()
            .map(|(id, edge)| Rail {
                length_mm: track.length(id).as_mm(),
                factor: track.speed_factor(id).as_parts(),
                grade: 0.0,
                sensors: Vec::new(),
                dirty: track.dirty_mm(id),
                ahead: ahead(layout, edge.to),
                leaves: edge.leg.and_then(|leg| Some((turnout_at(layout, edge.from)?, leg))),
                enters: layout
                    .edge(id.twin())
                    .and_then(|twin| Some((turnout_at(layout, twin.from)?, twin.leg?))),
                block: layout.block_of_edge(id).map(|block| block.detector),
                ends_block: layout.block_left_at(edge.from).map(|block| block.detector),
            })
            .collect();
        for (sensor, node) in layout.sensors() {
            let offset_mm = track.sensor_offset(sensor).as_mm();
            let after = if offset_mm >= 0.0 { layout.outgoing(node).edges().next() } else { None };
            if let Some(rail) = after.and_then(|edge| rails.get_mut(usize::from(edge.0))) {
                rail.sensors.push((offset_mm.min(rail.length_mm), sensor));
                continue;
            }
            // Before its node, or where the track ends: on the rails that lead to it.
            for (id, edge) in layout.edges().filter(|(_, edge)| edge.to == node) {
                if let (Some(rail), true) = (rails.get_mut(usize::from(id.0)), edge.to == node) {
                    rail.sensors.push(((rail.length_mm + offset_mm).clamp(0.0, rail.length_mm), sensor));
                }
            }
        }
        for pair in rails.chunks_mut(2) {
            let grade = range.grade(&mut draws);
            for (rail, sign) in pair.iter_mut().zip([1.0, -1.0]) {
                rail.grade = sign * grade;
            }
        }
        for rail in &mut rails {
            rail.sensors.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        }
        Self { layout, track, rails, scatter_mm }
    }

    /// How much a sensor scatters from pass to pass (standard deviation in mm).
    pub(crate) fn scatter_mm(&self, sensor: SensorId) -> f64 {
        self.scatter_mm.get(usize::from(sensor.0)).copied().unwrap_or(0.0)
    }

    /// Whether an edge begins at the boundary of a block.
    pub(crate) fn is_boundary(&self, edge: EdgeId) -> bool {
        self.layout.edge(edge).is_some_and(|edge| self.layout.is_boundary(edge.from))
    }

    pub(crate) fn rail(&self, edge: EdgeId) -> Option<&Rail> {
        self.rails.get(usize::from(edge.0))
    }
}

fn ahead(layout: &Layout, node: NodeId) -> Ahead {
    match (layout.outgoing(node), turnout_at(layout, node)) {
        (OutgoingEdges::Ahead(edge), _) => Ahead::Edge(edge),
        (OutgoingEdges::Legs { straight, curved }, Some(turnout)) => {
            Ahead::Points { turnout, straight, curved }
        }
        _ => Ahead::End,
    }
}

/// The turnout that is met at its toe at a node.
fn turnout_at(layout: &Layout, node: NodeId) -> Option<TurnoutId> {
    match layout.node(node)?.kind {
        NodeKind::Branch(turnout) => Some(turnout),
        _ => None,
    }
}
