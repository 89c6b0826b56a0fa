//! The longest circuit with all turnouts straight, and places beside it.

use std::collections::BTreeSet;

use footplate_core::track::{Landmark, Layout, Leg, TurnoutStates};
use footplate_core::tracking::PathPoint;
use footplate_core::{EdgeId, Length, NodeId};

/// The least length of an edge that a train may rest on beside the circuit, and its place past the sensor.
const BESIDE_CIRCUIT: [Length; 2] = [Length::from_mm(500.0), Length::from_mm(300.0)];
/// The most sensors of a circuit (chosen).
const MAX_SENSORS: usize = 60;

/// A circuit.
pub struct LongestCircuit {
    /// Its sensors in the order of travel.
    pub nodes: Vec<NodeId>,
    /// Its edges in the order of travel.
    pub edges: Vec<EdgeId>,
    /// Places past sensors that are not on it.
    pub beside: Vec<(NodeId, Length)>,
}

impl LongestCircuit {
    /// The sum of the surveyed lengths of its first edges (mm).
    pub fn surveyed(&self, layout: &Layout, edges: usize) -> f64 {
        let edges = self.edges.iter().take(edges).filter_map(|edge| layout.edge(*edge));
        edges.map(|edge| edge.length.as_mm()).sum()
    }

    /// The place `far_mm` ahead of a train's position on it, and the distance (mm) to that place; a train that is past it
    /// already gets the place of the next sensor.
    pub fn ahead(
        &self,
        layout: &Layout,
        turnouts: &TurnoutStates,
        from: PathPoint,
        far_mm: f64,
    ) -> Option<(Landmark, f64)> {
        let (mut at, past) = self.past_sensor(layout, from)?;
        let mut distance = -past;
        loop {
            let node = *self.nodes.get(at)?;
            let length = layout.open_hops_from(node, turnouts).next()?.length.as_mm();
            if distance + length >= far_mm {
                let offset = (far_mm - distance).max(0.0);
                return Some((Landmark { node, offset: Length::from_mm(offset) }, distance + offset));
            }
            distance += length;
            at = (at + 1) % self.nodes.len();
        }
    }

    /// The sensor behind a position on it, and the distance (mm) from there: the position of a train at rest may be measured from a
    /// turnout.
    fn past_sensor(&self, layout: &Layout, from: PathPoint) -> Option<(usize, f64)> {
        let mut behind = None;
        for edge in &self.edges {
            let known = layout.edge(*edge)?;
            if let Some(at) = self.nodes.iter().position(|node| *node == known.from) {
                behind = Some((at, 0.0));
            }
            let (at, past) = behind?;
            if known.from == from.node {
                return Some((at, past + from.distance.as_mm()));
            }
            behind = Some((at, past + known.length.as_mm()));
        }
        None
    }

    /// Finds the circuit with the most sensors; empty if there is none.
    pub fn of(layout: &Layout) -> Self {
        let turnouts: TurnoutStates =
            layout.turnouts().map(|(turnout, _)| (turnout, Leg::Straight)).collect();
        let from = |start: NodeId| {
            let (mut nodes, mut edges, mut node) = (Vec::new(), Vec::new(), start);
            for _ in 0..MAX_SENSORS {
                let hop = layout.open_hops_from(node, &turnouts).next()?;
                hop.sensor?;
                nodes.push(node);
                edges.extend_from_slice(hop.edges);
                node = hop.to;
                if node == start {
                    return Some((nodes, edges));
                }
            }
            None
        };
        let rounds = layout.sensors().filter_map(|(_, node)| from(node));
        let (nodes, edges) = rounds.max_by_key(|(nodes, _)| nodes.len()).unwrap_or_default();
        let taken: BTreeSet<_> = edges.iter().map(|edge| edge.stretch()).collect();
        let beside = layout
            .sensors()
            .filter_map(|(_, node)| {
                let edge = *layout.open_hops_from(node, &turnouts).next()?.edges.first()?;
                let length = layout.edge(edge)?.length;
                (length >= BESIDE_CIRCUIT[0] && !taken.contains(&edge.stretch()))
                    .then_some((node, BESIDE_CIRCUIT[1]))
            })
            .collect();
        Self { nodes, edges, beside }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use footplate_store::layout_named;

    #[test]
    fn a_place_ahead_of_a_train_is_the_same_if_its_position_is_measured_from_a_turnout() {
        let layout = layout_named("track-a").expect("built in").layout;
        let turnouts: TurnoutStates =
            layout.turnouts().map(|(turnout, _)| (turnout, Leg::Straight)).collect();
        let circuit = LongestCircuit::of(&layout);
        let begins = |edge: &EdgeId| layout.edge(*edge).expect("an edge of the circuit").from;
        let is_turnout = |edge: &&EdgeId| !circuit.nodes.contains(&begins(edge));
        let turnout = circuit.edges.iter().position(|edge| is_turnout(&edge)).expect("a turnout");
        let sensor = turnout - 1;
        let before = layout.edge(circuit.edges[sensor]).expect("an edge of the circuit").length;
        let at = |edge: usize, distance| PathPoint { node: begins(&circuit.edges[edge]), distance };
        let ahead = |from| circuit.ahead(&layout, &turnouts, from, 2_000.0).expect("on the circuit");
        let (past_turnout, far) = ahead(at(turnout, Length::from_mm(40.0)));
        let (past_sensor, as_far) = ahead(at(sensor, before + Length::from_mm(40.0)));
        assert_eq!(past_turnout.node, past_sensor.node);
        assert!((past_turnout.offset - past_sensor.offset).abs() < Length::from_mm(0.01));
        assert!((far - 2_000.0).abs() < 0.01 && (as_far - 2_000.0).abs() < 0.01, "{far} {as_far}");
    }
}
