//! Where a train was, is and will be, on the map of one that comes after it.
//!
//! Both trains pass the same contacts. Where the one ahead was at a time that is past follows from when it came by the
//! contacts about that place, whatever either train feels of the way between them; only what it has not come to yet is
//! foreseen, from the steps that it was told.

use alloc::vec::Vec;

use crate::calibration::motion::MotionModel;
use crate::control::drive::driven_train::DrivenTrain;
use crate::estimation::{Ground, Outlook};
use crate::ids::NodeId;
use crate::time::Timestamp;

use super::surveyed_way::{SurveyedWay, surveyed_between};

/// Half of the time (s) over which a speed is taken: two places of one line that far apart say it to a few mm/s.
const SPEED_SPAN: f64 = 0.15;

/// The line of a train.
pub(super) struct LeadLine<'a> {
    /// When it came by contacts (s from now), and where those are (surveyed m from the contact that the train behind it
    /// passed last).
    marks: Vec<[f64; 2]>,
    /// Where it goes from there: from the last of them, or from where it was put.
    outlook: Outlook,
    begins: f64,
    way: SurveyedWay,
    model: &'a MotionModel,
    /// Now, on the clock of the outlook.
    now: f64,
}

impl<'a> LeadLine<'a> {
    /// The line of `leader` for a train that passed the contact at `from` last; `None` if nobody knows it.
    pub(super) fn of(
        ground: Ground<'_>,
        leader: &'a DrivenTrain,
        now: Timestamp,
        from: NodeId,
    ) -> Option<Self> {
        let outlook = leader.locator.outlook()?;
        let passed: Vec<(NodeId, Timestamp)> = leader.passages.iter().collect();
        // It came by the same contact, or runs from one that is ahead of it.
        let first = passed.iter().rposition(|(node, _)| *node == from).unwrap_or_default();
        let mut marks: Vec<[f64; 2]> = Vec::with_capacity(passed.len());
        let (mut surveyed, mut before) = (0.0, from);
        for (node, time) in passed.get(first..).unwrap_or_default() {
            if *node != before {
                surveyed += surveyed_between(ground, before, *node)?.as_m();
            }
            before = *node;
            marks.push([(*time - now).as_s(), surveyed]);
        }
        if outlook.node() != before {
            surveyed += surveyed_between(ground, before, outlook.node())?.as_m();
        }
        let way = SurveyedWay::ahead(ground, &leader.model, outlook.node());
        let now = outlook.seconds(now);
        Some(Self { marks, outlook, begins: surveyed, way, model: &leader.model, now })
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
        let mut outlook = self.outlook;
        let since = self.way.of_felt(outlook.place(self.model, self.now + time));
        self.begins + since
    }

    /// How fast it is there (m/s).
    pub(super) fn speed(&self, time: f64) -> f64 {
        (self.place(time + SPEED_SPAN) - self.place(time - SPEED_SPAN)) / (2.0 * SPEED_SPAN)
    }
}
