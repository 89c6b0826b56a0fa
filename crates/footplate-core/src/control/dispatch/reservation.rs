//! Reservations: intervals of stretches and whole turnouts; blocks, and obstacles to a path search.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use crate::ids::{EdgeId, NodeId, StretchId, TurnoutId};
use crate::track::{Layout, NodeKind};
use crate::units::Length;

/// The distance of the fouling point of a turnout from its toe: nearer, a train on one leg obstructs the other. On
/// Märklin's K track it is 180 mm for a 22.5 degree turnout; one or two centimetres are added for the ends of long
/// vehicles, which overhang in curves. The tracks of a crossing diverge at the angle of a turnout or more.
pub const CLEARANCE: Length = Length::from_mm(200.0);

/// An interval of a stretch, counted from the start of the first of its two edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Where it begins.
    pub from: Length,
    /// Where it ends, not before it begins.
    pub to: Length,
}

impl Span {
    /// Part of an edge, measured from its start; `None` if it is empty or the edge is of another layout.
    pub(super) fn on(layout: &Layout, id: EdgeId, from: Length, to: Length) -> Option<Self> {
        let length = layout.edge(id)?.length;
        let (from, to) = (from.max(Length::ZERO), to.min(length));
        let span =
            if id < id.twin() { Self { from, to } } else { Self { from: length - to, to: length - from } };
        (from <= to).then_some(span)
    }
}

/// Track that is or will be reserved: rails and turnouts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reservation {
    spans: BTreeMap<StretchId, Vec<Span>>,
    /// Track of others that crosses these rails: no other train may be there, but its rails are not the train's own.
    crossed: BTreeMap<StretchId, Vec<Span>>,
    turnouts: BTreeSet<TurnoutId>,
}

impl Reservation {
    /// An empty reservation.
    pub const fn empty() -> Self {
        Self { spans: BTreeMap::new(), crossed: BTreeMap::new(), turnouts: BTreeSet::new() }
    }

    /// Whether it has no track.
    pub fn is_empty(&self) -> bool {
        self.spans.is_empty() && self.turnouts.is_empty()
    }

    /// The reserved rails, stretch by stretch.
    pub fn spans(&self) -> impl Iterator<Item = (StretchId, Span)> {
        each(&self.spans)
    }

    /// The rails that no other train may reserve: the reserved ones, and those that cross them.
    pub(super) fn obstructed(&self) -> impl Iterator<Item = (StretchId, Span)> {
        each(&self.spans).chain(each(&self.crossed))
    }

    /// The reserved turnouts, with those that share their place.
    pub fn turnouts(&self) -> impl Iterator<Item = TurnoutId> {
        self.turnouts.iter().copied()
    }

    /// Whether a turnout is reserved.
    pub fn takes(&self, turnout: TurnoutId) -> bool {
        self.turnouts.contains(&turnout)
    }

    /// Adds a turnout, and the one in the same place.
    pub fn take_turnout(&mut self, layout: &Layout, turnout: TurnoutId) {
        self.turnouts.insert(turnout);
        self.turnouts.extend(layout.never_curved_with(turnout));
    }

    /// Removes a turnout, and the one in the same place.
    pub(super) fn release_turnout(&mut self, layout: &Layout, turnout: TurnoutId) {
        self.turnouts.retain(|reservation| {
            *reservation != turnout && Some(*reservation) != layout.never_curved_with(turnout)
        });
    }

    /// Adds part of an edge, counted from its start, without turnouts.
    pub(in crate::control) fn take_rails(&mut self, layout: &Layout, id: EdgeId, from: Length, to: Length) {
        if let Some(span) = Span::on(layout, id, from, to) {
            self.spans.entry(id.stretch()).or_default().push(span);
        }
    }

    /// Adds part of an edge, counted from its start, and what it fouls: the turnouts of which it is a leg, and the tracks that
    /// cross it.
    pub fn take(&mut self, layout: &Layout, id: EdgeId, from: Length, to: Length) {
        let Some(span) = Span::on(layout, id, from, to) else { return };
        let spans = self.spans.entry(id.stretch()).or_default();
        // Intervals that touch are one.
        let mut merged = span;
        spans.retain(|other| {
            let apart = other.to < merged.from || merged.to < other.from;
            if !apart {
                merged = Span { from: merged.from.min(other.from), to: merged.to.max(other.to) };
            }
            apart
        });
        spans.push(merged);
        self.turnouts.extend(turnouts_near(layout, id, from, to));
        for other in layout.crossed_near(id, from, to, CLEARANCE) {
            let crossed = Span::on(layout, other.edge, other.offset - CLEARANCE, other.offset + CLEARANCE);
            let known = self.crossed.entry(other.edge.stretch()).or_default();
            known.extend(crossed.filter(|crossed| !known.contains(crossed)));
        }
    }

    /// Adds another reservation.
    pub fn add(&mut self, layout: &Layout, other: &Self) {
        for (stretch, span) in other.spans() {
            self.take(layout, EdgeId(2 * stretch.0), span.from, span.to);
        }
        self.turnouts.extend(&other.turnouts);
    }

    /// Whether two reservations share any track, or cross.
    pub fn meets(&self, other: &Self) -> bool {
        let shares = |(stretch, span): (StretchId, Span)| other.obstructs(stretch, span);
        // Two trains that cross the same track one behind the other do not meet.
        let is_crossed = |(stretch, span): (StretchId, Span)| overlaps(&self.crossed, stretch, span);
        !self.turnouts.is_disjoint(&other.turnouts)
            || self.spans().any(shares)
            || other.spans().any(is_crossed)
    }

    /// Whether another train on any part of an interval would meet this one.
    fn obstructs(&self, stretch: StretchId, span: Span) -> bool {
        overlaps(&self.spans, stretch, span) || overlaps(&self.crossed, stretch, span)
    }

    /// Where reserved track begins on an edge, from an offset on in its direction: reserved rails, or the fouling point
    /// of a reserved turnout. `None` if the rest of the edge is not reserved.
    pub fn begins_on(&self, layout: &Layout, id: EdgeId, from: Length) -> Option<Length> {
        let rest = Span::on(layout, id, from, layout.edge(id)?.length)?;
        let length = layout.edge(id)?.length;
        let met =
            [&self.spans, &self.crossed].into_iter().filter_map(|spans| spans.get(&id.stretch())).flatten();
        let met = met.filter(|span| span.from <= rest.to && rest.from <= span.to);
        let rails = met.map(|span| if id < id.twin() { span.from } else { length - span.to });
        let is_taken = |turnout: &TurnoutId| self.turnouts.contains(turnout);
        let entered = leg_of(layout, id).filter(is_taken).filter(|_| from < CLEARANCE).map(|_| from);
        let left = leg_of(layout, id.twin()).filter(is_taken).map(|_| length - CLEARANCE);
        rails
            .chain(entered)
            .chain(left)
            .min_by(|one, other| one.as_m().total_cmp(&other.as_m()))
            .map(|at| at.max(from))
    }

    /// Whether all of an interval is reserved, except less than `tolerance` at its ends.
    pub fn covers(&self, stretch: StretchId, span: Span, tolerance: Length) -> bool {
        let spans = self.spans.get(&stretch);
        spans.is_some_and(|spans| {
            spans.iter().any(|own| own.from <= span.from + tolerance && span.to - tolerance <= own.to)
        })
    }
}

/// Whether any part of an interval is among others.
fn overlaps(spans: &BTreeMap<StretchId, Vec<Span>>, stretch: StretchId, span: Span) -> bool {
    let spans = spans.get(&stretch);
    spans.is_some_and(|spans| spans.iter().any(|own| own.from <= span.to && span.from <= own.to))
}

/// The turnouts that part of an edge fouls as one of their legs, with those in the same places.
pub(super) fn turnouts_near(
    layout: &Layout,
    id: EdgeId,
    from: Length,
    to: Length,
) -> impl Iterator<Item = TurnoutId> {
    let length = layout.edge(id).map_or(Length::ZERO, |edge| edge.length);
    let first = leg_of(layout, id).filter(|_| from < CLEARANCE);
    let last = leg_of(layout, id.twin()).filter(|_| length - to < CLEARANCE);
    let both = [first, last].into_iter().flatten();
    both.flat_map(|turnout| [Some(turnout), layout.never_curved_with(turnout)].into_iter().flatten())
}

/// The turnout of which an edge is a leg, leading away from it.
fn leg_of(layout: &Layout, id: EdgeId) -> Option<TurnoutId> {
    let edge = layout.edge(id)?;
    edge.leg?;
    match layout.node(edge.from)?.kind {
        NodeKind::Branch(turnout) => Some(turnout),
        _ => None,
    }
}

/// A shorter reservation in a block does not take the block.
const TOUCHES: Length = Length::from_mm(1.0);

/// The blocks of a layout: the track between sensors, reserved as a whole with all its turnouts.
#[derive(Debug, Clone)]
pub(super) struct Blocks {
    of: BTreeMap<StretchId, usize>,
    whole: Vec<Reservation>,
}

impl Blocks {
    pub(super) fn of(layout: &Layout) -> Self {
        let mut blocks = Self { of: BTreeMap::new(), whole: Vec::new() };
        for (id, _) in layout.edges() {
            if !blocks.of.contains_key(&id.stretch()) {
                blocks.add(layout, id);
            }
        }
        blocks
    }

    /// Adds the block of an edge: all rails that can be reached without passing a sensor.
    fn add(&mut self, layout: &Layout, first: EdgeId) {
        let mut whole = Reservation::empty();
        let mut open = alloc::vec![first];
        while let Some(id) = open.pop() {
            let Some(edge) = layout.edge(id) else { continue };
            if self.of.insert(id.stretch(), self.whole.len()).is_some() {
                continue;
            }
            whole.take(layout, id, Length::ZERO, edge.length);
            let is_sensor = |node: NodeId| {
                [node, node.reverse()].into_iter().any(|node| layout.sensor_at(node).is_some())
            };
            for node in [edge.from, edge.to].into_iter().filter(|node| !is_sensor(*node)) {
                let edges = [node, node.reverse()].into_iter().flat_map(|node| layout.outgoing(node).edges());
                open.extend(edges.filter(|next| !self.of.contains_key(&next.stretch())));
            }
        }
        self.whole.push(whole);
    }

    /// The reservation extended to whole blocks.
    pub(super) fn around(&self, layout: &Layout, taken: &Reservation) -> Reservation {
        let mut around = taken.clone();
        for (stretch, span) in taken.spans() {
            let block = self.of.get(&stretch).and_then(|block| self.whole.get(*block));
            if let Some(block) = block.filter(|_| span.to - span.from >= TOUCHES) {
                around.add(layout, block);
            }
        }
        around
    }
}

/// Spans, stretch by stretch.
fn each(spans: &BTreeMap<StretchId, Vec<Span>>) -> impl Iterator<Item = (StretchId, Span)> {
    spans.iter().flat_map(|(stretch, spans)| spans.iter().map(|span| (*stretch, *span)))
}

/// Reservations of other trains in a path search: track that is closed, or costs waiting time.
#[derive(Debug, Clone, Default)]
pub(super) struct Obstacles {
    /// Intervals with their cost in seconds, which is infinite if closed.
    spans: BTreeMap<StretchId, Vec<(Span, f64)>>,
    turnouts: BTreeMap<TurnoutId, f64>,
}

impl Obstacles {
    /// Adds a reservation, with a cost in seconds for each stretch and turnout.
    pub(super) fn add(&mut self, reservation: &Reservation, seconds: f64) {
        for (stretch, span) in reservation.obstructed() {
            self.spans.entry(stretch).or_default().push((span, seconds));
        }
        for turnout in reservation.turnouts() {
            let known = self.turnouts.entry(turnout).or_default();
            *known = known.max(seconds);
        }
    }

    /// The cost of running over part of an edge, in seconds; `None` if it is closed.
    pub(super) fn cost(&self, layout: &Layout, id: EdgeId, from: Length, to: Length) -> Option<f64> {
        let mut cost = 0.0;
        if let Some(spans) = self.spans.get(&id.stretch()) {
            let span = Span::on(layout, id, from, to)?;
            let met = spans
                .iter()
                .filter(|(reservation, _)| reservation.from <= span.to && span.from <= reservation.to);
            cost += met.map(|(_, seconds)| *seconds).sum::<f64>();
        }
        for turnout in turnouts_near(layout, id, from, to) {
            cost += self.turnouts.get(&turnout).copied().unwrap_or_default();
        }
        cost.is_finite().then_some(cost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Position;
    use crate::track::example::oval;

    #[test]
    fn only_one_train_at_a_time_is_near_a_crossing() {
        let plain = oval();
        let node = |name: &str| plain.node_named(name).unwrap();
        let edge = |from, to| plain.edge_between(node(from), node(to)).unwrap();
        let [main, siding] = [edge("D1", "A1"), edge("BR1", "C1")];
        let at = |edge, mm| Position { edge, offset: Length::from_mm(mm) };
        let layout = plain.clone().with_crossing([at(main, 250.0), at(siding, 210.0)]).unwrap();
        let taken = |layout: &Layout, edge, from, to| {
            let mut reservation = Reservation::empty();
            reservation.take(layout, edge, Length::from_mm(from), Length::from_mm(to));
            reservation
        };
        // 200 mm on either side of the crossing, on both tracks.
        let beside = taken(&layout, siding, 100.0, 120.0);
        assert!(beside.meets(&taken(&layout, main, 0.0, 60.0)));
        assert!(!beside.meets(&taken(&layout, main, 0.0, 40.0)));
        assert!(!taken(&layout, siding, 0.0, 5.0).meets(&taken(&layout, main, 0.0, 500.0)));
        assert!(!taken(&plain, siding, 100.0, 120.0).meets(&taken(&plain, main, 0.0, 500.0)));
        // Two trains on one track, on either side of the crossing.
        assert!(!taken(&layout, main, 0.0, 100.0).meets(&taken(&layout, main, 400.0, 500.0)));
        // A train that runs towards the crossing stops short of it.
        let begins = beside.begins_on(&layout, main, Length::ZERO).map(Length::as_mm);
        assert!(begins.is_some_and(|mm| (mm - 50.0).abs() < 1e-9), "{begins:?}");
    }

    #[test]
    fn an_interval_is_covered_if_no_more_than_the_tolerance_is_outside_at_either_end() {
        let layout = oval();
        let node = |name: &str| layout.node_named(name).unwrap();
        let edge = layout.edge_between(node("D1"), node("A1")).unwrap();
        let mm = Length::from_mm;
        let mut reservation = Reservation::empty();
        reservation.take(&layout, edge, mm(100.0), mm(400.0));
        let covers = |from, to| {
            let span = Span::on(&layout, edge, mm(from), mm(to)).unwrap();
            reservation.covers(edge.stretch(), span, mm(10.0))
        };
        assert!(covers(100.0, 400.0) && covers(91.0, 409.0) && covers(200.0, 300.0));
        assert!(!covers(89.0, 300.0), "11 mm before it");
        assert!(!covers(200.0, 411.0), "11 mm beyond it");
        assert!(!Reservation::empty().covers(
            edge.stretch(),
            Span::on(&layout, edge, mm(1.0), mm(2.0)).unwrap(),
            mm(10.0)
        ));
    }
}
