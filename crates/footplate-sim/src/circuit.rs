//! A closed path on a layout, and the turnout positions it needs.

use std::collections::{BTreeMap, BTreeSet};

use footplate_core::track::{Layout, Leg, NodeKind, OutgoingEdges, TurnoutStates};
use footplate_core::{EdgeId, Length, NodeId, SensorId, StretchId, TurnoutId};

use crate::draws::{Draws, Purpose};

/// Random paths tried before a layout counts as one without a circuit (chosen: far more than the course layouts
/// need).
const MAX_TRIES: usize = 1000;
/// The best of this many circuits is used (chosen: long ones, but not always the same).
const CANDIDATES: usize = 3;
/// Trains on both legs of a turnout would touch up to this far from its toe (computed: at 24.3° and a radius of 424.6
/// mm, the track centres are then 40 mm apart, the width of two locomotives).
pub(crate) const FOULING_MM: f64 = 180.0;
/// Length that the longest train needs when placed by hand (chosen: 165 mm and a hand's breadth).
const MIN_SIDING_MM: f64 = 260.0;
/// A path of this many edges that has not returned is abandoned.
const MAX_EDGES: usize = 400;

/// A closed path.
#[derive(Debug, Clone, PartialEq)]
pub struct Circuit {
    edges: Vec<EdgeId>,
    turnouts: BTreeMap<TurnoutId, Leg>,
}

/// Why there is no circuit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CircuitError {
    /// No path of the layout returned to its start.
    #[error(
        "no circuit with two sensors found on layout `{layout}`; name a layout on which a train can run round"
    )]
    NoneFound {
        /// The layout.
        layout: String,
    },
    /// The given turnout positions lead elsewhere.
    #[error(
        "the path from {start} does not come back to it with the turnouts in their present positions: \
         it ends at {reached}; set the turnouts of a loop through {start}"
    )]
    DoesNotReturn {
        /// The node where the path starts.
        start: String,
        /// The node at which the path or the search ended.
        reached: String,
    },
}

impl Circuit {
    /// The path from a node back to it with the given turnout positions; an unknown turnout counts as straight.
    ///
    /// # Errors
    /// [`CircuitError::DoesNotReturn`] if it leads off the layout or into another loop.
    pub fn from_turnouts(
        layout: &Layout,
        start: NodeId,
        states: &TurnoutStates,
    ) -> Result<Self, CircuitError> {
        let choose = |turnout| states.get(turnout).unwrap_or(Leg::Straight);
        let walked = walk(layout, start, choose);
        walked.map_err(|reached| CircuitError::DoesNotReturn {
            start: layout.node_name(start).to_owned(),
            reached: layout.node_name(reached).to_owned(),
        })
    }

    /// A circuit with many sensors: the best of a few random ones, the same for the same seed.
    ///
    /// # Errors
    /// [`CircuitError::NoneFound`] if no path returned.
    pub fn draw(layout: &Layout, seed: u64) -> Result<Self, CircuitError> {
        let mut draws = Draws::new(seed, Purpose::Scenario);
        let starts: Vec<NodeId> = layout.sensors().map(|(_, node)| node).collect();
        let circuits = Self::drawn(layout, &starts, &mut draws);
        let best = circuits.take(CANDIDATES).max_by_key(|(sensors, _)| *sensors);
        best.map(|(_, circuit)| circuit).ok_or_else(|| none_found(layout))
    }

    /// Circuits for up to `count` trains, such that each has a stretch of its own on which its train blocks no other;
    /// those with many sensors first. Fewer if there are no more, but at least one.
    ///
    /// # Errors
    /// [`CircuitError::NoneFound`] if no path returned.
    pub(crate) fn draw_apart(
        layout: &Layout,
        count: usize,
        draws: &mut Draws,
    ) -> Result<Vec<Self>, CircuitError> {
        let starts: Vec<NodeId> = layout.sensors().map(|(_, node)| node).collect();
        let mut found: Vec<(usize, Self)> = Self::drawn(layout, &starts, draws).collect();
        found.sort_by_key(|(sensors, _)| std::cmp::Reverse(*sensors));
        // One circuit for each set of stretches, whatever its direction and start.
        let mut known: Vec<BTreeSet<StretchId>> = Vec::new();
        found.retain(|(_, circuit)| {
            let rails = circuit.edges.iter().map(|edge| edge.stretch()).collect();
            let is_new = !known.contains(&rails);
            known.extend(is_new.then_some(rails));
            is_new
        });
        let circuits: Vec<Self> = found.into_iter().map(|(_, circuit)| circuit).collect();
        let mut best: Vec<&Self> = circuits.first().into_iter().collect();
        for first in &circuits {
            let mut set: Vec<&Self> = Vec::new();
            for one in std::iter::once(first).chain(&circuits) {
                let mut larger = set.clone();
                larger.push(one);
                let sidings = (0..larger.len()).all(|nth| !Self::sidings(layout, &larger, nth).is_empty());
                if larger.len() <= count && sidings {
                    set = larger;
                }
            }
            if set.len() > best.len() {
                best = set;
            }
        }
        if best.is_empty() {
            return Err(none_found(layout));
        }
        Ok(best.into_iter().cloned().collect())
    }

    /// Edges of one of several circuits on which its train blocks no other, each with the range of clear offsets in
    /// mm.
    pub(crate) fn sidings(layout: &Layout, circuits: &[&Self], nth: usize) -> Vec<(EdgeId, [f64; 2])> {
        let Some(own) = circuits.get(nth) else { return Vec::new() };
        let others = || {
            circuits.iter().enumerate().filter(|(other, _)| *other != nth).flat_map(|(_, other)| &other.edges)
        };
        let is_own = |edge: &&EdgeId| others().all(|theirs| theirs.stretch() != edge.stretch());
        let clear = |edge: &EdgeId| {
            let (there, back) = (layout.edge(*edge)?, layout.edge(edge.twin())?);
            let clearance = |leg: Option<Leg>| if leg.is_some() { FOULING_MM } else { 0.0 };
            let range = [clearance(there.leg), there.length.as_mm() - clearance(back.leg)];
            (range[1] - range[0] > MIN_SIDING_MM).then_some((*edge, range))
        };
        own.edges.iter().filter(is_own).filter_map(clear).collect()
    }

    /// Random circuits, each with its number of sensors.
    fn drawn(layout: &Layout, starts: &[NodeId], draws: &mut Draws) -> impl Iterator<Item = (usize, Self)> {
        (0..MAX_TRIES).filter_map(move |_| {
            let start = *starts.get(draws.below(starts.len()))?;
            let circuit = walk(layout, start, |_| Leg::from_curved(draws.chance(0.5))).ok()?;
            Some((circuit.sensors(layout).len(), circuit)).filter(|(sensors, _)| *sensors >= 2)
        })
    }

    /// Its edges, in the order of travel; the last ends where the first begins.
    pub fn edges(&self) -> &[EdgeId] {
        &self.edges
    }

    /// Its turnouts and their positions.
    pub fn turnouts(&self) -> impl ExactSizeIterator<Item = (TurnoutId, Leg)> {
        self.turnouts.iter().map(|(turnout, leg)| (*turnout, *leg))
    }

    /// The sensors on it, in the order of travel.
    pub fn sensors(&self, layout: &Layout) -> Vec<SensorId> {
        self.edges.iter().filter_map(|edge| layout.sensor_at(layout.edge(*edge)?.from)).collect()
    }

    /// The length of its edges by the layout's survey.
    pub fn length(&self, layout: &Layout) -> Length {
        self.edges.iter().filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length).sum()
    }
}

fn none_found(layout: &Layout) -> CircuitError {
    CircuitError::NoneFound { layout: layout.name().to_owned() }
}

/// Follows a path until it returns to its start; `choose` sets each facing turnout once. Fails with the last node.
fn walk(layout: &Layout, start: NodeId, mut choose: impl FnMut(TurnoutId) -> Leg) -> Result<Circuit, NodeId> {
    let mut turnouts: BTreeMap<TurnoutId, Leg> = BTreeMap::new();
    let mut edges: Vec<EdgeId> = Vec::new();
    let mut node = start;
    for _ in 0..MAX_EDGES {
        let id = match (layout.outgoing(node), layout.node(node).map(|node| node.kind)) {
            (OutgoingEdges::Ahead(edge), _) => edge,
            (OutgoingEdges::Legs { straight, curved }, Some(NodeKind::Branch(turnout))) => {
                let leg = *turnouts.entry(turnout).or_insert_with(|| choose(turnout));
                if leg.is_curved() { curved } else { straight }
            }
            _ => return Err(node),
        };
        let Some(edge) = layout.edge(id) else { return Err(node) };
        // A trailing turnout must be set for the leg on which the path arrives, which is where the edge's twin
        // starts.
        if let Some(NodeKind::Merge(turnout)) = layout.node(edge.to).map(|node| node.kind) {
            let leg = layout.edge(id.twin()).and_then(|twin| twin.leg).ok_or(node)?;
            if *turnouts.entry(turnout).or_insert(leg) != leg {
                return Err(edge.to);
            }
        }
        edges.push(id);
        node = edge.to;
        if node == start {
            let curved = |turnout: &TurnoutId| turnouts.get(turnout).is_some_and(|leg| leg.is_curved());
            let clash = layout.never_both_curved().iter().any(|pair| pair.iter().all(curved));
            return if clash { Err(node) } else { Ok(Circuit { edges, turnouts }) };
        }
    }
    Err(node)
}
