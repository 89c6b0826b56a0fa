//! Paths over the rails: consecutive edges with distances from the start, and the edges that a train came over.

use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId};
use crate::track::{Layout, Leg, NodeKind, OutgoingEdges, Position, TurnoutNeed, TurnoutStates};
use crate::units::Length;

use super::reservation::Reservation;

/// The most edges of a path: several laps of any layout in use.
const MAX_EDGES: usize = 1_000;

/// Edges in the order of travel.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Path {
    /// Each edge with the distance of its start.
    edges: Vec<(EdgeId, Length)>,
    length: Length,
}

impl Path {
    /// Appends an edge.
    pub(super) fn push(&mut self, layout: &Layout, id: EdgeId) {
        let Some(edge) = layout.edge(id) else { return };
        self.edges.push((id, self.length));
        self.length += edge.length;
    }

    /// Drops everything after the last occurrence of an edge.
    pub(super) fn cut_after(&mut self, edge: EdgeId) {
        while self.edges.len() > 1 && self.edges.last().is_some_and(|(last, _)| *last != edge) {
            if let Some((_, begins)) = self.edges.pop() {
                self.length = begins;
            }
        }
    }

    pub(super) const fn length(&self) -> Length {
        self.length
    }

    pub(super) fn edges(&self) -> impl DoubleEndedIterator<Item = EdgeId> {
        self.edges.iter().map(|(id, _)| *id)
    }

    /// The track behind and ahead of a place: the edges that the train came over, and otherwise those for the present
    /// turnout positions; shorter if the track ends. Returns the path and the distance of the place on it.
    pub(super) fn around(
        layout: &Layout,
        turnouts: &TurnoutStates,
        place: Position,
        occupied: &OccupiedPath,
        behind: Length,
        ahead: Length,
    ) -> (Self, Length) {
        let mut before = Vec::new();
        let mut left = behind - place.offset;
        let mut edge = place.edge;
        let mut occupied = occupied.before(place.edge);
        while left > Length::ZERO && before.len() < MAX_EDGES {
            let in_position = |edge: EdgeId| Some(next_edge(layout, turnouts, edge.twin())?.twin());
            let Some(next) = occupied.next().or_else(|| in_position(edge)) else { break };
            edge = next;
            before.push(edge);
            left -= layout.edge(edge).map_or(Length::ZERO, |edge| edge.length);
        }
        let mut path = Self::default();
        before.into_iter().rev().for_each(|edge| path.push(layout, edge));
        let at = path.length + place.offset;
        path.push(layout, place.edge);
        path.reach(layout, turnouts, at + ahead);
        (path, at)
    }

    /// Extends the path over the turnouts as set, to a length or the end of the track. Turnouts of unknown position
    /// count as straight.
    pub(super) fn reach(&mut self, layout: &Layout, turnouts: &TurnoutStates, length: Length) {
        while self.length <= length && self.edges.len() < MAX_EDGES {
            let Some(next) = self.edges.last().and_then(|(last, _)| next_edge(layout, turnouts, *last))
            else {
                break;
            };
            self.push(layout, next);
        }
    }

    /// The distance of a place, the first one from a point on; a centimetre before still counts.
    pub(super) fn find(&self, place: Position, from: Length) -> Option<Length> {
        let slack = Length::from_mm(10.0);
        let at = |(id, begins): &(EdgeId, Length)| (*id == place.edge).then_some(*begins + place.offset);
        self.edges.iter().filter_map(at).find(|at| *at >= from - slack)
    }

    /// The distance of a node, the first one from a point on.
    pub(super) fn find_node(&self, layout: &Layout, node: NodeId, from: Length) -> Option<Length> {
        let at = |(id, begins): &(EdgeId, Length)| {
            let edge = layout.edge(*id)?;
            if edge.from == node {
                return Some(*begins);
            }
            (edge.to == node).then_some(*begins + edge.length)
        };
        self.edges.iter().filter_map(at).find(|at| *at >= from)
    }

    /// The place at a distance.
    pub(super) fn place(&self, at: Length) -> Option<Position> {
        let found = self.edges.iter().rev().find(|(_, begins)| *begins <= at).or(self.edges.first())?;
        Some(Position { edge: found.0, offset: (at - found.1).max(Length::ZERO) })
    }

    /// The edges that an interval touches, each with the interval on it.
    fn within(
        &self,
        layout: &Layout,
        from: Length,
        to: Length,
    ) -> impl Iterator<Item = (EdgeId, [Length; 2])> {
        self.edges.iter().filter_map(move |(id, begins)| {
            let length = layout.edge(*id)?.length;
            let (from, to) = ((from - *begins).max(Length::ZERO), (to - *begins).min(length));
            (from <= to && to >= Length::ZERO).then_some((*id, [from, to]))
        })
    }

    /// The reservation for an interval of the path.
    pub(super) fn reservation(&self, layout: &Layout, from: Length, to: Length) -> Reservation {
        let mut taken = Reservation::empty();
        for (id, [from, to]) in self.within(layout, from, to) {
            taken.take(layout, id, from, to);
        }
        taken
    }

    /// The turnouts trailed on an interval of the path, with the legs that they are trailed from.
    pub(super) fn trailed(
        &self,
        layout: &Layout,
        from: Length,
        to: Length,
    ) -> impl Iterator<Item = TurnoutNeed> {
        self.within(layout, from, to).flat_map(move |(id, [_, to])| {
            let passes_toe = layout.edge(id).is_some_and(|edge| to >= edge.length);
            layout.needs_of(id).filter(move |need| passes_toe && !need.facing)
        })
    }

    /// The turnouts whose toes an interval of the path passes, with the legs that they need, each once, in order.
    pub(super) fn needs(&self, layout: &Layout, from: Length, to: Length) -> Vec<TurnoutNeed> {
        let mut needs: Vec<TurnoutNeed> = Vec::new();
        for (id, [from, to]) in self.within(layout, from, to) {
            let length = layout.edge(id).map_or(Length::ZERO, |edge| edge.length);
            for need in layout.needs_of(id) {
                let passes_toe = if need.facing { from <= Length::ZERO } else { to >= length };
                if passes_toe && !needs.iter().any(|known| known.turnout == need.turnout) {
                    needs.push(need);
                }
            }
        }
        needs
    }
}

/// The edge that follows an edge with the present turnout positions.
fn next_edge(layout: &Layout, turnouts: &TurnoutStates, edge: EdgeId) -> Option<EdgeId> {
    edge_from(layout, turnouts, layout.edge(edge)?.to)
}

/// The edge ahead of a node with the present turnout positions; straight for unknown ones.
pub(super) fn edge_from(layout: &Layout, turnouts: &TurnoutStates, node: NodeId) -> Option<EdgeId> {
    let node = layout.node(node)?;
    match (node.outgoing, node.kind) {
        (OutgoingEdges::Ahead(next), _) => Some(next),
        (OutgoingEdges::Legs { curved, .. }, NodeKind::Branch(turnout))
            if turnouts.get(turnout) == Some(Leg::Curved) =>
        {
            Some(curved)
        }
        (OutgoingEdges::Legs { straight, .. }, _) => Some(straight),
        (OutgoingEdges::Ended, _) => None,
    }
}

/// No train occupies more edges, or runs over more between two calls.
const MAX_OCCUPIED: usize = 16;

/// The edges that a train came over, whatever the turnout positions since, in the order of travel; the leading end of
/// the pickup is on the last one.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct OccupiedPath {
    edges: Vec<EdgeId>,
}

impl OccupiedPath {
    /// Records the present place of the leading end of the pickup: ahead, reversed, or elsewhere.
    pub(super) fn record(&mut self, layout: &Layout, place: Position) {
        let Some(last) = self.edges.last().copied() else {
            self.edges.push(place.edge);
            return;
        };
        if last == place.edge {
            return;
        }
        // A train that has run round a loop comes back over the edges on which it came, and has not reversed.
        let runs_on = layout
            .edge(last)
            .is_some_and(|known| layout.outgoing(known.to).edges().any(|next| next == place.edge));
        let reversed = self.edges.iter().rposition(|edge| edge.twin() == place.edge);
        if let Some(reversed) = reversed.filter(|_| !runs_on) {
            let behind = self.edges.iter().skip(reversed).rev().map(|edge| edge.twin());
            self.edges = behind.collect();
            return;
        }
        match fewest_edges(layout, last, place.edge) {
            Some(path) => self.edges.extend(path),
            None => self.edges = alloc::vec![place.edge],
        }
        let spare = self.edges.len().saturating_sub(MAX_OCCUPIED);
        self.edges.drain(..spare);
    }

    /// The edges before the one that the train is on, the latest first; none if it is not on that edge.
    pub(super) fn before(&self, edge: EdgeId) -> impl Iterator<Item = EdgeId> {
        let is_there = self.edges.last() == Some(&edge);
        self.edges.iter().rev().skip(1).filter(move |_| is_there).copied()
    }
}

/// The path with the fewest edges from one edge to another over any legs, without the first edge.
fn fewest_edges(layout: &Layout, from: EdgeId, to: EdgeId) -> Option<Vec<EdgeId>> {
    let mut open = alloc::vec![alloc::vec![from]];
    for _ in 0..MAX_OCCUPIED {
        let mut longer = Vec::new();
        for path in open {
            let node = layout.edge(*path.last()?)?.to;
            for next in layout.outgoing(node).edges() {
                let path: Vec<EdgeId> = path.iter().copied().chain([next]).collect();
                if next == to {
                    return Some(path.into_iter().skip(1).collect());
                }
                longer.push(path);
            }
        }
        open = longer;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::TurnoutId;
    use crate::track::example::oval;

    fn mm(mm: f64) -> Length {
        Length::from_mm(mm)
    }

    fn edge(layout: &Layout, from: &str, to: &str) -> EdgeId {
        let node = |name: &str| layout.node_named(name).unwrap();
        layout.edge_between(node(from), node(to)).unwrap()
    }

    fn set(leg: Leg) -> TurnoutStates {
        [1, 2].map(|turnout| (TurnoutId(turnout), leg)).into_iter().collect()
    }

    /// From D1 a lap over the straight legs and on to A1: begins at 0, 500, 600, 800, 1000 and 1100 mm, 1600 mm long.
    fn lap(layout: &Layout) -> Path {
        let mut path = Path::default();
        path.push(layout, edge(layout, "D1", "A1"));
        path.reach(layout, &set(Leg::Straight), mm(1590.0));
        path
    }

    fn near(found: Option<Length>, expected: f64) -> bool {
        found.is_some_and(|found| (found - mm(expected)).abs() < mm(1e-6))
    }

    #[test]
    fn places_and_nodes_are_found_from_a_distance_on_lap_by_lap() {
        let layout = oval();
        let path = lap(&layout);
        assert!(near(Some(path.length()), 1600.0), "{path:?}");
        let at = |offset: f64| Position { edge: edge(&layout, "D1", "A1"), offset: mm(offset) };
        assert!(near(path.find(at(30.0), mm(0.0)), 30.0));
        // A centimetre before still counts, and no more.
        assert!(near(path.find(at(30.0), mm(39.0)), 30.0) && near(path.find(at(30.0), mm(41.0)), 1130.0));
        assert_eq!(path.find(at(30.0), mm(1141.0)), None);
        let node = |name: &str| layout.node_named(name).unwrap();
        for (name, from, expected) in [
            ("D1", 0.0, Some(0.0)),
            ("D1", 1.0, Some(1100.0)),
            ("B1", 0.0, Some(800.0)),
            ("A1", 501.0, Some(1600.0)),
            ("C1", 0.0, None),
        ] {
            let found = path.find_node(&layout, node(name), mm(from));
            assert!(expected.map_or(found.is_none(), |mm| near(found, mm)), "{name} {found:?}");
        }
        for (at, from, to, offset) in [
            (550.0, "A1", "BR1", 50.0),
            (-10.0, "D1", "A1", 0.0),
            (1100.0, "D1", "A1", 0.0),
            (1600.0, "D1", "A1", 500.0),
        ] {
            let place = path.place(mm(at)).unwrap();
            assert!(
                place.edge == edge(&layout, from, to) && near(Some(place.offset), offset),
                "{at}: {place:?}"
            );
        }
    }

    #[test]
    fn a_path_is_cut_behind_the_last_time_that_it_runs_over_an_edge() {
        let layout = oval();
        let mut path = lap(&layout);
        path.cut_after(edge(&layout, "D1", "A1"));
        assert!(near(Some(path.length()), 1600.0), "it ends on it");
        path.cut_after(edge(&layout, "BR1", "B1"));
        assert!(near(Some(path.length()), 800.0) && path.edges().count() == 3, "{path:?}");
        path.cut_after(edge(&layout, "BR1", "C1"));
        assert!(near(Some(path.length()), 500.0) && path.edges().count() == 1, "all but its first");
    }

    #[test]
    fn the_track_behind_is_that_which_a_train_came_over_and_that_ahead_as_turnouts_lie() {
        let layout = oval();
        let place =
            |from: &str, to: &str, offset| Position { edge: edge(&layout, from, to), offset: mm(offset) };
        // 260 mm before A1 are on one edge; 500 mm ahead end behind MR2, at 1000 of 1100 mm.
        let at = place("A1", "BR1", 40.0);
        let came = OccupiedPath::default();
        let (path, distance) = Path::around(&layout, &set(Leg::Straight), at, &came, mm(300.0), mm(500.0));
        assert!(near(Some(distance), 540.0) && near(Some(path.length()), 1100.0), "{path:?}");
        assert!(path.edges().any(|id| id == edge(&layout, "BR1", "B1")));
        // Over the curved legs 220 + 150 mm instead of twice 200.
        let (path, _) = Path::around(&layout, &set(Leg::Curved), at, &came, mm(300.0), mm(500.0));
        assert!(near(Some(path.length()), 500.0 + 100.0 + 220.0 + 150.0 + 100.0), "{path:?}");
        // It came over C1, wherever MR2 lies now: 10 + 150 + 220 mm reach 200 mm back.
        let mut came = OccupiedPath::default();
        came.record(&layout, place("C1", "MR2", 20.0));
        came.record(&layout, place("MR2", "D1", 10.0));
        let at = place("MR2", "D1", 10.0);
        let (path, distance) = Path::around(&layout, &set(Leg::Straight), at, &came, mm(200.0), mm(0.0));
        assert!(near(Some(distance), 380.0), "{distance:?} {path:?}");
        assert!(path.edges().any(|id| id == edge(&layout, "C1", "MR2")));
        // Elsewhere nothing is known of where it came from.
        assert_eq!(came.before(edge(&layout, "D1", "A1")).count(), 0);
    }

    #[test]
    fn a_train_that_runs_round_is_ahead_and_one_that_turns_is_on_its_own_track() {
        let layout = oval();
        let place = |from: &str, to: &str| Position { edge: edge(&layout, from, to), offset: mm(10.0) };
        let mut came = OccupiedPath::default();
        for (from, to) in [("D1", "A1"), ("BR1", "B1"), ("B1", "MR2")] {
            came.record(&layout, place(from, to));
        }
        // The edge between D1 and the turnout was passed between two calls.
        let before: Vec<EdgeId> = came.before(edge(&layout, "B1", "MR2")).collect();
        let expected = [("BR1", "B1"), ("A1", "BR1"), ("D1", "A1")].map(|(from, to)| edge(&layout, from, to));
        assert_eq!(before, expected);
        // Reversed behind B1, it came over what lies behind its other end.
        let back = edge(&layout, "BR1", "B1").twin();
        came.record(&layout, Position { edge: back, offset: mm(10.0) });
        assert_eq!(came.before(back).collect::<Vec<_>>(), [edge(&layout, "B1", "MR2").twin()]);
        // A lap is a path ahead, not a reversal.
        let mut round = OccupiedPath::default();
        round.record(&layout, place("D1", "A1"));
        round.record(&layout, place("MR2", "D1"));
        assert_eq!(round.before(edge(&layout, "MR2", "D1")).count(), 4, "{round:?}");
        // On other rails it is known nowhere else.
        round.record(&layout, place("E1", "EX2"));
        assert_eq!(round, OccupiedPath { edges: alloc::vec![edge(&layout, "E1", "EX2")] });
    }

    #[test]
    fn an_interval_needs_the_turnouts_whose_toes_it_passes() {
        let layout = oval();
        let path = lap(&layout);
        let needs = |from: f64, to: f64| -> Vec<(TurnoutId, bool)> {
            path.needs(&layout, mm(from), mm(to)).iter().map(|need| (need.turnout, need.facing)).collect()
        };
        // Turnout 1 lies at 600 mm and is faced, turnout 2 at 1000 mm and is trailed.
        assert_eq!(needs(0.0, 590.0), []);
        assert_eq!(needs(550.0, 700.0), [(TurnoutId(1), true)]);
        assert_eq!(needs(610.0, 990.0), []);
        assert_eq!(needs(550.0, 1010.0), [(TurnoutId(1), true), (TurnoutId(2), false)]);
        let trailed: Vec<TurnoutId> =
            path.trailed(&layout, mm(550.0), mm(1010.0)).map(|need| need.turnout).collect();
        assert_eq!(trailed, [TurnoutId(2)]);
        assert_eq!(path.trailed(&layout, mm(550.0), mm(990.0)).count(), 0);
    }
}
