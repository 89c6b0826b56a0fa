//! Known turnout positions, and the positions that a path needs.

use alloc::collections::BTreeSet;
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
    /// The leg for the flag that events and command stations use.
    #[inline]
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

/// A turnout on a path, and the leg that the path uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TurnoutNeed {
    /// The turnout.
    pub turnout: TurnoutId,
    /// The leg on which the path leaves or enters it.
    pub leg: Leg,
    /// Whether the train approaches it at its toe (facing), so that it decides the path. Otherwise the train trails it,
    /// coming from the leg: it passes in either position if the points are sprung (as Märklin's are), but derails or
    /// does damage elsewhere.
    pub facing: bool,
}

/// The position of each turnout whose position is known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TurnoutStates {
    /// By the turnout's number; turnouts beyond the end are unknown.
    legs: Vec<Option<Leg>>,
    /// Those that a train has faced and passed as they lie since they were set: they did move when they were commanded.
    #[cfg_attr(feature = "serde", serde(skip))]
    proven: BTreeSet<TurnoutId>,
}

impl TurnoutStates {
    /// No position is known: every path is open.
    pub const fn unknown() -> Self {
        Self { legs: Vec::new(), proven: BTreeSet::new() }
    }

    /// Sets the position of a turnout. Allocates if its number is the highest so far.
    pub fn set(&mut self, turnout: TurnoutId, leg: Leg) {
        if self.get(turnout) != Some(leg) {
            self.proven.remove(&turnout);
        }
        let slot = usize::from(turnout.0);
        if self.legs.len() <= slot {
            self.legs.resize(slot + 1, None);
        }
        if let Some(known) = self.legs.get_mut(slot) {
            *known = Some(leg);
        }
    }

    /// Forgets the position of a turnout, because its command was lost or a train ran through it.
    pub fn forget(&mut self, turnout: TurnoutId) {
        self.proven.remove(&turnout);
        if let Some(known) = self.legs.get_mut(usize::from(turnout.0)) {
            *known = None;
        }
    }

    /// The position of a turnout, or `None` while it is unknown.
    #[inline]
    pub fn get(&self, turnout: TurnoutId) -> Option<Leg> {
        self.legs.get(usize::from(turnout.0)).copied().flatten()
    }

    /// A train was detected where the present position of a turnout that it faced had led it.
    pub fn prove(&mut self, turnout: TurnoutId) {
        self.proven.insert(turnout);
    }

    /// Whether a train has shown the position of a turnout since it was set.
    pub fn is_proven(&self, turnout: TurnoutId) -> bool {
        self.proven.contains(&turnout)
    }

    /// Whether a train can pass the turnout as `need` requires: always if it trails the turnout; if it faces it, only
    /// if the position is right or unknown.
    #[inline]
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
        assert!(states.allow(need(Leg::Straight, false)), "a train that trails the turnout moves the points");

        states.prove(TurnoutId(6));
        states.set(TurnoutId(6), Leg::Curved);
        assert!(states.is_proven(TurnoutId(6)), "it lay there already");
        states.set(TurnoutId(6), Leg::Straight);
        assert!(!states.is_proven(TurnoutId(6)), "it may not have moved");

        states.forget(TurnoutId(6));
        assert_eq!(states.get(TurnoutId(6)), None);
        assert_eq!(states.get(TurnoutId(u16::MAX)), None);
    }
}
