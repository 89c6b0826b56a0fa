//! The true positions of turnouts, which move with a delay and fail sometimes.

use footplate_core::track::{Layout, Leg};
use footplate_core::{Ratio, TimeSpan, Timestamp, TurnoutId};

use crate::draws::Draws;

/// From the solenoid's being powered until the points have moved, in s (as the brief of course reports: the 150 ms
/// that programs wait are mostly enough, not always).
const THROW_S: core::ops::Range<f64> = 0.1..0.3;
/// The shortest pulse that throws a turnout (Märklin: a tenth of a second at least).
const SHORTEST_PULSE: TimeSpan = TimeSpan::from_ms(95);

/// One turnout.
#[derive(Debug, Clone, Copy)]
struct Turnout {
    lies: Leg,
    /// The leg to which its points are moving, and when they arrive.
    moving: Option<(Leg, Timestamp)>,
    powered_at: Timestamp,
    is_burnt: bool,
}

/// All turnouts of a layout.
#[derive(Debug, Clone)]
pub(crate) struct Points {
    by_number: Vec<Option<Turnout>>,
    failure: Ratio,
    draws: Draws,
    next: Option<Timestamp>,
}

impl Points {
    /// Turnouts in random positions, but never both curved in a double slip.
    pub(crate) fn draw(layout: &Layout, failure: Ratio, mut draws: Draws) -> Self {
        let mut points = Self { by_number: Vec::new(), failure, draws: draws.split(), next: None };
        for (turnout, _) in layout.turnouts() {
            points.lay(turnout, Leg::from_curved(draws.chance(0.5)));
        }
        for [_, second] in layout.never_both_curved() {
            points.lay(*second, Leg::Straight);
        }
        points
    }

    /// Throws a turnout by hand.
    pub(crate) fn lay(&mut self, turnout: TurnoutId, leg: Leg) {
        let slot = usize::from(turnout.0);
        if self.by_number.len() <= slot {
            self.by_number.resize(slot + 1, None);
        }
        let powered_at = Timestamp::ZERO;
        self.by_number[slot] = Some(Turnout { lies: leg, moving: None, powered_at, is_burnt: false });
    }

    /// How a turnout lies.
    pub(crate) fn lies(&self, turnout: TurnoutId) -> Option<Leg> {
        Some(self.by_number.get(usize::from(turnout.0))?.as_ref()?.lies)
    }

    /// Powers its solenoid.
    pub(crate) fn power(&mut self, turnout: TurnoutId, leg: Leg, now: Timestamp) {
        let Some(Some(found)) = self.by_number.get_mut(usize::from(turnout.0)) else { return };
        let obeys = !self.draws.chance(self.failure.as_parts()) && !found.is_burnt;
        let takes = self.draws.uniform(THROW_S);
        // What it does not obey leaves an earlier movement going on.
        if obeys {
            found.powered_at = now;
            found.moving = (found.lies != leg).then_some((leg, now + TimeSpan::from_s(takes)));
        }
        self.look_ahead();
    }

    /// Ends the pulse of its solenoid.
    pub(crate) fn release(&mut self, turnout: TurnoutId, now: Timestamp) {
        let Some(Some(found)) = self.by_number.get_mut(usize::from(turnout.0)) else { return };
        if now - found.powered_at < SHORTEST_PULSE {
            found.moving = None;
            self.look_ahead();
        }
    }

    /// Burns its solenoid.
    pub(crate) fn burn(&mut self, turnout: TurnoutId) {
        if let Some(Some(found)) = self.by_number.get_mut(usize::from(turnout.0)) {
            found.is_burnt = true;
            found.moving = None;
        }
        self.look_ahead();
    }

    /// Replaces burnt solenoids; returns their turnouts.
    pub(crate) fn replace_coils(&mut self) -> Vec<TurnoutId> {
        let mut replaced = Vec::new();
        for (number, turnout) in self.by_number.iter_mut().enumerate() {
            if let Some(found) = turnout.as_mut().filter(|found| found.is_burnt) {
                found.is_burnt = false;
                replaced.push(TurnoutId(number as u16));
            }
        }
        replaced
    }

    /// The time at which the next points arrive.
    pub(crate) const fn next(&self) -> Option<Timestamp> {
        self.next
    }

    /// The next turnout whose points have arrived by a time; call until `None`.
    pub(crate) fn moved(&mut self, by: Timestamp) -> Option<TurnoutId> {
        let is_due = |turnout: &Turnout| turnout.moving.is_some_and(|(_, at)| at <= by);
        let number = self.by_number.iter().position(|turnout| turnout.as_ref().is_some_and(is_due))?;
        if let Some(Some(turnout)) = self.by_number.get_mut(number)
            && let Some((leg, _)) = turnout.moving.take()
        {
            turnout.lies = leg;
        }
        self.look_ahead();
        Some(TurnoutId(number as u16))
    }

    fn look_ahead(&mut self) {
        let times = self.by_number.iter().flatten().filter_map(|turnout| turnout.moving);
        self.next = times.map(|(_, at)| at).min();
    }
}
