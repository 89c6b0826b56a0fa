//! The parts of edges that a train, its uncertainty or a reservation covers.

use footplate_core::control::Reservation;
use footplate_core::track::{Layout, Position, TurnoutStates};
use footplate_core::{EdgeId, Length, StretchId};
use serde::Serialize;

/// A part of an edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Span {
    edge: u16,
    from_mm: f64,
    to_mm: f64,
}

impl Span {
    /// From one offset to another.
    pub(crate) fn new(edge: EdgeId, from: Length, to: Length) -> Self {
        let tenth = |length: Length| (length.as_mm() * 10.0).round() / 10.0;
        Self { edge: edge.0, from_mm: tenth(from), to_mm: tenth(to) }
    }
}

/// The most edges that are drawn for one item: more than a lap of any layout in use.
const MAX_EDGES: usize = 200;

/// The spans of a reservation.
pub(super) fn reserved_spans(reservation: &Reservation) -> Vec<Span> {
    // A stretch counts its offsets from the start of its first edge.
    let first = |stretch: StretchId| EdgeId(2 * stretch.0);
    reservation.spans().map(|(stretch, span)| Span::new(first(stretch), span.from, span.to)).collect()
}

/// The track from `behind` before a place to `ahead` beyond it, by the turnout positions; it ends with the track.
pub(super) fn spans(
    layout: &Layout,
    turnouts: &TurnoutStates,
    at: Position,
    behind: Length,
    ahead: Length,
) -> Vec<Span> {
    let mut found = Vec::new();
    // Backwards is forwards from the reversed position.
    if let Some(back) = layout.reversed(at) {
        for (edge, [from, to]) in covered(layout, turnouts, back, behind) {
            if let Some(whole) = layout.edge(edge) {
                found.push(Span::new(edge.twin(), whole.length - to, whole.length - from));
            }
        }
        found.reverse();
    }
    found.extend(
        covered(layout, turnouts, at, ahead).into_iter().map(|(edge, [from, to])| Span::new(edge, from, to)),
    );
    found
}

fn covered(
    layout: &Layout,
    turnouts: &TurnoutStates,
    at: Position,
    length: Length,
) -> Vec<(EdgeId, [Length; 2])> {
    let (mut at, mut left) = (at, length);
    let mut found = Vec::new();
    while left > Length::ZERO && found.len() < MAX_EDGES {
        let Some(edge) = layout.edge(at.edge) else { break };
        let to = (at.offset + left).min(edge.length);
        found.push((at.edge, [at.offset, to]));
        // Beyond this edge only a rounding error would be left.
        if to < edge.length {
            break;
        }
        left -= to - at.offset;
        let end = Position { edge: at.edge, offset: edge.length };
        match layout.advance(end, Length::ZERO, turnouts) {
            Ok(next) if next.edge != at.edge => at = next,
            _ => break,
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use footplate_core::track::Leg;
    use footplate_store::layout_named;

    use super::*;

    #[test]
    fn the_spans_of_a_length_are_as_long() {
        let layout = layout_named("track-a").expect("built in").layout;
        let turnouts: TurnoutStates =
            layout.turnouts().map(|(turnout, _)| (turnout, Leg::Straight)).collect();
        let (id, edge) = layout.edges().find(|(_, edge)| edge.length.as_mm() > 200.0).expect("a long one");
        let at = Position { edge: id, offset: edge.length / 2.0 };
        let (behind, ahead) = (Length::from_mm(450.0), Length::from_mm(330.0));
        let found = spans(&layout, &turnouts, at, behind, ahead);
        let sum: f64 = found.iter().map(|span| span.to_mm - span.from_mm).sum();
        assert!((sum - 780.0).abs() < 1.0, "{sum}");
        assert!(found.iter().any(|span| span.edge == id.0));
        // The last span is never an empty one on another edge, whatever the rounding.
        for mm in 0..400 {
            let at = Position { edge: id, offset: Length::from_mm(0.1 * f64::from(mm)) };
            let found = spans(&layout, &turnouts, at, behind, Length::from_mm(20.3));
            let last = found.last().expect("a span");
            assert!(last.to_mm > last.from_mm, "{mm}: {found:?}");
        }
    }
}
