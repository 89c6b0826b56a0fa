//! The run of a trip, as far as its own numbers do not change it.
#![expect(clippy::indexing_slicing, reason = "moments and pieces are counted when the vectors are made")]

use alloc::vec::Vec;

use super::trip::{Own, Trip};
use crate::model::segment::Segment;

/// Distances without deviations at the times that count: where pieces begin, where sensors were passed, where the last change
/// begins. The trip's own numbers multiply and add; that needs no exponential of a law.
#[derive(Debug)]
pub(super) struct Course<'s> {
    segments: &'s [Segment],
    /// How many pieces the trip has.
    pieces: usize,
    /// Distance without deviations where pieces begin, from the second piece on, as far as the moments reach.
    begins: Vec<f64>,
    /// The sensors passed in the order of their times, then the beginning of the last change.
    moments: Vec<Moment>,
    /// How much of each change is done at each moment, moment after moment.
    shares: Vec<f64>,
}

#[derive(Debug)]
struct Moment {
    time: f64,
    segment: usize,
    piece: usize,
    /// Distance without deviations.
    plain: f64,
}

/// A trip simulated with some numbers: distance (m) at each sensor, and at rest.
#[derive(Debug)]
pub(super) struct Outcome {
    pub(super) at: Vec<f64>,
    pub(super) rest: f64,
}

impl<'s> Course<'s> {
    pub(super) fn new(trip: &Trip, segments: &'s [Segment]) -> Self {
        let mut plain = Plain { segments, segment: 0, base: 0.0 };
        let last = segments.last().map_or(trip.begins, |last| last.begins);
        let times = trip.detections.iter().map(|detection| detection.time).chain([last]);
        let (mut begins, mut moments) = (Vec::new(), Vec::with_capacity(trip.detections.len() + 1));
        let mut shares = Vec::with_capacity((trip.detections.len() + 1) * trip.commanded.len());
        for time in times {
            while let Some(next) = trip.pieces.get(begins.len() + 1).filter(|next| **next <= time) {
                begins.push(plain.distance(*next));
            }
            let distance = plain.distance(time);
            moments.push(Moment { time, segment: plain.segment, piece: begins.len(), plain: distance });
            shares.extend(segments.iter().skip(1).map(|change| change.share(time)));
        }
        Self { segments, pieces: trip.pieces.len(), begins, moments, shares }
    }

    /// The changes of speed, the state before the first command included.
    pub(super) const fn segments(&self) -> &'s [Segment] {
        self.segments
    }

    /// Where the trip's own numbers lead.
    pub(super) fn outcome(&self, own: &Own) -> Outcome {
        let factors: Vec<f64> = own.deviations.iter().map(|deviation| libm::exp(*deviation)).collect();
        let factor = |piece: usize| factors.get(piece).copied().unwrap_or(1.0);
        let (mut piece, mut begin, mut done) = (0, 0.0, 0.0);
        let mut at = Vec::with_capacity(self.moments.len());
        for (nth, moment) in self.moments.iter().enumerate() {
            while piece < moment.piece {
                done += factor(piece) * (self.begins[piece] - begin);
                begin = self.begins[piece];
                piece += 1;
            }
            at.push(done + factor(piece) * (moment.plain - begin) + self.added(nth, own));
        }
        let last_change = self.moments.len() - 1;
        let start = at.pop().unwrap_or(0.0);
        let added: f64 = own.changes.iter().sum::<f64>() - self.added(last_change, own);
        let to_rest = self.segments.last().map_or(0.0, Segment::distance_to_rest);
        Outcome { at, rest: start + factor(self.pieces.max(piece + 1) - 1) * to_rest + added }
    }

    /// The additional distance of changes, as far as they are done at a moment.
    fn added(&self, moment: usize, own: &Own) -> f64 {
        let changes = self.segments.len().saturating_sub(1);
        let shares = &self.shares[moment * changes..(moment + 1) * changes];
        shares.iter().zip(&own.changes).filter(|(_, by)| **by != 0.0).map(|(share, by)| by * share).sum()
    }

    /// The train at each sensor passed.
    pub(super) fn passages(&self, own: &Own) -> impl Iterator<Item = Passage<'s>> {
        let (segments, deviations) = (self.segments, &own.deviations);
        let sensors = self.moments.split_last().map_or(&[][..], |(_, sensors)| sensors);
        sensors.iter().filter_map(move |moment| {
            let segment = segments.get(moment.segment)?;
            let deviation = libm::exp(deviations.get(moment.piece).copied().unwrap_or(0.0));
            Some(Passage { nth: moment.segment, segment, time: moment.time, deviation })
        })
    }
}

/// A train at a sensor.
#[derive(Debug)]
pub(super) struct Passage<'s> {
    /// The place of its segment among those of the trip.
    pub(super) nth: usize,
    /// The change of speed that it is in or has behind it.
    pub(super) segment: &'s Segment,
    time: f64,
    deviation: f64,
}

impl Passage<'_> {
    /// Speed (m/s).
    pub(super) fn speed(&self) -> f64 {
        self.deviation * self.segment.speed(self.time)
    }

    /// How much of the present change is neither begun nor done (0 to 1, most at its middle).
    pub(super) fn in_change(&self) -> f64 {
        let share = self.segment.share(self.time);
        4.0 * share * (1.0 - share)
    }
}

/// The distance without deviations, for rising times.
struct Plain<'s> {
    segments: &'s [Segment],
    segment: usize,
    /// Distance at the beginning of the segment.
    base: f64,
}

impl Plain<'_> {
    /// Distance (m) at a time (s); moves on to its segment.
    fn distance(&mut self, time: f64) -> f64 {
        while let (Some(now), Some(next)) =
            (self.segments.get(self.segment), self.segments.get(self.segment + 1))
            && next.begins <= time
        {
            self.base += now.distance(next.begins);
            self.segment += 1;
        }
        self.base + self.segments.get(self.segment).map_or(0.0, |segment| segment.distance(time))
    }
}
