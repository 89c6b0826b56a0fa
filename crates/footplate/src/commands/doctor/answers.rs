//! How soon a station answers: requests whose answers differ from all other messages, and those that stayed without one.

use std::io::Write;

use footplate_core::link::RoundTrips;
use footplate_core::{TimeSpan, Timestamp};

use super::figures::{histogram, line, quantiles};
use crate::commands::plot::{Ink, Layer, Panel, Picture, Shape, shares};

/// No session repeats a request sooner (Z21: after 100 ms).
const REPEATED_SOONEST: TimeSpan = TimeSpan::from_ms(100);

/// Requests by their kinds, as they pass.
pub(super) struct Waiting<K> {
    waiting: Vec<(K, Timestamp)>,
    answers: Answers,
}

/// The times to answers.
#[derive(Default)]
pub(super) struct Answers {
    /// In ms, sorted.
    times: Vec<f64>,
    asked: usize,
    lost: usize,
}

impl<K: PartialEq> Default for Waiting<K> {
    fn default() -> Self {
        Self { waiting: Vec::new(), answers: Answers::default() }
    }
}

impl<K: PartialEq> Waiting<K> {
    /// A request was written.
    pub(super) fn asked(&mut self, kind: K, at: Timestamp) {
        let is_asked = |(other, since): &(K, Timestamp)| *other == kind && at - *since < REPEATED_SOONEST;
        if self.waiting.iter().any(is_asked) {
            // Two requests whose answers look alike, such as a sign of life and a command.
            return;
        }
        self.answers.asked += 1;
        // A request is repeated before its answer only if the answer is missing.
        let before = self.waiting.len();
        self.waiting.retain(|(other, _)| *other != kind);
        self.answers.lost += before - self.waiting.len();
        self.waiting.push((kind, at));
    }

    /// A message was heard that answers requests of a kind.
    pub(super) fn answered(&mut self, kind: &K, at: Timestamp) {
        if let Some(place) = self.waiting.iter().position(|(other, _)| other == kind) {
            let (_, since) = self.waiting.remove(place);
            self.answers.times.push((at - since).as_ms());
        }
    }

    /// Returns the times to answers.
    pub(super) fn finish(mut self) -> Answers {
        self.answers.times.sort_by(f64::total_cmp);
        self.answers
    }
}

impl Answers {
    /// The share of requests that were not answered.
    pub(super) fn lost_share(&self) -> f64 {
        self.lost as f64 / self.asked.max(1) as f64
    }

    /// Returns the measured line; `None` with too few answers.
    pub(super) fn round_trips(&self) -> Option<RoundTrips> {
        let times: Vec<TimeSpan> = self.times.iter().map(|ms| TimeSpan::from_s(ms / 1e3)).collect();
        RoundTrips::of(&times, u32::try_from(self.lost).unwrap_or(u32::MAX))
    }

    /// Adds its figures to those of a station.
    pub(super) fn add_to(&self, json: &mut serde_json::Value) {
        json["requests"] = self.asked.into();
        json["lost_answers"] = self.lost.into();
        json["answer_ms"] = quantiles(&self.times);
    }

    pub(super) fn write(&self, output: &mut dyn Write) -> std::io::Result<()> {
        writeln!(output, "requests      {}, {} without an answer", self.asked, self.lost)?;
        line(output, "answers", &self.times)?;
        histogram(output, &self.times)
    }

    /// How the times are spread.
    pub(super) fn picture(&self) -> Picture {
        let curve = Shape::Line(shares(self.times.iter().copied()));
        let layers = (!self.times.is_empty()).then(|| Layer::new("answer", Ink::First, curve));
        let panel = Panel {
            x: "at most (ms)".to_owned(),
            y: "share (%)".to_owned(),
            from_zero: true,
            layers: layers.into_iter().collect(),
            ..Panel::default()
        };
        Picture {
            title: "How soon the station answers".to_owned(),
            subtitle: format!("{} requests, {} without an answer", self.asked, self.lost),
            panels: vec![panel],
        }
    }
}

/// Sensors by their numbers on the station, and what they reported.
#[derive(Default)]
pub(super) struct Sensors {
    occupied: std::collections::BTreeMap<u16, bool>,
    reports: usize,
}

impl Sensors {
    /// Notes a sensor's state; a change from free to occupied counts as a report.
    pub(super) fn heard(&mut self, number: u16, is_occupied: bool) {
        let before = self.is(number, is_occupied);
        self.reported(before == Some(false) && is_occupied);
    }

    /// Notes a sensor's state; returns the state before.
    pub(super) fn is(&mut self, number: u16, is_occupied: bool) -> Option<bool> {
        self.occupied.insert(number, is_occupied)
    }

    /// Counts a report of a sensor that became occupied.
    pub(super) fn reported(&mut self, is_report: bool) {
        self.reports += usize::from(is_report);
    }

    /// Returns the number of sensors, of occupied ones, and of reports.
    pub(super) fn counts(&self) -> [usize; 3] {
        let occupied = self.occupied.values().filter(|occupied| **occupied).count();
        [self.occupied.len(), occupied, self.reports]
    }

    /// Adds its figures to those of a station.
    pub(super) fn add_to(&self, json: &mut serde_json::Value) {
        let [count, occupied, reports] = self.counts();
        json["sensors"] = count.into();
        json["occupied"] = occupied.into();
        json["reports"] = reports.into();
    }
}

/// How much could not be read, if anything.
pub(super) fn noise(unread: usize) -> Option<String> {
    (unread > 0).then(|| format!("noise         {unread} bytes could not be read"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_lost_when_it_is_repeated_and_not_when_another_looks_like_it() {
        let at = |ms| Timestamp::ZERO + TimeSpan::from_ms(ms);
        let mut waiting = Waiting::default();
        // Slot 0 is read as a sign of life and after a command, 5 ms apart; both are answered.
        waiting.asked(0, at(0));
        waiting.asked(0, at(5));
        waiting.answered(&0, at(18));
        waiting.answered(&0, at(36));
        // One without an answer is repeated.
        waiting.asked(0, at(500));
        waiting.asked(0, at(800));
        waiting.answered(&0, at(820));
        let answers = waiting.finish();
        assert_eq!((answers.asked, answers.lost), (3, 1));
        assert_eq!(answers.times, [18.0, 20.0]);
    }
}
