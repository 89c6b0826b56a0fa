//! One trip: from standstill to standstill, with its commands and the sensors passed.

use alloc::vec::Vec;

use super::course::Course;
use crate::ids::{NodeId, SensorId};
use crate::model::parameters::Answers;
use crate::model::segment::{Segment, SpeedCommand};
use crate::model::stop_offset::StopEffect;

/// A sensor passed, and the path to it from the sensor before, or from the origin of the trip's distances.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct TripDetection {
    /// Its node.
    pub(super) node: NodeId,
    /// The sensor; `None` in what version 6 of the model wrote.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) sensor: Option<SensorId>,
    /// Mean time of the detection (s, on the run's clock) and its variance.
    pub(super) time: f64,
    pub(super) variance: f64,
    /// Surveyed length of the path (m) and its sections.
    #[cfg_attr(feature = "serde", serde(rename = "way"))]
    pub(super) length: f64,
    pub(super) sections: Vec<usize>,
}

/// An edge on the path of a train: where it begins and ends, counted from the sensor passed last before the place of rest (m).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct PassedEdge {
    pub(super) edge: usize,
    pub(super) begins: f64,
    pub(super) ends: f64,
}

impl PassedEdge {
    /// The part of a stop's effect that comes from it, with the place of rest counted from the same sensor.
    pub(super) fn part_of(&self, effect: StopEffect, rest: f64) -> f64 {
        effect.between(rest - self.begins, rest - self.ends)
    }
}

/// A tape measurement of where the train came to rest: a distance beyond one of the trip's sensors.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MeasuredRest {
    /// How many of the trip's sensors lie up to the one from which it counts.
    #[cfg_attr(feature = "serde", serde(rename = "contacts"))]
    pub(super) detections: usize,
    /// Distance beyond that sensor (m), by tape and survey.
    pub(super) beyond: f64,
    /// Sections between that sensor and the one from which the tape was laid.
    pub(super) sections: Vec<usize>,
}

/// A trip of one train.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Trip {
    /// Step and approach of a train that was running steadily at its first entry; `None` from standstill.
    pub(super) running: Option<(u8, bool)>,
    /// Whether it begins where the trip before it ended.
    pub(super) continues: bool,
    /// When it begins (s).
    pub(super) begins: f64,
    #[cfg_attr(feature = "serde", serde(rename = "told"))]
    pub(super) commanded: Vec<SpeedCommand>,
    #[cfg_attr(feature = "serde", serde(rename = "contacts"))]
    pub(super) detections: Vec<TripDetection>,
    /// When pieces of a constant deviation of speed begin (s).
    #[cfg_attr(feature = "serde", serde(with = "super::bits"))]
    pub(super) pieces: Vec<f64>,
    /// Whether the train braked to rest undisturbed.
    pub(super) came_to_rest: bool,
    /// The edges that its stop ran over, known from the next trip.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub(super) stop_edges: Vec<PassedEdge>,
    /// Where it came to rest, if that was measured with a tape.
    pub(super) measured: Option<MeasuredRest>,
    /// Its own numbers by the last fit.
    pub(super) own: Option<Own>,
}

/// A piece of a trip over which the deviation of the speed counts as constant, at most this long (s): trains wander over
/// a lap, not over a hop.
const LONGEST_PIECE: f64 = 4.0;

/// A trip's own numbers: where it began (m beyond the sensor passed last before), late start (s), deviations of ln
/// speed by piece, and additional distance of changes (m).
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Own {
    pub(super) place: f64,
    pub(super) late_start: f64,
    pub(super) deviations: Vec<f64>,
    pub(super) changes: Vec<f64>,
}

impl Own {
    /// How many numbers there are, without the place.
    pub(super) const fn count(&self) -> usize {
        1 + self.deviations.len() + self.changes.len()
    }

    /// All of them in the order of their columns, the place first.
    pub(super) fn flat(&self) -> Vec<f64> {
        let mut all = alloc::vec![self.place, self.late_start];
        all.extend(&self.deviations);
        all.extend(&self.changes);
        all
    }

    /// Each number together with another's.
    pub(super) fn with(&self, other: &Self, of: impl Fn(&f64, &f64) -> f64) -> Self {
        let all =
            |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(one, other)| of(one, other)).collect();
        Self {
            place: of(&self.place, &other.place),
            late_start: of(&self.late_start, &other.late_start),
            deviations: all(&self.deviations, &other.deviations),
            changes: all(&self.changes, &other.changes),
        }
    }
}

impl Trip {
    pub(super) fn new(begins: f64, running: Option<(u8, bool)>, continues: bool) -> Self {
        Self {
            running,
            continues,
            begins,
            commanded: Vec::new(),
            detections: Vec::new(),
            pieces: alloc::vec![f64::NEG_INFINITY],
            came_to_rest: false,
            stop_edges: Vec::new(),
            measured: None,
            own: None,
        }
    }

    /// The same motion from an unknown place, with no sensor passed yet.
    pub(super) fn at_another_place(&self) -> Self {
        Self {
            commanded: self.commanded.clone(),
            pieces: self.pieces.clone(),
            ..Self::new(self.begins, self.running, false)
        }
    }

    pub(super) fn command(&mut self, commanded: SpeedCommand) {
        self.commanded.push(commanded);
        if self.commanded.len() > 1 {
            self.pieces.push(commanded.sent);
        }
    }

    pub(super) fn pass(&mut self, detection: TripDetection) {
        let since = self.pieces.last().copied().unwrap_or(f64::NEG_INFINITY).max(self.begins);
        if detection.time > since + LONGEST_PIECE {
            self.pieces.push(detection.time);
        }
        self.detections.push(detection);
    }

    /// The step from which the speed of a segment comes: of a stop, the one before.
    pub(super) fn step_of(&self, segment: usize) -> u8 {
        let commanded = segment.checked_sub(1).and_then(|place| self.commanded.get(place));
        commanded.map_or(self.running.map_or(0, |(step, _)| step), |commanded| {
            if commanded.to == 0 { commanded.from } else { commanded.to }
        })
    }

    /// Its own numbers by the last fit; for what happened since, the usual ones.
    pub(super) fn start(&self) -> Own {
        let mut own = self.own.clone().unwrap_or_default();
        let deviation = own.deviations.last().copied().unwrap_or(0.0);
        own.deviations.resize(self.pieces.len(), deviation);
        own.changes.resize(self.commanded.len(), 0.0);
        own
    }

    /// When the train rests, if it was commanded to stop last (s).
    pub(super) fn rests_at(&self, answers: &Answers<'_>) -> f64 {
        self.last_segment(answers).filter(|last| last.to == 0.0).map_or(f64::INFINITY, |last| last.settled())
    }

    /// When the last change of speed is complete (s).
    pub(super) fn settles_at(&self, answers: &Answers<'_>) -> f64 {
        if self.commanded.is_empty() {
            return self.begins;
        }
        self.last_segment(answers).map_or(f64::INFINITY, |last| last.settled())
    }

    /// Where the train comes to rest by its stop, counted from the sensor passed last (m), and how it stops.
    pub(super) fn stop(&self, answers: &Answers<'_>) -> Option<(f64, StopEffect)> {
        let (own, mut segments) = (self.start(), Vec::new());
        self.segments(answers, &own, &mut segments);
        let last = segments.last().filter(|last| last.is_stop())?;
        let effect = StopEffect { speed: last.from.speed, distance: last.distance_to_rest() };
        let outcome = Course::new(self, &segments).outcome(&own);
        Some((outcome.rest - outcome.at.last().copied().unwrap_or(-own.place), effect))
    }

    fn last_segment(&self, answers: &Answers<'_>) -> Option<Segment> {
        let mut segments = Vec::new();
        self.segments(answers, &self.start(), &mut segments);
        segments.pop()
    }

    /// The changes of speed one after the other, the state before the first command included.
    pub(super) fn segments(&self, answers: &Answers<'_>, own: &Own, segments: &mut Vec<Segment>) {
        segments.clear();
        let speed = self.running.map_or(0.0, |(step, above)| answers.speed(usize::from(step), above));
        let mut last = Segment::steady(self.begins, speed);
        segments.push(last);
        for commanded in &self.commanded {
            let mut effect = commanded.effect(answers);
            if commanded.at_rest {
                effect += own.late_start;
            }
            let effect = effect.max(last.begins);
            let mut next = Segment::of(commanded, answers, last.pace(effect));
            next.begins = effect;
            segments.push(next);
            last = next;
        }
    }
}
