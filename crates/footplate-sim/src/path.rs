//! The objects along the rails ahead of a train, by true distance from the start of its run.

use footplate_core::track::Layout;
use footplate_core::{EdgeId, Length, SensorId};

use crate::gates::GATE_SPACING_MM;
use crate::railway::Railway;

/// An object at a point of the rails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point<T> {
    /// Where, in mm from the start of the run; negative behind it.
    pub(crate) at_mm: f64,
    /// The object.
    pub(crate) what: T,
}

/// Where a path starts: past a sensor of the circuit, counted in the order of travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Origin {
    /// The index of the sensor.
    pub(crate) sensor: usize,
    /// How far past its node.
    pub(crate) past_mm: f64,
}

/// The path ahead, lap after lap of a circuit, long enough for one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Path {
    /// Edges by their starts.
    pub(crate) edges: Vec<Point<EdgeId>>,
    /// The speed factor of each edge.
    factors: Vec<f64>,
    /// Sensors by where they close, in order.
    pub(crate) sensors: Vec<Point<SensorId>>,
    /// Nodes of sensors by position, in order: where the tape is laid from.
    pub(crate) landmarks: Vec<Point<SensorId>>,
    /// Dirty spots.
    pub(crate) dirty: Vec<Point<()>>,
    /// Light gates by number.
    pub(crate) gates: Vec<Point<u8>>,
}

impl Path {
    /// The path from an origin, at least as long as `reach_mm`, with light gates (if any) in the middle of the
    /// circuit's longest edge.
    pub(crate) fn new(railway: &Railway<'_>, origin: Origin, reach_mm: f64, has_gates: bool) -> Self {
        let Railway { layout, track, circuit } = railway;
        let edges = circuit.edges();
        let starts: Vec<usize> =
            (0..edges.len()).filter(|at| sensor_before(layout, edges, *at).is_some()).collect();
        let first = if starts.is_empty() { 0 } else { starts[origin.sensor % starts.len()] };
        let length_mm = |edge: EdgeId| track.length(edge).as_mm();
        let gated = edges
            .iter()
            .copied()
            .max_by(|a, b| length_mm(*a).total_cmp(&length_mm(*b)))
            .filter(|_| has_gates);
        let mut path = Self::default();
        let mut begins_mm = -origin.past_mm;
        for place in first.. {
            if begins_mm > reach_mm || edges.is_empty() {
                break;
            }
            let place = place % edges.len();
            let edge = edges[place];
            if let Some(sensor) = sensor_before(layout, edges, place) {
                path.landmarks.push(Point { at_mm: begins_mm, what: sensor });
                path.sensors
                    .push(Point { at_mm: begins_mm + track.sensor_offset(sensor).as_mm(), what: sensor });
            }
            path.edges.push(Point { at_mm: begins_mm, what: edge });
            path.factors.push(track.speed_factor(edge).as_parts());
            path.dirty.extend(
                track.dirty_mm(edge).into_iter().map(|spot| Point { at_mm: begins_mm + spot, what: () }),
            );
            if gated == Some(edge) {
                let middle_mm = begins_mm + 0.5 * length_mm(edge);
                path.gates.push(Point { at_mm: middle_mm, what: 1 });
                path.gates.push(Point { at_mm: middle_mm + GATE_SPACING_MM, what: 0 });
            }
            begins_mm += length_mm(edge);
        }
        // Sensors a few millimetres apart may close in another order than their nodes.
        path.sensors.sort_by(|a, b| a.at_mm.total_cmp(&b.at_mm));
        path
    }

    /// The speed factor of the rails after `begun` edges.
    pub(crate) fn factor(&self, begun: usize) -> f64 {
        begun.checked_sub(1).and_then(|last| self.factors.get(last)).copied().unwrap_or(1.0)
    }

    /// The edge at a distance, and the offset on it.
    pub(crate) fn place(&self, at_mm: f64) -> Option<(EdgeId, Length)> {
        let after = self.edges.partition_point(|point| point.at_mm <= at_mm);
        let point = self.edges.get(after.checked_sub(1)?)?;
        Some((point.what, Length::from_mm(at_mm - point.at_mm)))
    }
}

/// The sensor at the start node of an edge of a circuit.
fn sensor_before(layout: &Layout, edges: &[EdgeId], at: usize) -> Option<SensorId> {
    layout.sensor_at(layout.edge(*edges.get(at)?)?.from)
}
