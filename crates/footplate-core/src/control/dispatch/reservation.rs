//! Reservations: intervals of stretches, and whole turnouts.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use crate::ids::{EdgeId, StretchId, TurnoutId};
use crate::track::{Layout, NodeKind};
use crate::units::Length;

/// The fouling point of a turnout, from its toe: nearer, a train on one leg leaves no room for one on the other. On
/// Märklin's K track it is 180 mm from the toe of a 22.5 degree turnout; a centimetre or two more is for the ends of long
/// vehicles, which hang out in curves.
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
    /// Part of an edge, counted from its start; `None` for an edge of another layout, and for nothing.
    pub(super) fn on(layout: &Layout, id: EdgeId, from: Length, to: Length) -> Option<Self> {
        let length = layout.edge(id)?.length;
        let (from, to) = (from.max(Length::ZERO), to.min(length));
        let span =
            if id < id.twin() { Self { from, to } } else { Self { from: length - to, to: length - from } };
        (from <= to).then_some(span)
    }
}

/// Rails and turnouts that are reserved, or are to be.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reservation {
    spans: BTreeMap<StretchId, Vec<Span>>,
    turnouts: BTreeSet<TurnoutId>,
}

impl Reservation {
    /// No track.
    #[must_use]
    pub const fn empty() -> Self {
        Self { spans: BTreeMap::new(), turnouts: BTreeSet::new() }
    }

    /// Whether it has no track.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.spans.is_empty() && self.turnouts.is_empty()
    }

    /// The reserved rails, stretch by stretch.
    pub fn spans(&self) -> impl Iterator<Item = (StretchId, Span)> {
        self.spans.iter().flat_map(|(stretch, spans)| spans.iter().map(|span| (*stretch, *span)))
    }

    /// The reserved turnouts, with those that share their place.
    pub fn turnouts(&self) -> impl Iterator<Item = TurnoutId> {
        self.turnouts.iter().copied()
    }

    /// Whether a turnout is reserved.
    #[must_use]
    pub fn takes(&self, turnout: TurnoutId) -> bool {
        self.turnouts.contains(&turnout)
    }

    /// Adds a turnout, and the one in the same place.
    pub fn take_turnout(&mut self, layout: &Layout, turnout: TurnoutId) {
        self.turnouts.insert(turnout);
        self.turnouts.extend(layout.never_curved_with(turnout));
    }

    /// Adds part of an edge, counted from its start, without turnouts.
    pub(super) fn take_rails(&mut self, layout: &Layout, id: EdgeId, from: Length, to: Length) {
        if let Some(span) = Span::on(layout, id, from, to) {
            self.spans.entry(id.stretch()).or_default().push(span);
        }
    }

    /// Adds part of an edge, counted from its start, and the turnouts of which it is a leg if it fouls them.
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
    }

    /// Adds another reservation.
    pub fn add(&mut self, layout: &Layout, other: &Self) {
        for (stretch, span) in other.spans() {
            self.take(layout, EdgeId(2 * stretch.0), span.from, span.to);
        }
        self.turnouts.extend(&other.turnouts);
    }

    /// Whether two reservations share any track.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        let shares = |(stretch, span): (StretchId, Span)| other.overlaps(stretch, span);
        !self.turnouts.is_disjoint(&other.turnouts) || self.spans().any(shares)
    }

    /// Whether any part of an interval is reserved.
    #[must_use]
    pub fn overlaps(&self, stretch: StretchId, span: Span) -> bool {
        let spans = self.spans.get(&stretch);
        spans.is_some_and(|spans| spans.iter().any(|own| own.from <= span.to && span.from <= own.to))
    }

    /// Whether all of an interval is reserved, but for less than `tolerance` at its ends.
    #[must_use]
    pub fn covers(&self, stretch: StretchId, span: Span, tolerance: Length) -> bool {
        let spans = self.spans.get(&stretch);
        spans.is_some_and(|spans| {
            spans.iter().any(|own| own.from <= span.from + tolerance && span.to - tolerance <= own.to)
        })
    }
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
