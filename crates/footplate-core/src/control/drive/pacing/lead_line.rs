//! Where a train was, is and will be, on the map of one that comes after it.
//!
//! Both trains pass the same contacts. Where the one ahead was at a time that is past follows from when it came by the
//! contacts about that place, whatever either train feels of the way between them; only what it has not come to yet is
//! foreseen, from the steps that it was told.

use alloc::vec::Vec;

use crate::control::drive::driven_train::DrivenTrain;
use crate::ids::NodeId;
use crate::model::MotionModel;
use crate::time::Timestamp;
use crate::tracking::{Rollout, TrackContext};
use crate::units::Length;

use super::surveyed_path::{SurveyedPath, surveyed_distance};

/// Half of the time (s) over which a speed is taken: two places of one line that far apart say it to a few mm/s.
const SPEED_SPAN: f64 = 0.15;

/// The line of a train.
pub(super) struct LeadLine<'a> {
    /// When it came by contacts (s from now), and where those are (surveyed m from the contact that the train behind it
    /// passed last).
    marks: Vec<[f64; 2]>,
    /// Where it goes from there: from the last of them, or from where it was put.
    rollout: Rollout,
    begins: f64,
    way: SurveyedPath,
    model: &'a MotionModel,
    /// Now, on the clock of the rollout.
    now: f64,
}

impl<'a> LeadLine<'a> {
    /// The line of `leader` for a train that passed the contact at `from` last and is so far (surveyed m) past it; `None` if
    /// nobody knows it.
    pub(super) fn of(
        context: TrackContext<'_>,
        leader: &'a DrivenTrain,
        now: Timestamp,
        (from, past): (NodeId, f64),
    ) -> Option<Self> {
        let rollout = leader.locator.rollout()?;
        let way = SurveyedPath::ahead(context, &leader.model, rollout.node());
        let zero = rollout.seconds(now);
        let mut here = rollout;
        let since = way.surveyed(here.place(&leader.model, zero));
        let mut begins = ahead_of(context, from, rollout.node())?;
        // It may have come by the contact without a report, and be less than a round ahead.
        if let Some(round) = surveyed_distance(context, from, from).map(Length::as_m)
            && begins + since - round > past
        {
            begins -= round;
        }
        let mut marks: Vec<[f64; 2]> = Vec::new();
        let (mut surveyed, mut next) = (begins, rollout.node());
        for (node, time) in leader.passages.iter().rev() {
            if node != next {
                surveyed -= surveyed_distance(context, node, next)?.as_m();
            }
            next = node;
            marks.push([(time - now).as_s(), surveyed]);
            // What is behind the train that comes after it is over.
            if surveyed <= 0.0 {
                break;
            }
        }
        marks.reverse();
        Some(Self { marks, rollout, begins, way, model: &leader.model, now: zero })
    }

    /// Where it is at a time (s from now).
    pub(super) fn place(&self, time: f64) -> f64 {
        let next = self.marks.partition_point(|[at, _]| *at <= time);
        let pair = match (next.checked_sub(1).and_then(|at| self.marks.get(at)), self.marks.get(next)) {
            (Some(from), Some(to)) => Some([*from, *to]),
            // Before the first of them it ran as it did behind it.
            (None, Some(first)) => self.marks.get(1).map(|second| [*first, *second]),
            (Some(_) | None, None) => None,
        };
        if let Some([[at, from], [until, to]]) = pair
            && until > at
        {
            return from + (to - from) * (time - at) / (until - at);
        }
        let mut rollout = self.rollout;
        let since = self.way.surveyed(rollout.place(self.model, self.now + time));
        self.begins + since
    }

    /// How fast it is there (m/s).
    pub(super) fn speed(&self, time: f64) -> f64 {
        (self.place(time + SPEED_SPAN) - self.place(time - SPEED_SPAN)) / (2.0 * SPEED_SPAN)
    }
}

/// The surveyed way (m) from a contact to one ahead of it, which may be itself.
fn ahead_of(context: TrackContext<'_>, from: NodeId, to: NodeId) -> Option<f64> {
    if from == to { Some(0.0) } else { surveyed_distance(context, from, to).map(Length::as_m) }
}
