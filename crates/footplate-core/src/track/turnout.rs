//! How turnouts lie, as far as anybody knows, and how a train needs them to lie.

use alloc::vec::Vec;
use core::fmt;

use crate::ids::TurnoutId;

/// One of the two legs of a turnout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Leg {
    /// The leg that goes straight on.
    Straight,
    /// The diverging leg.
    Curved,
}

impl Leg {
    /// The leg named by the flag that events and command stations use.
    #[inline]
    #[must_use]
    pub const fn from_curved(curved: bool) -> Self {
        if curved { Self::Curved } else { Self::Straight }
    }

    /// Whether it is the diverging leg.
    #[inline]
    #[must_use]
    pub const fn is_curved(self) -> bool {
        matches!(self, Self::Curved)
    }
}

impl fmt::Display for Leg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Straight => "straight",
            Self::Curved => "curved",
        })
    }
}

/// A turnout on a path, and the leg by which the path runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TurnoutNeed {
    /// The turnout.
    pub turnout: TurnoutId,
    /// The leg by which the way leaves or enters it.
    pub leg: Leg,
    /// Whether it is met at its toe, so that it decides where the train goes. Otherwise the train comes from
    /// the leg: it gets through however the turnout lies where points give way (as Märklin's do), but it
    /// derails or does harm elsewhere.
    pub facing: bool,
}

/// The leg for which each turnout lies, for those of which it is known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TurnoutStates {
    /// By the turnout's number; what lies beyond the end is unknown.
    legs: Vec<Option<Leg>>,
}

impl TurnoutStates {
    /// Nothing is known: every way is open.
    #[must_use]
    pub const fn unknown() -> Self {
        Self { legs: Vec::new() }
    }

    /// Remembers for which leg a turnout lies. Allocates when a number is higher than any before it.
    pub fn set(&mut self, turnout: TurnoutId, leg: Leg) {
        let slot = usize::from(turnout.0);
        if self.legs.len() <= slot {
            self.legs.resize(slot + 1, None);
        }
        if let Some(known) = self.legs.get_mut(slot) {
            *known = Some(leg);
        }
    }

    /// Forgets how a turnout lies, because a command to it was lost or a train ran through it.
    pub fn forget(&mut self, turnout: TurnoutId) {
        if let Some(known) = self.legs.get_mut(usize::from(turnout.0)) {
            *known = None;
        }
    }

    /// The leg for which a turnout lies, or `None` while that is unknown.
    #[inline]
    #[must_use]
    pub fn get(&self, turnout: TurnoutId) -> Option<Leg> {
        self.legs.get(usize::from(turnout.0)).copied().flatten()
    }

    /// Whether a train gets past the turnout as `need` says: always when it comes from a leg, and when the
    /// turnout lies right or may lie right when it comes from the toe.
    #[inline]
    #[must_use]
    pub fn allow(&self, need: TurnoutNeed) -> bool {
        !need.facing || self.get(need.turnout).is_none_or(|leg| leg == need.leg)
    }
}

impl FromIterator<(TurnoutId, Leg)> for TurnoutStates {
    fn from_iter<I: IntoIterator<Item = (TurnoutId, Leg)>>(known: I) -> Self {
        let mut states = Self::unknown();
        for (turnout, leg) in known {
            states.set(turnout, leg);
        }
        states
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_turnout_allows_both_legs() {
        let mut states = TurnoutStates::unknown();
        let need = |leg, facing| TurnoutNeed { turnout: TurnoutId(6), leg, facing };
        assert!(states.allow(need(Leg::Straight, true)) && states.allow(need(Leg::Curved, true)));

        states.set(TurnoutId(6), Leg::Curved);
        assert!(!states.allow(need(Leg::Straight, true)));
        assert!(states.allow(need(Leg::Curved, true)));
        assert!(states.allow(need(Leg::Straight, false)), "points give way to a train from the other leg");

        states.forget(TurnoutId(6));
        assert_eq!(states.get(TurnoutId(6)), None);
        assert_eq!(states.get(TurnoutId(u16::MAX)), None);
    }
}
