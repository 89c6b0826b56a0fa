//! A way round a layout that leads back to where it began, and the turnouts it needs.

use std::collections::BTreeMap;

use footplate_core::track::{Layout, Leg, NodeKind, TurnoutStates, Ways};
use footplate_core::{EdgeId, Length, NodeId, SensorId, TurnoutId};

use crate::draws::{Draws, Purpose};

/// Ways tried before a layout is said to have no circuit (chosen: far more than the few that the course layouts
/// need).
const TRIES: usize = 1000;
/// The best of so many circuits is taken (chosen: long ones, but not always the same).
const CANDIDATES: usize = 3;
/// A way this many edges long that has not come back is given up.
const LONGEST_WAY: usize = 400;

/// A closed way.
#[derive(Debug, Clone, PartialEq)]
pub struct Circuit {
    edges: Vec<EdgeId>,
    turnouts: BTreeMap<TurnoutId, Leg>,
}

/// Why there is no circuit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CircuitError {
    /// No way out and back was found on the layout.
    #[error(
        "no circuit with two sensors found on layout `{layout}`; name a layout on which a train can run round"
    )]
    NoneFound {
        /// The layout.
        layout: String,
    },
    /// The turnouts given lead elsewhere.
    #[error(
        "the way from {start} does not come back to it as the turnouts lie: it ends at {reached}; set the \
         turnouts of a loop through {start}"
    )]
    DoesNotReturn {
        /// The node it began at.
        start: String,
        /// The node beyond which there is no way, or at which the search was given up.
        reached: String,
    },
}

impl Circuit {
    /// The way that leads from a node back to it as the turnouts lie; an unknown turnout counts as straight.
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
    /// [`CircuitError::NoneFound`] if no way came back.
    pub fn draw(layout: &Layout, seed: u64) -> Result<Self, CircuitError> {
        let mut draws = Draws::new(seed, Purpose::Scenario);
        let starts: Vec<NodeId> = layout.sensors().map(|(_, node)| node).collect();
        let ways = Self::any(layout, &starts, &mut draws);
        let best = ways.take(CANDIDATES).max_by_key(|(sensors, _)| *sensors);
        best.map(|(_, circuit)| circuit).ok_or_else(|| none_found(layout))
    }

    /// Circuits that share no rails, one for each of so many trains or as many as were found, those with many
    /// sensors first.
    ///
    /// # Errors
    /// [`CircuitError::NoneFound`] if no way came back.
    pub(crate) fn draw_apart(
        layout: &Layout,
        count: usize,
        draws: &mut Draws,
    ) -> Result<Vec<Self>, CircuitError> {
        let starts: Vec<NodeId> = layout.sensors().map(|(_, node)| node).collect();
        let mut found: Vec<(usize, Self)> = Self::any(layout, &starts, draws).collect();
        found.sort_by_key(|(sensors, _)| std::cmp::Reverse(*sensors));
        let mut best: Vec<&(usize, Self)> = Vec::new();
        // The more circuits the better, and then the more sensors on the poorest of them.
        let worth = |set: &[&(usize, Self)]| (set.len(), set.last().map(|(sensors, _)| *sensors));
        for first in &found {
            let mut set: Vec<&(usize, Self)> = Vec::new();
            for one in std::iter::once(first).chain(&found) {
                if set.len() < count && set.iter().all(|(_, other)| !one.1.shares_rails(other)) {
                    set.push(one);
                }
            }
            if worth(&set) > worth(&best) {
                best = set;
            }
        }
        if best.is_empty() {
            return Err(none_found(layout));
        }
        Ok(best.into_iter().map(|(_, circuit)| circuit.clone()).collect())
    }

    /// Random circuits with how many sensors each has, as long as ways are tried.
    fn any(layout: &Layout, starts: &[NodeId], draws: &mut Draws) -> impl Iterator<Item = (usize, Self)> {
        (0..TRIES).filter_map(move |_| {
            let start = *starts.get(draws.below(starts.len()))?;
            let circuit = walk(layout, start, |_| Leg::from_curved(draws.chance(0.5))).ok()?;
            Some((circuit.sensors(layout).len(), circuit)).filter(|(sensors, _)| *sensors >= 2)
        })
    }

    fn shares_rails(&self, other: &Self) -> bool {
        self.edges.iter().any(|edge| other.edges.iter().any(|theirs| theirs.stretch() == edge.stretch()))
    }

    /// Its edges, in the order of travel; the last ends where the first begins.
    #[must_use]
    pub fn edges(&self) -> &[EdgeId] {
        &self.edges
    }

    /// The turnouts on it and how they have to lie.
    pub fn turnouts(&self) -> impl ExactSizeIterator<Item = (TurnoutId, Leg)> {
        self.turnouts.iter().map(|(turnout, leg)| (*turnout, *leg))
    }

    /// The sensors on it, in the order of travel.
    #[must_use]
    pub fn sensors(&self, layout: &Layout) -> Vec<SensorId> {
        self.edges.iter().filter_map(|edge| layout.sensor_at(layout.edge(*edge)?.from)).collect()
    }

    /// The sum of its edges as the layout has them.
    #[must_use]
    pub fn length(&self, layout: &Layout) -> Length {
        self.edges.iter().filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length).sum()
    }
}

fn none_found(layout: &Layout) -> CircuitError {
    CircuitError::NoneFound { layout: layout.name().to_owned() }
}

/// Walks until the way returns to its start; `choose` decides each turnout once. Fails with the last node.
fn walk(layout: &Layout, start: NodeId, mut choose: impl FnMut(TurnoutId) -> Leg) -> Result<Circuit, NodeId> {
    let mut turnouts: BTreeMap<TurnoutId, Leg> = BTreeMap::new();
    let mut edges: Vec<EdgeId> = Vec::new();
    let mut node = start;
    for _ in 0..LONGEST_WAY {
        let id = match (layout.ways(node), layout.node(node).map(|node| node.kind)) {
            (Ways::Ahead(edge), _) => edge,
            (Ways::Legs { straight, curved }, Some(NodeKind::Branch(turnout))) => {
                let leg = *turnouts.entry(turnout).or_insert_with(|| choose(turnout));
                if leg.is_curved() { curved } else { straight }
            }
            _ => return Err(node),
        };
        let Some(edge) = layout.edge(id) else { return Err(node) };
        // Through a turnout from a leg: it has to lie for that leg, which is where the edge's twin leaves.
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
