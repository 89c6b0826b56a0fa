//! Ways that take the least time, with the reversals that they need.

use alloc::collections::BinaryHeap;
use alloc::vec;
use alloc::vec::Vec;
use core::cmp::Ordering;

use crate::ids::{EdgeId, NodeId};
use crate::track::{Layout, NodeKind, Position, TurnoutNeed, TurnoutStates};
use crate::units::{Length, Speed};

use super::obstacles::Obstacles;
use super::path::edge_from;

/// Shorter moves are hard to make and say nothing of where a train is: it goes round or comes from the other side.
pub(super) const SHORTEST_RUN: Length = Length::from_mm(200.0);
/// Edges that are tried beyond one turnout for a place to reverse: to the first sensor there are at most three turnouts.
const MOST_NECKS: usize = 16;

/// How long a train takes for what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pace {
    /// Its speed on the way.
    pub(super) cruise: Speed,
    /// What a start and a stop take beyond the time that the way would, in seconds.
    pub(super) start_s: f64,
    pub(super) stop_s: f64,
    /// Turning around at rest, in seconds.
    pub(super) turn_s: f64,
}

/// How far beyond a contact a train stops that has only gone there to be seen.
const PAST_CONTACT: Length = Length::from_mm(60.0);

/// A run without turning around: edges from the one it begins on to the one it ends on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Run {
    /// Whether the train turns around before.
    pub(super) turns: bool,
    pub(super) edges: Vec<EdgeId>,
    pub(super) start: Position,
    pub(super) stop: Position,
}

/// Runs one after the other, and how long they take.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Itinerary {
    pub(super) runs: Vec<Run>,
    pub(super) seconds: f64,
}

/// Everything that bears on a search but where it begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search<'a> {
    pub(super) layout: &'a Layout,
    pub(super) pace: Pace,
    /// How far a train has to run beyond a turnout so that it can be thrown behind it.
    pub(super) clears: Length,
    /// How far beyond its stop a train may be in the end: over that the way goes on as the turnouts lie.
    pub(super) beyond: Length,
    pub(super) turnouts: &'a TurnoutStates,
    pub(super) obstacles: &'a Obstacles,
    /// Turnouts that cannot be thrown for the first run, because the train stands on them or too near.
    pub(super) frozen: &'a [TurnoutNeed],
    /// Whether the first run may come from a leg to a turnout that is frozen for the other one.
    pub(super) points_give_way: bool,
}

/// How a node was come to.
#[derive(Debug, Clone, Copy, PartialEq)]
enum By {
    /// From the start, over the edge that it is on; turned around or not.
    Start {
        turned: bool,
    },
    Edge(NodeId, EdgeId),
    /// Back to a turnout, after running beyond it.
    Shunt(usize),
}

/// A way beyond a node on which the train turns around.
#[derive(Debug, Clone)]
struct Shunt {
    /// The turnout, met from a leg, or the node behind which the train backs away.
    merge: NodeId,
    out: Vec<EdgeId>,
    stop: Position,
}

/// All that can be reached from somewhere, and how.
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
    /// The soonest is the greatest, for the heap; of two, the one with the lower node.
    fn cmp(&self, other: &Self) -> Ordering {
        other.seconds.total_cmp(&self.seconds).then_with(|| other.node.cmp(&self.node))
    }
}

impl<'a> Search<'a> {
    /// Everything that a train at rest can reach: from its place as it faces, and from the place that it has when it has
    /// turned around (Dijkstra, 1959). One that does not go ahead may back away on plain track, from turnouts that cannot be
    /// thrown under it, and come back.
    pub(super) fn from(self, ahead: Option<Position>, turned: Option<Position>) -> Reached<'a> {
        let nodes = vec![None; self.layout.nodes().len()];
        let mut reached = Reached { search: self, starts: [ahead, turned], nodes, shunts: Vec::new() };
        let mut open = BinaryHeap::new();
        for (start, is_turned) in [(ahead, false), (turned, true)] {
            let Some((start, edge)) = start.and_then(|start| Some((start, self.layout.edge(start.edge)?)))
            else {
                continue;
            };
            let first = self.pace.start_s + if is_turned { self.pace.turn_s } else { 0.0 };
            if let Some(cost) = self.seconds(start.edge, start.offset, edge.length) {
                open.push(Open { seconds: first + cost, node: edge.to, by: By::Start { turned: is_turned } });
            }
        }
        while let Some(next) = open.pop() {
            match reached.nodes.get_mut(usize::from(next.node.0)) {
                Some(slot @ None) => *slot = Some((next.seconds, next.by)),
                _ => continue,
            }
            // What the run needs so far matters only where it needs more.
            let asks = |edge| self.layout.needs_of(edge).next().is_some();
            let is_merge = self.is_merge(next.node);
            let needs = if is_merge || ahead.is_none() || self.layout.ways(next.node).edges().any(asks) {
                reached.needs_until(next.node)
            } else {
                Vec::new()
            };
            for id in self.layout.ways(next.node).edges() {
                let Some(edge) = self.layout.edge(id).filter(|_| self.agrees(&needs, id)) else { continue };
                if let Some(cost) = self.seconds(id, Length::ZERO, edge.length) {
                    let by = By::Edge(next.node, id);
                    open.push(Open { seconds: next.seconds + cost, node: edge.to, by });
                }
            }
            let backs_away = ahead.is_none()
                && next.by == (By::Start { turned: true })
                && turned.is_some_and(|turned| self.is_plain(turned.edge));
            if is_merge || backs_away {
                self.shunt(&mut reached, next, &needs, &mut open);
            }
        }
        reached
    }

    /// Whether an edge is no leg of a turnout.
    fn is_plain(&self, edge: EdgeId) -> bool {
        self.layout.needs_of(edge).next().is_none()
    }

    /// Whether a turnout is met from one of its legs at a node.
    fn is_merge(&self, node: NodeId) -> bool {
        self.layout.node(node).is_some_and(|node| matches!(node.kind, NodeKind::Merge(_)))
    }

    fn is_contact(&self, node: NodeId) -> bool {
        self.layout.node(node).is_some_and(|node| matches!(node.kind, NodeKind::Sensor(_)))
    }

    /// Ways beyond a node, as a turnout that was met from a leg, each long enough to come back.
    fn shunt(&self, reached: &mut Reached<'_>, at: Open, needs: &[TurnoutNeed], open: &mut BinaryHeap<Open>) {
        let mut paths: Vec<(Vec<EdgeId>, NodeId, Length, f64)> =
            vec![(Vec::new(), at.node, self.clears, 0.0)];
        let is_merge = self.is_merge(at.node);
        let is_sure = self.is_contact(at.node) || is_merge;
        // A turnout is thrown behind the train only after a sensor beyond it has reported the train: one that got stuck on
        // dirt between the last sensor and the turnout comes to rest on it without anybody noticing. To back away, any sensor
        // on the run does: it says that the train has left.
        let is_seen = |path: &[EdgeId]| {
            path.iter().filter_map(|id| self.layout.edge(*id)).any(|edge| self.is_contact(edge.to))
        };
        let is_seen_before = !is_merge && reached.run_to(at.node).is_some_and(|(edges, _)| is_seen(&edges));
        let mut looked_at = 0;
        while let Some((path, node, left, cost)) = paths.pop() {
            looked_at += 1;
            if looked_at > MOST_NECKS {
                break;
            }
            let seen = is_seen_before || is_seen(&path);
            for id in self.layout.ways(node).edges() {
                let Some(edge) = self.layout.edge(id).filter(|_| self.agrees(needs, id)) else { continue };
                // Where it only backs away it comes over turnouts only behind a contact, which says where it is.
                if !is_sure && !seen && !self.is_plain(id) {
                    continue;
                }
                let goes_on = edge.length < left || !seen;
                let run = if goes_on { edge.length } else { left };
                let Some(more) = self.seconds(id, Length::ZERO, run) else { continue };
                let mut longer = path.clone();
                longer.push(id);
                if goes_on {
                    paths.push((longer, edge.to, (left - edge.length).max(PAST_CONTACT), cost + more));
                    continue;
                }
                let stop = Position { edge: id, offset: left };
                if !self.has_room_beyond(stop) {
                    continue;
                }
                let Pace { start_s, stop_s, turn_s, .. } = self.pace;
                let seconds = at.seconds + 2.0 * (cost + more) + stop_s + turn_s + start_s;
                open.push(Open { seconds, node: at.node.reverse(), by: By::Shunt(reached.shunts.len()) });
                reached.shunts.push(Shunt { merge: at.node, out: longer, stop });
            }
        }
    }

    /// Whether nobody keeps a train for ever from coming to rest beyond a stop.
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

    /// How long part of an edge takes, waiting for others included.
    fn seconds(&self, edge: EdgeId, from: Length, to: Length) -> Option<f64> {
        let waits = self.obstacles.cost(self.layout, edge, from, to)?;
        let limit = self.layout.zone(edge).map_or(self.pace.cruise, |zone| zone.limit);
        Some(((to - from).max(Length::ZERO) / self.pace.cruise.min(limit)).as_s() + waits)
    }

    /// Whether a run with such needs can go on over an edge: no turnout lies both ways at once.
    fn agrees(&self, needs: &[TurnoutNeed], id: EdgeId) -> bool {
        self.layout.needs_of(id).all(|need| {
            let partner = self.layout.never_curved_with(need.turnout).filter(|_| need.leg.is_curved());
            needs.iter().all(|known| {
                // Who comes from a leg gets through whatever way a turnout lies that cannot be thrown.
                let gives_way = self.points_give_way && !need.facing && self.frozen.contains(known);
                (known.turnout != need.turnout || known.leg == need.leg || gives_way)
                    && !(Some(known.turnout) == partner && known.leg.is_curved())
            })
        })
    }
}

impl Reached<'_> {
    /// The edges of the run that comes to a node, in the order of travel, and where and how it began.
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
                By::Start { turned } => {
                    edges.push(self.starts.get(usize::from(turned))?.as_ref()?.edge);
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
        // What the train stands on counts first, and its own edges are as they lie.
        frozen.iter().copied().chain(needs).collect()
    }

    /// How long it takes at least to come to rest at a place, as far as can be told without looking at the runs.
    pub(super) fn seconds_to(&self, target: Position) -> Option<f64> {
        let edge = self.search.layout.edge(target.edge)?;
        let (until, _) = (*self.nodes.get(usize::from(edge.from.0))?)?;
        Some(until + self.search.seconds(target.edge, Length::ZERO, target.offset)? + self.search.pace.stop_s)
    }

    /// The soonest way to rest at each of several places, the soonest of them first.
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
        // On the edge that the train stands on it may be ahead of it.
        let direct = [false, true].into_iter().filter_map(|turned| {
            let start = (*self.starts.get(usize::from(turned))?)?;
            let is_ahead = start.edge == target.edge && target.offset - start.offset >= SHORTEST_RUN;
            let cost = is_ahead.then(|| self.search.seconds(target.edge, start.offset, target.offset))??;
            let Pace { start_s, stop_s, turn_s, .. } = self.search.pace;
            let seconds = cost + start_s + stop_s + if turned { turn_s } else { 0.0 };
            let run = Run { turns: turned, edges: vec![target.edge], start, stop: target };
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

    /// The runs that come to a node, the last of which goes on to a target on an edge from there.
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
                    runs.push(Run { turns: true, edges, start, stop });
                    stop = shunt.stop;
                    let (mut before, began) = self.run_to(shunt.merge)?;
                    before.extend(&shunt.out);
                    (edges, by) = (before, began);
                }
                By::Start { turned } => {
                    let start = (*self.starts.get(usize::from(turned))?)?;
                    runs.push(Run { turns: turned, edges, start, stop });
                    break;
                }
                By::Edge(..) => return None,
            }
        }
        runs.reverse();
        Some(runs)
    }
}

/// The way from start to stop.
fn length(layout: &Layout, run: &Run) -> Length {
    let whole: Length = run.edges.iter().filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length).sum();
    let last = run.edges.last().and_then(|edge| layout.edge(*edge)).map_or(Length::ZERO, |edge| edge.length);
    whole - run.start.offset - (last - run.stop.offset)
}
