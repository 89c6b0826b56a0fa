//! One trip: from standstill to standstill, with the commands that made it and the contacts passed.

use alloc::vec::Vec;

use super::parameters::Answers;
use super::segment::{Segment, Told};

/// A contact passed, and the way there from the one before (or from where the trip's ways are counted).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct TripContact {
    /// Mean time at which it closed (s, on the clock of the run) and the variance of that.
    pub(super) time: f64,
    pub(super) variance: f64,
    /// Way by the survey (m) and the sections on it.
    pub(super) way: f64,
    pub(super) sections: Vec<usize>,
}

/// A trip of one train.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Trip {
    /// Step and approach of a train that was running steadily when it was first seen; `None` from standstill.
    pub(super) running: Option<(u8, bool)>,
    /// Whether it begins where the trip before it ended.
    pub(super) continues: bool,
    /// When it begins (s).
    pub(super) begins: f64,
    pub(super) told: Vec<Told>,
    pub(super) contacts: Vec<TripContact>,
    /// When pieces of a constant deviation of speed begin (s).
    #[cfg_attr(feature = "serde", serde(with = "super::bits"))]
    pub(super) pieces: Vec<f64>,
    /// Whether it ended at rest by the train's own law.
    pub(super) came_to_rest: bool,
}

/// A piece of a trip over which the deviation of the speed counts as constant, at most this long (s): trains wander over
/// a lap, not over a hop.
const LONGEST_PIECE: f64 = 4.0;

/// What a trip has of its own: late start (s), deviations of ln speed by piece, and additional way of changes (m).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Own {
    pub(super) late_start: f64,
    pub(super) deviations: Vec<f64>,
    pub(super) changes: Vec<f64>,
}

impl Trip {
    pub(super) fn new(begins: f64, running: Option<(u8, bool)>, continues: bool) -> Self {
        Self {
            running,
            continues,
            begins,
            told: Vec::new(),
            contacts: Vec::new(),
            pieces: alloc::vec![f64::NEG_INFINITY],
            came_to_rest: false,
        }
    }

    pub(super) fn tell(&mut self, told: Told) {
        self.told.push(told);
        if self.told.len() > 1 {
            self.pieces.push(told.sent);
        }
    }

    pub(super) fn pass(&mut self, contact: TripContact) {
        let since = self.pieces.last().copied().unwrap_or(f64::NEG_INFINITY).max(self.begins);
        if contact.time > since + LONGEST_PIECE {
            self.pieces.push(contact.time);
        }
        self.contacts.push(contact);
    }

    /// When the train rests, if it was told to stop last (s).
    pub(super) fn rests_at(&self, answers: &Answers<'_>) -> f64 {
        let own = Own {
            late_start: 0.0,
            deviations: alloc::vec![0.0; self.pieces.len()],
            changes: alloc::vec![0.0; self.told.len()],
        };
        let mut segments = Vec::new();
        self.segments(answers, &own, &mut segments);
        segments.last().filter(|last| last.to == 0.0).map_or(f64::INFINITY, Segment::settled)
    }

    /// The changes of speed one after the other, the state before the first command included.
    pub(super) fn segments(&self, answers: &Answers<'_>, own: &Own, segments: &mut Vec<Segment>) {
        segments.clear();
        let speed = self.running.map_or(0.0, |(step, above)| answers.speed(usize::from(step), above));
        let mut last = Segment::steady(self.begins, speed);
        segments.push(last);
        for told in &self.told {
            let mut effect = told.effect(answers);
            if told.at_rest {
                effect += own.late_start;
            }
            let effect = effect.max(last.begins);
            let mut next = Segment::of(told, answers, last.pace(effect));
            next.begins = effect;
            segments.push(next);
            last = next;
        }
    }
}

/// The way of a trip as a function of time, for times that rise.
#[derive(Debug)]
pub(super) struct Walk<'t> {
    trip: &'t Trip,
    own: &'t Own,
    segments: &'t [Segment],
    segment: usize,
    /// Way without deviations at the beginning of the segment.
    base: f64,
    piece: usize,
    /// Way without deviations and with them at the beginning of the piece.
    piece_base: f64,
    done: f64,
}

impl<'t> Walk<'t> {
    pub(super) const fn new(trip: &'t Trip, own: &'t Own, segments: &'t [Segment]) -> Self {
        Self { trip, own, segments, segment: 0, base: 0.0, piece: 0, piece_base: 0.0, done: 0.0 }
    }

    fn deviation(&self) -> f64 {
        libm::exp(self.own.deviations.get(self.piece).copied().unwrap_or(0.0))
    }

    /// Way without deviations; moves on to the segment of that time.
    fn plain(&mut self, time: f64) -> f64 {
        while let (Some(now), Some(next)) =
            (self.segments.get(self.segment), self.segments.get(self.segment + 1))
            && next.begins <= time
        {
            self.base += now.way(next.begins);
            self.segment += 1;
        }
        self.base + self.segments.get(self.segment).map_or(0.0, |segment| segment.way(time))
    }

    /// Way (m) from where the trip began, at a time (s) that is not before the last asked for.
    pub(super) fn way(&mut self, time: f64) -> f64 {
        while let Some(next) = self.trip.pieces.get(self.piece + 1).copied()
            && next <= time
        {
            let plain = self.plain(next);
            self.done += self.deviation() * (plain - self.piece_base);
            self.piece_base = plain;
            self.piece += 1;
        }
        let plain = self.plain(time);
        self.done + self.deviation() * (plain - self.piece_base) + self.added(time)
    }

    /// The additional way of changes as far as they are done.
    fn added(&self, time: f64) -> f64 {
        let changes = self.segments.iter().skip(1).zip(&self.own.changes);
        changes.filter(|(_, by)| **by != 0.0).map(|(segment, by)| by * segment.share(time)).sum()
    }

    /// Way to standstill, when the last segment is a stop.
    pub(super) fn way_to_rest(mut self) -> f64 {
        let Some(last) = self.segments.last() else { return 0.0 };
        let begins = last.begins;
        let start = self.way(begins);
        while self.piece + 1 < self.trip.pieces.len() {
            self.piece += 1;
        }
        let added: f64 = self.own.changes.iter().sum::<f64>() - self.added(begins);
        start + self.deviation() * last.way_to_rest() + added
    }

    /// Speed (m/s) at the time last asked for, or later.
    pub(super) fn speed(&self, time: f64) -> f64 {
        self.deviation() * self.segments.get(self.segment).map_or(0.0, |segment| segment.speed(time))
    }

    /// Whether the change under way ends at rest.
    pub(super) fn is_stopping(&self) -> bool {
        self.segments.get(self.segment).is_some_and(Segment::is_stop)
    }

    /// How much of the change under way is neither begun nor done (0 to 1, most at its middle), and its displacement (m).
    pub(super) fn in_change(&self, time: f64) -> (f64, f64) {
        self.segments.get(self.segment).map_or((0.0, 0.0), |segment| {
            let share = segment.share(time);
            (4.0 * share * (1.0 - share), segment.displacement())
        })
    }
}
