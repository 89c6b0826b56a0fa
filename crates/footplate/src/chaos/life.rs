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
    /// The computer loses its power: the program, its guardian, and what the disk had not written.
    PowerCut(TimeSpan),
}

/// What the parts of a life share. A step is whatever the world outside can see: bytes written, a wait, an entry recorded.
#[derive(Debug)]
pub(super) struct Life {
    steps: Cell<u64>,
    ends: Option<(u64, Death)>,
    died: Cell<Option<Death>>,
    /// Whether the program has found that its guardian is dead, and wants to end.
    is_orphan: Cell<bool>,
}

impl Life {
    /// A life that ends at a step, if it comes so far.
    pub(super) const fn new(ends: Option<(u64, Death)>) -> Self {
        Self { steps: Cell::new(0), ends, died: Cell::new(None), is_orphan: Cell::new(false) }
    }

    /// The program is about to do something that can be seen outside. Returns whether it still does.
    pub(super) fn step(&self) -> bool {
        let step = self.steps.get() + 1;
        self.steps.set(step);
        if let Some((_, death)) = self.ends.filter(|(at, _)| *at == step) {
            self.died.set(Some(death));
        }
        !self.is_over()
    }

    /// Whether the program does nothing any more. One whose guardian was killed still stops its trains.
    pub(super) fn is_over(&self) -> bool {
        !matches!(self.died.get(), None | Some(Death::GuardianKilled))
    }

    /// Ends it from outside: its guardian found that it hangs.
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
