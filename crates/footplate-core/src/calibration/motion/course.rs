//! The most likely course of a train: where its laws take it from one command to the next.
//!
//! Letters: `b` place at which the segment under way began (m), `ε` deviation of ln speed of this run, `η` by how much
//! (s) the start was late, `ζ` way (m) by which the change under way differs from its law, `S(t)` way of the segment by
//! the laws, `r(t)` share of its change that is done. The train is at
//!
//! ```text
//! x(t) = b + e^ε S(t − η) + ζ r(t)
//! ```
//!
//! [`Following`](super::Following) knows beside it how sure each letter is. What commands not given yet would come to is
//! asked of a copy: cheap enough to look at thousands of ways to go on within a millisecond.
#![expect(clippy::indexing_slicing, reason = "arrays of four letters, indexed below four")]

use super::model::MotionModel;
pub(crate) use super::segment::Told;
use super::segment::{Pace, Segment};

pub(super) const B: usize = 0;
pub(super) const E: usize = 1;
pub(super) const H: usize = 2;
pub(super) const Z: usize = 3;
pub(super) const N: usize = 4;

/// Commands that can wait for their effect: more than a line carries within a start's delay.
const MOST_PENDING: usize = 6;

/// A train under way. Ways in m from an origin that the caller keeps, times in s on a clock of the caller's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Course {
    pub(super) segment: Segment,
    /// What the segment is an answer to.
    pub(super) step: u8,
    /// `b`, `ε`, `η` and `ζ`.
    pub(super) x: [f64; N],
    pending: [Option<Told>; MOST_PENDING],
}

impl Course {
    /// At rest at a place.
    pub(super) fn at_rest(time: f64, place: f64) -> Self {
        Self {
            segment: Segment::steady(time, 0.0),
            step: 0,
            x: [place, 0.0, 0.0, 0.0],
            pending: [None; MOST_PENDING],
        }
    }

    /// The step told last, whether it has taken effect or not.
    pub(crate) fn step(&self) -> u8 {
        self.pending.iter().flatten().last().map_or(self.step, |told| told.to)
    }

    /// A command leaves the line; all that took effect before has been taken in.
    pub(crate) fn tell(&mut self, sent: f64, step: u8) {
        let from = self.step();
        if from == step {
            return;
        }
        let at_rest = from == 0 && self.pending.iter().all(Option::is_none) && self.rests_at(sent);
        if let Some(slot) = self.pending.iter_mut().find(|slot| slot.is_none()) {
            *slot = Some(Told { sent, from, to: step, at_rest });
        }
    }

    /// Whether a train that was told to stop stands by a time.
    pub(crate) fn rests_at(&self, time: f64) -> bool {
        self.step == 0 && time >= self.rest_time()
    }

    pub(super) fn rest_time(&self) -> f64 {
        if self.segment.from.speed == 0.0 { self.segment.begins } else { self.segment.settled() }
    }

    /// What takes effect next, and when; `None` if nothing waits.
    pub(super) fn next_effect(&self, model: &MotionModel) -> Option<(Told, f64)> {
        let told = self.pending[0]?;
        Some((told, told.effect(&model.answers()).max(self.segment.begins)))
    }

    /// Takes all that has taken effect by a time into the state.
    pub(crate) fn settle(&mut self, model: &MotionModel, time: f64) {
        while let Some((told, begins)) = self.next_effect(model).filter(|(_, begins)| *begins <= time) {
            let until = if told.at_rest { f64::INFINITY } else { begins };
            let (way, _) = self.way_and_slope(until);
            self.begin(model, told, begins, way);
        }
    }

    /// The next segment begins, from a place: the way so far becomes its origin. Returns how fast it was there.
    pub(super) fn begin(&mut self, model: &MotionModel, told: Told, begins: f64, way: f64) -> f64 {
        self.pending.rotate_left(1);
        self.pending[MOST_PENDING - 1] = None;
        let pace = if told.at_rest { Pace::steady(0.0) } else { self.segment.pace(begins - self.x[H]) };
        self.x[B] = way;
        self.segment = Segment::of(&told, &model.answers(), pace);
        self.segment.begins = begins;
        self.step = told.to;
        for letter in [H, Z] {
            self.x[letter] = 0.0;
        }
        if told.at_rest {
            self.x[E] = 0.0;
        }
        pace.speed
    }

    /// `x(t)` and its slopes; at an infinite time the whole way of a stop.
    pub(super) fn way_and_slope(&self, time: f64) -> (f64, [f64; N]) {
        let grown = libm::exp(self.x[E]);
        if time.is_infinite() {
            let way = self.segment.way_to_rest();
            return (self.x[B] + grown * way + self.x[Z], [1.0, grown * way, 0.0, 1.0]);
        }
        let late = time - self.x[H];
        let way = if self.is_still() { 0.0 } else { self.segment.way(late) };
        let (speed, share) = (self.segment.speed(late), self.segment.share(time));
        let place = self.x[B] + grown * way + self.x[Z] * share;
        (place, [1.0, grown * way, -grown * speed, share])
    }

    pub(super) const fn is_still(&self) -> bool {
        self.segment.from.speed == 0.0 && self.segment.to == 0.0
    }

    /// Where it is (m), once all that has taken effect by then has been taken in.
    pub(crate) fn place(&self, time: f64) -> f64 {
        let is_done = self.rests_at(time) && !self.is_still();
        let grown = libm::exp(self.x[E]);
        if is_done {
            return self.x[B] + grown * self.segment.way_to_rest() + self.x[Z];
        }
        let way = if self.is_still() { 0.0 } else { self.segment.way(time - self.x[H]) };
        let change = if self.x[Z] == 0.0 { 0.0 } else { self.x[Z] * self.segment.share(time) };
        self.x[B] + grown * way + change
    }

    /// The speed (m/s) that the change under way has still to make at a time.
    pub(crate) fn unsettled(&self, time: f64) -> f64 {
        (self.segment.to - self.segment.speed(time - self.x[H])).abs()
    }

    /// How fast it is (m/s) then.
    pub(crate) fn speed(&self, time: f64) -> f64 {
        libm::exp(self.x[E]) * self.segment.speed(time - self.x[H])
    }
}
