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
        let mut begins = ahead_of(context, from, rollout.node())?;
        // The leader may have been missed there and be less than a lap ahead.
        if let Some(lap) = surveyed_distance(context, from, from).map(Length::as_m)
            && begins + since - lap > past
        {
            begins -= lap;
        }
        let mut marks: Vec<[f64; 2]> = Vec::new();
        let (mut surveyed, mut next) = (begins, rollout.node());
        for (node, time) in leader.passages.iter().rev() {
            if node != next {
                surveyed -= surveyed_distance(context, node, next)?.as_m();
            }
            next = node;
            marks.push([(time - now).as_s(), surveyed]);
            // Detections behind the follower no longer matter.
            if surveyed <= 0.0 {
                break;
            }
        }
        marks.reverse();
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

/// Detections kept: enough for the last train of a chain, ten seconds of the densest known track, twice over.
const MAX_PASSAGES: usize = 40;

/// The sensors that a train passed last, oldest first, each with the most likely time, from its report and the
/// train's motion.
#[derive(Debug, Clone, Default)]
pub(in crate::control::drive) struct Passages(VecDeque<(NodeId, Timestamp)>);

impl Passages {
    /// Adds a passage.
    pub(in crate::control::drive) fn note(&mut self, node: NodeId, time: Timestamp) {
        if self.0.len() >= MAX_PASSAGES {
            self.0.pop_front();
        }
        self.0.push_back((node, time));
    }

    /// Drops the passages from a time on: they are noted again as they were.
    pub(in crate::control::drive) fn forget_from(&mut self, time: Timestamp) {
        self.0.retain(|(_, passed)| *passed < time);
    }

    /// Clears the record: the train is elsewhere.
    pub(in crate::control::drive) fn forget(&mut self) {
        self.0.clear();
    }

    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = (NodeId, Timestamp)> + '_ {
        self.0.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
