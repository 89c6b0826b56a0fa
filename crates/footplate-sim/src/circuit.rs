//! A way round a layout that leads back to where it began, and the turnouts it needs.

use std::collections::{BTreeMap, BTreeSet};

use footplate_core::track::{Layout, Leg, NodeKind, TurnoutStates, Ways};
use footplate_core::{EdgeId, Length, NodeId, SensorId, StretchId, TurnoutId};

use crate::draws::{Draws, Purpose};

/// Ways tried before a layout is said to have no circuit (chosen: far more than the few that the course layouts
/// need).
const TRIES: usize = 1000;
/// The best of so many circuits is taken (chosen: long ones, but not always the same).
const CANDIDATES: usize = 3;
/// Trains on both legs of a turnout touch each other up to this far from its toe (worked out: 24.3° at a radius of
/// 424.6 mm part the middles of the tracks by the 40 mm that two engines need).
pub(crate) const FOULING_MM: f64 = 180.0;
/// What the longest train needs, put down by hand (chosen: 165 mm and a hand's breadth).
const ROOM_MM: f64 = 260.0;
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
        "the path from {start} does not come back to it with the turnouts in their present positions: \
         it ends at {reached}; set the turnouts of a loop through {start}"
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

    /// Circuits for so many trains, such that each has a stretch to itself on which its train is in nobody's way while
    /// another runs round; those with many sensors first. Fewer, but at least one, if there are no more.
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
        // One of each, whichever way round and wherever it begins.
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

    /// Edges of one of several circuits on which its train is in nobody's way, and between which offsets in mm.
    pub(crate) fn sidings(layout: &Layout, circuits: &[&Self], nth: usize) -> Vec<(EdgeId, [f64; 2])> {
        let Some(own) = circuits.get(nth) else { return Vec::new() };
        let others = || {
            circuits.iter().enumerate().filter(|(other, _)| *other != nth).flat_map(|(_, other)| &other.edges)
        };
        let is_own = |edge: &&EdgeId| others().all(|theirs| theirs.stretch() != edge.stretch());
        let clear = |edge: &EdgeId| {
            let (there, back) = (layout.edge(*edge)?, layout.edge(edge.twin())?);
            let kept_off = |leg: Option<Leg>| if leg.is_some() { FOULING_MM } else { 0.0 };
            let range = [kept_off(there.leg), there.length.as_mm() - kept_off(back.leg)];
            (range[1] - range[0] > ROOM_MM).then_some((*edge, range))
        };
        own.edges.iter().filter(is_own).filter_map(clear).collect()
    }

    /// Random circuits with how many sensors each has, as long as ways are tried.
    fn any(layout: &Layout, starts: &[NodeId], draws: &mut Draws) -> impl Iterator<Item = (usize, Self)> {
        (0..TRIES).filter_map(move |_| {
            let start = *starts.get(draws.below(starts.len()))?;
            let circuit = walk(layout, start, |_| Leg::from_curved(draws.chance(0.5))).ok()?;
            Some((circuit.sensors(layout).len(), circuit)).filter(|(sensors, _)| *sensors >= 2)
        })
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
