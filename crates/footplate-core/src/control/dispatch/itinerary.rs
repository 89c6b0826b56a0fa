//! Itineraries: the quickest paths to a place, with the reversals that they need (Dijkstra, 1959).

use alloc::collections::BinaryHeap;
use alloc::vec;
use alloc::vec::Vec;
use core::cmp::Ordering;

use crate::ids::{EdgeId, NodeId};
use crate::track::{Layout, NodeKind, Position, TurnoutNeed, TurnoutStates};
use crate::units::{Length, Speed};

use super::path::edge_from;
use super::reservation::{CLEARANCE, Obstacles};

/// The shortest run. Shorter moves are imprecise and pass no sensor: the train goes round, or arrives from the other
/// side.
pub(super) const SHORTEST_RUN: Length = Length::from_mm(200.0);
/// The number of edges searched beyond a turnout for a place to reverse: at most three turnouts come before a sensor.
const MAX_TRIED: usize = 16;

/// The speed and durations for running times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pace {
    /// The cruising speed.
    pub(super) cruise: Speed,
    /// What a start and a stop add to the time at cruising speed, in seconds.
    pub(super) start_s: f64,
    pub(super) stop_s: f64,
    /// Reversing at rest, in seconds.
    pub(super) reversal_s: f64,
}

/// A train that runs to a sensor only to be detected stops this far beyond it.
const PAST_SENSOR: Length = Length::from_mm(60.0);

/// A run in one direction: its edges, from the one it begins on to the one it ends on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Run {
    /// Whether the train reverses before it.
    pub(super) reverses: bool,
    pub(super) edges: Vec<EdgeId>,
    pub(super) start: Position,
    pub(super) stop: Position,
}

/// Consecutive runs, and their running time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Itinerary {
    pub(super) runs: Vec<Run>,
    pub(super) seconds: f64,
}

/// The parameters of a search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search<'a> {
    pub(super) layout: &'a Layout,
    pub(super) pace: Pace,
    /// How far a train runs beyond a turnout that is thrown behind it.
    pub(super) clears: Length,
    /// The distance beyond its stop in which a train may come to rest, over the turnouts as set.
    pub(super) beyond: Length,
    pub(super) turnouts: &'a TurnoutStates,
    pub(super) obstacles: &'a Obstacles,
    /// Turnouts that cannot be thrown for the first run, as the train is on them or too near.
    pub(super) frozen: &'a [TurnoutNeed],
    /// Whether the first run may trail a turnout that is frozen for the other leg.
    pub(super) may_trail_frozen: bool,
}

/// How a node is reached.
#[derive(Debug, Clone, Copy, PartialEq)]
enum By {
    /// From the start, over the edge that it is on; reversed or not.
    Start {
        reversed: bool,
    },
    Edge(NodeId, EdgeId),
    /// Back over a turnout after running beyond it.
    Shunt(usize),
}

/// A run beyond a node, after which the train reverses.
#[derive(Debug, Clone)]
struct Shunt {
    /// The turnout, trailed, or the node behind which the train backs away.
    merge: NodeId,
    out: Vec<EdgeId>,
    stop: Position,
}

/// All nodes that can be reached from a start, with the paths to them.
#[derive(Debug, Clone)]
pub(super) struct Reached<'a> {
    search: Search<'a>,
    starts: [Option<Position>; 2],
    nodes: Vec<Option<(f64, By)>>,
    shunts: Vec<Shunt>,
}

#[derive(Debug, Clone, Copy)]
struct Open {
    seconds: f64,
    node: NodeId,
    by: By,
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    /// The heap returns its greatest first: the quickest, and of equally quick ones the lowest node.
    fn cmp(&self, other: &Self) -> Ordering {
        other.seconds.total_cmp(&self.seconds).then_with(|| other.node.cmp(&self.node))
    }
}

impl<'a> Search<'a> {
    /// All nodes that a train at rest can reach, ahead and once reversed. A train that does not run ahead may back
    /// away on plain track from turnouts that cannot be thrown, and come back.
    pub(super) fn from(self, ahead: Option<Position>, reversed: Option<Position>) -> Reached<'a> {
        let nodes = vec![None; self.layout.nodes().len()];
        let mut reached = Reached { search: self, starts: [ahead, reversed], nodes, shunts: Vec::new() };
        let mut open = BinaryHeap::new();
        for (start, is_reversed) in [(ahead, false), (reversed, true)] {
            let Some((start, edge)) = start.and_then(|start| Some((start, self.layout.edge(start.edge)?)))
            else {
                continue;
            };
            let first = self.pace.start_s + if is_reversed { self.pace.reversal_s } else { 0.0 };
            // It leaves a turnout whose leg it is on; if that is frozen, the train has reserved it itself.
            let leaves =
                self.layout.needs_of(start.edge).any(|need| need.facing && self.frozen.contains(&need));
            let from = if leaves { start.offset.max(CLEARANCE).min(edge.length) } else { start.offset };
            if let Some(cost) = self.seconds(start.edge, from, edge.length) {
                open.push(Open {
                    seconds: first + cost,
                    node: edge.to,
                    by: By::Start { reversed: is_reversed },
                });
            }
        }
        while let Some(next) = open.pop() {
            match reached.nodes.get_mut(usize::from(next.node.0)) {
                Some(slot @ None) => *slot = Some((next.seconds, next.by)),
                _ => continue,
            }
            // The needs of the run so far matter only if it needs more.
            let asks = |edge| self.layout.needs_of(edge).next().is_some();
            let is_merge = self.is_merge(next.node);
            let needs = if is_merge || ahead.is_none() || self.layout.outgoing(next.node).edges().any(asks) {
                reached.needs_until(next.node)
            } else {
                Vec::new()
            };
            for id in self.layout.outgoing(next.node).edges() {
                let Some(edge) = self.layout.edge(id).filter(|_| self.agrees(&needs, id)) else { continue };
                if let Some(cost) = self.seconds(id, Length::ZERO, edge.length) {
                    let by = By::Edge(next.node, id);
                    open.push(Open { seconds: next.seconds + cost, node: edge.to, by });
                }
            }
            let backs_away = ahead.is_none()
                && next.by == (By::Start { reversed: true })
                && reversed.is_some_and(|reversed| self.is_plain(reversed.edge));
            if is_merge || backs_away {
                self.shunt(&mut reached, next, &needs, &mut open);
            }
        }
        reached
    }

    /// Whether an edge is not a leg of a turnout.
    fn is_plain(&self, edge: EdgeId) -> bool {
        self.layout.needs_of(edge).next().is_none()
    }

    /// Whether a turnout is trailed at a node.
    fn is_merge(&self, node: NodeId) -> bool {
        self.layout.node(node).is_some_and(|node| matches!(node.kind, NodeKind::Merge(_)))
    }

    fn is_sensor(&self, node: NodeId) -> bool {
        self.layout.node(node).is_some_and(|node| matches!(node.kind, NodeKind::Sensor(_)))
    }

    /// Adds the runs beyond a node, such as a trailed turnout, from which the train can come back.
    fn shunt(&self, reached: &mut Reached<'_>, at: Open, needs: &[TurnoutNeed], open: &mut BinaryHeap<Open>) {
        let mut paths: Vec<(Vec<EdgeId>, NodeId, Length, f64)> =
            vec![(Vec::new(), at.node, self.clears, 0.0)];
        let is_merge = self.is_merge(at.node);
        let is_certain = self.is_sensor(at.node) || is_merge;
        // A turnout is thrown behind the train only after a sensor beyond it has reported the train: a train that
        // stalls between the last sensor and the turnout comes to rest on it unnoticed. To back away, any sensor on
        // the run is enough: it shows that the train has started.
        let is_detected = |path: &[EdgeId]| {
            path.iter().filter_map(|id| self.layout.edge(*id)).any(|edge| self.is_sensor(edge.to))
        };
        let is_detected_before =
            !is_merge && reached.run_to(at.node).is_some_and(|(edges, _)| is_detected(&edges));
        let mut tried = 0;
        while let Some((path, node, left, cost)) = paths.pop() {
            tried += 1;
            if tried > MAX_TRIED {
                break;
            }
            let seen = is_detected_before || is_detected(&path);
            for id in self.layout.outgoing(node).edges() {
                let Some(edge) = self.layout.edge(id).filter(|_| self.agrees(needs, id)) else { continue };
                // Backing away, it runs over turnouts only beyond a sensor, which measures its position.
                if !is_certain && !seen && !self.is_plain(id) {
                    continue;
                }
                let goes_on = edge.length < left || !seen;
                let run = if goes_on { edge.length } else { left };
                let Some(more) = self.seconds(id, Length::ZERO, run) else { continue };
                let mut longer = path.clone();
                longer.push(id);
                if goes_on {
                    paths.push((longer, edge.to, (left - edge.length).max(PAST_SENSOR), cost + more));
                    continue;
                }
                let stop = Position { edge: id, offset: left };
                if !self.has_room_beyond(stop) {
                    continue;
                }
                let Pace { start_s, stop_s, reversal_s, .. } = self.pace;
                let seconds = at.seconds + 2.0 * (cost + more) + stop_s + reversal_s + start_s;
                open.push(Open { seconds, node: at.node.reverse(), by: By::Shunt(reached.shunts.len()) });
                reached.shunts.push(Shunt { merge: at.node, out: longer, stop });
            }
        }
    }

    /// Whether the track beyond a stop, where a train may come to rest, is open.
    fn has_room_beyond(&self, stop: Position) -> bool {
        let (mut id, mut from, mut left) = (stop.edge, stop.offset, self.beyond);
        for _ in 0..self.layout.edges().len() {
            let Some(edge) = self.layout.edge(id) else { return false };
            if self.seconds(id, from, edge.length.min(from + left)).is_none() {
                return false;
            }
            left -= edge.length - from;
            if left <= Length::ZERO {
                return true;
            }
            let Some(next) = edge_from(self.layout, self.turnouts, edge.to) else { return false };
            (id, from) = (next, Length::ZERO);
        }
        false
    }

    /// The time for part of an edge, with the wait for other trains; `None` if it is closed.
    fn seconds(&self, edge: EdgeId, from: Length, to: Length) -> Option<f64> {
        let report_waiting = self.obstacles.cost(self.layout, edge, from, to)?;
        let limit = self.layout.zone(edge).map_or(self.pace.cruise, |zone| zone.limit);
        Some(((to - from).max(Length::ZERO) / self.pace.cruise.min(limit)).as_s() + report_waiting)
    }

    /// Whether a run with these needs can continue over an edge: no turnout in both positions at once.
    fn agrees(&self, needs: &[TurnoutNeed], id: EdgeId) -> bool {
        self.layout.needs_of(id).all(|need| {
            let partner = self.layout.never_curved_with(need.turnout).filter(|_| need.leg.is_curved());
            needs.iter().all(|known| {
                // A train trails a turnout that cannot be thrown, in either position.
                let is_trailed_in_place =
                    self.may_trail_frozen && !need.facing && self.frozen.contains(known);
                (known.turnout != need.turnout || known.leg == need.leg || is_trailed_in_place)
                    && !(Some(known.turnout) == partner && known.leg.is_curved())
            })
        })
    }
}

impl Reached<'_> {
    /// The edges of the run to a node, in the order of travel, and its beginning.
    fn run_to(&self, node: NodeId) -> Option<(Vec<EdgeId>, By)> {
        let mut edges = Vec::new();
        let mut node = node;
        loop {
            let (_, by) = *self.nodes.get(usize::from(node.0))?.as_ref()?;
            match by {
                By::Edge(before, edge) => {
                    edges.push(edge);
                    node = before;
                }
                By::Start { reversed } => {
                    edges.push(self.starts.get(usize::from(reversed))?.as_ref()?.edge);
                    edges.reverse();
                    return Some((edges, by));
                }
                By::Shunt(number) => {
                    edges.extend(self.shunts.get(number)?.out.iter().map(|edge| edge.twin()));
                    edges.reverse();
                    return Some((edges, by));
                }
            }
        }
    }

    fn needs_until(&self, node: NodeId) -> Vec<TurnoutNeed> {
        let Some((edges, by)) = self.run_to(node) else { return Vec::new() };
        let frozen = if matches!(by, By::Start { .. }) { self.search.frozen } else { &[] };
        let needs = edges.into_iter().flat_map(|edge| self.search.layout.needs_of(edge));
        // The turnouts under the train come first: they keep their positions.
        frozen.iter().copied().chain(needs).collect()
    }

    /// A lower bound of the time to rest at a place, without its runs.
    pub(super) fn seconds_to(&self, target: Position) -> Option<f64> {
        let edge = self.search.layout.edge(target.edge)?;
        let (until, _) = (*self.nodes.get(usize::from(edge.from.0))?)?;
        Some(until + self.search.seconds(target.edge, Length::ZERO, target.offset)? + self.search.pace.stop_s)
    }

    /// The quickest itinerary to each of several places, the quickest of them first.
    pub(super) fn to(&self, targets: &[Position]) -> Vec<Itinerary> {
        let mut found: Vec<Itinerary> = targets.iter().filter_map(|target| self.itinerary(*target)).collect();
        found.sort_by(|one, other| one.seconds.total_cmp(&other.seconds));
        found
    }

    fn itinerary(&self, target: Position) -> Option<Itinerary> {
        let layout = self.search.layout;
        let edge = layout.edge(target.edge)?;
        if !self.search.has_room_beyond(target) {
            return None;
        }
        // The target may be ahead on the edge that the train is on.
        let direct = [false, true].into_iter().filter_map(|reversed| {
            let start = (*self.starts.get(usize::from(reversed))?)?;
            let is_ahead = start.edge == target.edge && target.offset - start.offset >= SHORTEST_RUN;
            let cost = is_ahead.then(|| self.search.seconds(target.edge, start.offset, target.offset))??;
            let Pace { start_s, stop_s, reversal_s, .. } = self.search.pace;
            let seconds = cost + start_s + stop_s + if reversed { reversal_s } else { 0.0 };
            let run = Run { reverses: reversed, edges: vec![target.edge], start, stop: target };
            Some(Itinerary { runs: vec![run], seconds })
        });
        let direct = direct.min_by(|one, other| one.seconds.total_cmp(&other.seconds));
        let over = || {
            let (until, _) = (*self.nodes.get(usize::from(edge.from.0))?)?;
            let needs = self.needs_until(edge.from);
            let cost = self
                .search
                .agrees(&needs, target.edge)
                .then(|| self.search.seconds(target.edge, Length::ZERO, target.offset))??;
            let seconds = until + cost + self.search.pace.stop_s;
            let runs = self.runs(edge.from, target)?;
            let is_long_enough = runs.last().is_some_and(|run| length(layout, run) >= SHORTEST_RUN);
            is_long_enough.then_some(Itinerary { runs, seconds })
        };
        match (direct, over()) {
            (Some(direct), Some(over)) => Some(if direct.seconds <= over.seconds { direct } else { over }),
            (direct, over) => direct.or(over),
        }
    }

    /// The runs to a node, the last of which continues to a target on an edge from there.
    fn runs(&self, node: NodeId, target: Position) -> Option<Vec<Run>> {
        let (mut edges, mut by) = self.run_to(node)?;
        edges.push(target.edge);
        let mut runs = Vec::new();
        let mut stop = target;
        loop {
            match by {
                By::Shunt(number) => {
                    let shunt = self.shunts.get(number)?;
                    let start = self.search.layout.reversed(shunt.stop)?;
                    runs.push(Run { reverses: true, edges, start, stop });
                    stop = shunt.stop;
                    let (mut before, began) = self.run_to(shunt.merge)?;
                    before.extend(&shunt.out);
                    (edges, by) = (before, began);
                }
                By::Start { reversed } => {
                    let start = (*self.starts.get(usize::from(reversed))?)?;
                    runs.push(Run { reverses: reversed, edges, start, stop });
                    break;
                }
                By::Edge(..) => return None,
            }
        }
        runs.reverse();
        Some(runs)
    }
}

/// The distance from start to stop.
fn length(layout: &Layout, run: &Run) -> Length {
    let whole: Length = run.edges.iter().filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length).sum();
    let last = run.edges.last().and_then(|edge| layout.edge(*edge)).map_or(Length::ZERO, |edge| edge.length);
    whole - run.start.offset - (last - run.stop.offset)
}

#[cfg(test)]
mod tests;
