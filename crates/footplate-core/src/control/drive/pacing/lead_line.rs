//! Where a train was, is and will be, on the map of its follower.
//!
//! Both trains pass the same sensors. The leader's past positions follow from its detections, in surveyed lengths,
//! whatever either train's path length between them. Only its future is predicted, from its commanded steps.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use crate::control::drive::driven_train::DrivenTrain;
use crate::ids::NodeId;
use crate::model::MotionModel;
use crate::time::Timestamp;
use crate::tracking::{Rollout, TrackContext};
use crate::units::Length;

use super::reference::{SurveyedPath, surveyed_distance};

/// Half of the time (s) over which a speed is measured: two points of one line that far apart give it to a few mm/s.
const SPEED_SPAN: f64 = 0.15;

/// The motion of a leader.
pub(super) struct LeadLine<'a> {
    /// Its detections: time (s from now) and place (surveyed m past the last sensor of the follower).
    marks: Vec<[f64; 2]>,
    /// Its predicted motion from the last of them, or from where it was placed.
    rollout: Rollout,
    begins: f64,
    path: SurveyedPath,
    model: &'a MotionModel,
    /// Now, on the clock of the rollout.
    now: f64,
}

impl<'a> LeadLine<'a> {
    /// The motion of `leader` for a follower that is `past` (surveyed m) beyond its last sensor `from`; `None` if the
    /// leader's position is unknown.
    pub(super) fn of(
        context: TrackContext<'_>,
        leader: &'a DrivenTrain,
        now: Timestamp,
        (from, past): (NodeId, f64),
    ) -> Option<Self> {
        let rollout = leader.locator.rollout()?;
        let path = SurveyedPath::ahead(context, &leader.model, rollout.node());
        let zero = rollout.seconds(now);
        let mut here = rollout;
        let since = path.surveyed(here.place(&leader.model, zero));
        let lap = surveyed_distance(context, from, from).map(Length::as_m);
        let is_only = context.hops_ahead(from).next().is_some_and(|hop| hop.to == from);
        let begins = within_a_lap([ahead_of(context, from, rollout.node())?, since, past], lap, is_only);
        let between = |from, to| surveyed_distance(context, from, to).map(Length::as_m);
        let passages = leader.passages.iter().rev().map(|(node, time)| (node, (time - now).as_s()));
        let marks = marks(passages, (rollout.node(), begins), between)?;
        Some(Self { marks, rollout, begins, path, model: &leader.model, now: zero })
    }

    /// Its place at a time (s from now).
    pub(super) fn place(&self, time: f64) -> f64 {
        let next = self.marks.partition_point(|[at, _]| *at <= time);
        let pair = match (next.checked_sub(1).and_then(|at| self.marks.get(at)), self.marks.get(next)) {
            (Some(from), Some(to)) => Some([*from, *to]),
            // Extrapolate from the first two detections.
            (None, Some(first)) => self.marks.get(1).map(|second| [*first, *second]),
            (Some(_) | None, None) => None,
        };
        if let Some([[at, from], [until, to]]) = pair
            && until > at
        {
            return from + (to - from) * (time - at) / (until - at);
        }
        let mut rollout = self.rollout;
        let since = self.path.surveyed(rollout.place(self.model, self.now + time));
        self.begins + since
    }

    /// Its speed at that time (m/s).
    pub(super) fn speed(&self, time: f64) -> f64 {
        (self.place(time + SPEED_SPAN) - self.place(time - SPEED_SPAN)) / (2.0 * SPEED_SPAN)
    }
}

/// The surveyed distance (m) from a sensor to one ahead, zero to itself.
fn ahead_of(context: TrackContext<'_>, from: NodeId, to: NodeId) -> Option<f64> {
    if from == to { Some(0.0) } else { surveyed_distance(context, from, to).map(Length::as_m) }
}

/// Where a leader passed its last sensor (m past the follower's last sensor), such that it is ahead of the follower, by less
/// than a lap if it was missed.
///
/// `begins` is the distance from the follower's last sensor to the leader's, zero if they are the same; `since` is how far the
/// leader has run from there, and `past` the follower. `is_only` is whether the circuit has no other sensor.
fn within_a_lap([begins, since, past]: [f64; 3], lap: Option<f64>, is_only: bool) -> f64 {
    let Some(lap) = lap else { return begins };
    // The leader may have been missed there and be less than a lap ahead.
    if begins + since - lap > past {
        return begins - lap;
    }
    // Once in every lap the leader has passed the only sensor again and the follower has not. With several, the last sensor of
    // both is the same only if the leader passed it first: a leader estimated behind its follower has stalled.
    if is_only && begins + since < past { begins + lap } else { begins }
}

/// The detections of a leader, oldest first: time (s from now) and place.
///
/// `passages` are the sensors and times, newest first; `last` is where its motion is predicted from, and `between` the distance
/// from one sensor to the next passage of another. `None` if no path connects two of them.
fn marks(
    passages: impl Iterator<Item = (NodeId, f64)>,
    last: (NodeId, f64),
    between: impl Fn(NodeId, NodeId) -> Option<f64>,
) -> Option<Vec<[f64; 2]>> {
    let mut marks: Vec<[f64; 2]> = Vec::new();
    let (mut next, mut surveyed) = last;
    for (nth, (node, time)) in passages.enumerate() {
        // The newest is usually the sensor that the motion is predicted from. Before that, the same sensor is a lap away.
        if nth > 0 || node != next {
            surveyed -= between(node, next)?;
        }
        next = node;
        marks.push([time, surveyed]);
        // Detections behind the follower no longer matter.
        if surveyed <= 0.0 {
            break;
        }
    }
    marks.reverse();
    Some(marks)
}

/// Detections kept: enough for the last train of a chain, ten seconds of the densest known track, twice over.
const MAX_PASSAGES: usize = 40;

/// The sensors that a train passed last, oldest first, each with the most likely time, from its report and the
/// train's motion.
#[derive(Debug, Clone, Default)]
pub(in crate::control::drive) struct Passages {
    passed: VecDeque<(NodeId, Timestamp)>,
    /// Whether it has been commanded to set out from rest since the last of them.
    has_set_out: bool,
}

impl Passages {
    /// Adds a passage.
    pub(in crate::control::drive) fn note(&mut self, node: NodeId, time: Timestamp) {
        if self.passed.len() >= MAX_PASSAGES {
            self.passed.pop_front();
        }
        self.passed.push_back((node, time));
        self.has_set_out = false;
    }

    /// The train sets out from rest.
    pub(super) const fn set_out(&mut self) {
        self.has_set_out = true;
    }

    /// Whether it may still stand where it was commanded to set out: no sensor has reported it since.
    pub(in crate::control::drive) const fn may_not_have_started(&self) -> bool {
        self.has_set_out
    }

    /// Drops the passages from a time on: they are noted again as they were.
    pub(in crate::control::drive) fn forget_from(&mut self, time: Timestamp) {
        self.passed.retain(|(_, passed)| *passed < time);
    }

    /// Clears the record: the train is elsewhere.
    pub(in crate::control::drive) fn forget(&mut self) {
        self.passed.clear();
    }

    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = (NodeId, Timestamp)> + '_ {
        self.passed.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;

    /// The lap of a circuit with one sensor, or of one with two that are half a lap apart (m).
    const LAP: f64 = 3.0;

    #[test]
    fn each_passage_of_the_only_sensor_is_a_lap_after_the_one_before() {
        let only = NodeId(1);
        let passages = [(only, -2.0), (only, -12.0), (only, -22.0)].into_iter();
        let marks = marks(passages, (only, LAP), |_, _| Some(LAP));
        assert_eq!(marks, Some(vec![[-12.0, 0.0], [-2.0, LAP]]), "up to the follower's last sensor");
    }

    #[test]
    fn passages_of_several_sensors_are_as_far_apart_as_surveyed() {
        let [one, other] = [NodeId(1), NodeId(2)];
        let passages = [(other, -1.0), (one, -6.0), (other, -11.0)].into_iter();
        let between = |from, to| Some(if from == to { LAP } else { 0.5 * LAP });
        let found = marks(passages, (other, 0.5 * LAP), between);
        assert_eq!(found, Some(vec![[-6.0, 0.0], [-1.0, 0.5 * LAP]]));
    }

    #[test]
    fn a_leader_that_passed_the_same_sensor_is_ahead_of_its_follower() {
        // It passed first and is 1 m past it, its follower 0.4 m.
        assert_eq!(within_a_lap([0.0, 1.0, 0.4], Some(LAP), true), 0.0);
        // It passed the only sensor again, and its follower not yet.
        assert_eq!(within_a_lap([0.0, 0.2, 2.4], Some(LAP), true), LAP);
        // There are more sensors: it stalled, and its follower was estimated to pass it.
        assert_eq!(within_a_lap([0.0, 0.2, 0.4], Some(LAP), false), 0.0);
        // It was missed there: it is 0.6 m past it in the next lap.
        assert_eq!(within_a_lap([0.0, LAP + 0.6, 0.1], Some(LAP), true), -LAP);
        // The track is no circuit.
        assert_eq!(within_a_lap([0.0, 0.2, 0.4], None, false), 0.0);
    }

    #[test]
    fn a_train_that_set_out_may_still_stand_until_a_sensor_reports_it() {
        let mut passages = Passages::default();
        passages.note(NodeId(1), Timestamp::from_s(10.0));
        assert!(!passages.may_not_have_started());
        passages.set_out();
        assert!(passages.may_not_have_started());
        passages.note(NodeId(2), Timestamp::from_s(12.0));
        assert!(!passages.may_not_have_started());
    }

    #[test]
    fn a_spurious_passage_leaves_the_record_and_earlier_ones_stay() {
        let mut passages = Passages::default();
        for (node, seconds) in [(1, 10.0), (2, 12.0), (3, 13.5)] {
            passages.note(NodeId(node), Timestamp::from_s(seconds));
        }
        passages.forget_from(Timestamp::from_s(11.8));
        assert_eq!(passages.iter().collect::<Vec<_>>(), [(NodeId(1), Timestamp::from_s(10.0))]);
    }
}
