//! One life of the program: its steps, and the step at which it dies.

use std::cell::Cell;

use footplate_core::{TimeSpan, Timestamp};

/// How a life of the program ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Death {
    /// SIGKILL, or out of memory.
    Killed,
    /// It hangs for good.
    Hangs,
    /// Its guardian is killed.
    GuardianKilled,
    /// Its guardian hangs for good.
    GuardianHangs,
    /// The computer loses its power: the program, its guardian, and what the disk had not written.
    PowerCut(TimeSpan),
}

/// State that the parts of a life share. A step is an action that is visible outside: a write, a wait, a recorded entry.
#[derive(Debug)]
pub(super) struct Life {
    steps: Cell<u64>,
    ends: Cell<Option<(u64, Death)>>,
    died: Cell<Option<Death>>,
    /// Whether the program has no guardian any more, and ends.
    is_orphan: Cell<bool>,
}

impl Life {
    /// A life that ends at a step, if it reaches it.
    pub(super) const fn new(ends: Option<(u64, Death)>) -> Self {
        Self {
            steps: Cell::new(0),
            ends: Cell::new(ends),
            died: Cell::new(None),
            is_orphan: Cell::new(false),
        }
    }

    /// Counts a step before it is taken. Returns whether the program is still alive to take it.
    pub(super) fn step(&self) -> bool {
        let step = self.steps.get() + 1;
        self.steps.set(step);
        if let Some((_, death)) = self.ends.get().filter(|(at, _)| *at == step) {
            self.died.set(Some(death));
        }
        !self.is_over()
    }

    /// The program begins to end in order, and dies so many steps later.
    pub(super) fn ends_during_farewell(&self, (steps, death): (u64, Death)) {
        self.ends.set(Some((self.steps.get() + steps, death)));
    }

    /// Whether the program is dead. One whose guardian fails still stops its trains.
    pub(super) fn is_over(&self) -> bool {
        !matches!(self.died.get(), None | Some(Death::GuardianKilled | Death::GuardianHangs))
    }

    /// Ends it from outside: the guardian kills a program that hangs.
    pub(super) fn end(&self, death: Death) {
        self.died.set(Some(death));
    }

    pub(super) fn orphan(&self) {
        self.is_orphan.set(true);
    }

    pub(super) fn is_orphan(&self) -> bool {
        self.is_orphan.get()
    }

    pub(super) fn death(&self) -> Option<Death> {
        self.died.get()
    }

    pub(super) fn steps(&self) -> u64 {
        self.steps.get()
    }
}

/// A span of time in which something fails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spell {
    pub(super) from: Timestamp,
    pub(super) until: Timestamp,
}

impl Spell {
    pub(super) fn covers(&self, now: Timestamp) -> bool {
        (self.from..self.until).contains(&now)
    }
}

/// How much of the time from one time to another no spell covers.
pub(super) fn time_outside(from: Timestamp, until: Timestamp, mut spells: Vec<Spell>) -> TimeSpan {
    spells.sort_by_key(|spell| spell.from);
    let (mut since, mut outside) = (from, TimeSpan::ZERO);
    for spell in spells {
        outside += (spell.from.min(until) - since).max(TimeSpan::ZERO);
        since = since.max(spell.until);
    }
    outside + (until - since).max(TimeSpan::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_without_a_spell_is_added_up() {
        let s = |s: f64| Timestamp::from_s(s);
        let spell = |from: f64, until: f64| Spell { from: s(from), until: s(until) };
        let between = |spells: &[Spell]| time_outside(s(10.0), s(20.0), spells.to_vec()).as_s();
        assert_eq!(between(&[]), 10.0);
        assert_eq!(between(&[spell(8.0, 12.0)]), 8.0);
        assert_eq!(between(&[spell(13.0, 18.5), spell(12.0, 19.0)]), 3.0);
        assert_eq!(between(&[spell(15.0, 16.0), spell(11.0, 12.0)]), 8.0);
        assert_eq!(between(&[spell(1.0, 2.0), spell(30.0, 40.0)]), 10.0);
        assert_eq!(between(&[spell(9.0, 21.0)]), 0.0);
    }
}
