//! Reservations of other trains, as a path search sees them.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::ids::{EdgeId, StretchId, TurnoutId};
use crate::track::Layout;
use crate::units::Length;

use super::reservation::{Reservation, Span, turnouts_near};

/// Track that is closed, or costs time to wait.
#[derive(Debug, Clone, Default)]
pub(super) struct Obstacles {
    /// Intervals, each with its cost in seconds; infinite where it is closed.
    spans: BTreeMap<StretchId, Vec<(Span, f64)>>,
    turnouts: BTreeMap<TurnoutId, f64>,
}

impl Obstacles {
    /// Adds a reservation, with a cost in seconds for each stretch and turnout.
    pub(super) fn add(&mut self, held: &Reservation, seconds: f64) {
        for (stretch, span) in held.spans() {
            self.spans.entry(stretch).or_default().push((span, seconds));
        }
        for turnout in held.turnouts() {
            let known = self.turnouts.entry(turnout).or_default();
            *known = known.max(seconds);
        }
    }

    /// The cost of running over part of an edge, in seconds; `None` where it is closed.
    pub(super) fn cost(&self, layout: &Layout, id: EdgeId, from: Length, to: Length) -> Option<f64> {
        let mut cost = 0.0;
        if let Some(spans) = self.spans.get(&id.stretch()) {
            let span = Span::on(layout, id, from, to)?;
            let met = spans.iter().filter(|(held, _)| held.from <= span.to && span.from <= held.to);
            cost += met.map(|(_, seconds)| *seconds).sum::<f64>();
        }
        for turnout in turnouts_near(layout, id, from, to) {
            cost += self.turnouts.get(&turnout).copied().unwrap_or_default();
        }
        cost.is_finite().then_some(cost)
    }
}
