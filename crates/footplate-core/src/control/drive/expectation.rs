//! What should happen next to a train that runs, and what follows when it does not.

use crate::ids::{NodeId, SensorId, SpeedStep};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{TrackContext, WayPoint};
use crate::units::{Length, Ratio};

use super::command_time::{CommandTime, command_time};
use super::driven_train::{DrivenTrain, Expectation};
use super::order::Aim;
use super::outputs::Outputs;
use super::path_length::track_end;
use super::refusal::Refusal;
use super::task::Phase;
use crate::control::Notice;

/// A contact is overdue this long after the last of 99.7 % of cases.
const OVERDUE: TimeSpan = TimeSpan::from_ms(500);
/// The contact behind one that was silent is late this long after the last of 99.7 % of cases: two polls of all modules. Who
/// follows the train waits no longer.
const LATE: TimeSpan = TimeSpan::from_ms(250);
/// Contacts that stay silent in a row until the train is lost: two are missed one after the other once in 100 000 times,
/// and trains are stuck, derailed or lifted ten times as often.
const MOST_SILENT: u8 = 2;
/// And however far the next one is, when at least this long has passed, or twice the way there.
const LOST: TimeSpan = TimeSpan::from_s(10.0);
/// Where nobody knows which contact comes next, it is lost after this long: the longest way of the known tracks between
/// two contacts, 1.5 m, at a crawl.
const LOST_WITHOUT: TimeSpan = TimeSpan::from_s(40.0);
/// What of a train is ahead of its pickup, and a little: this much of the track is left before its end.
const BEFORE_END: Length = Length::from_mm(200.0);
/// How often a train that is stopped for the end of the track may come nearer than that, or pass its limit.
const NEARER: Ratio = Ratio::from_percent(0.1);

impl DrivenTrain {
    /// A contact that should have reported it long ago: it may never have come there.
    pub(super) const fn unseen(&self) -> Option<SensorId> {
        self.expected.unseen
    }

    /// Whether one contact was silent, and the next is not late.
    pub(super) fn missed_just_one(&self, now: Timestamp) -> bool {
        let Expectation { due, overdue_said, silent, .. } = self.expected;
        let by = due.map(|due| due.time + TimeSpan::from_s(3.0 * due.uncertainty.as_s()) + LATE);
        match silent {
            // Passed for certain, and not overdue yet.
            0 => true,
            1 => !overdue_said && by.is_some_and(|by| now < by),
            _ => false,
        }
    }

    /// The next contact and when it is due.
    pub(super) fn due(&self) -> Option<(SensorId, Timestamp)> {
        self.expected.due.map(|due| (due.sensor, due.time))
    }

    /// Looks ahead to the next contact, to the end of the track and to the limit.
    pub(super) fn expect_next(&mut self, context: TrackContext<'_>, now: Timestamp) {
        let due = self.locator.next_contact(context, &self.model, now);
        let end = self.end_of_track(context, now);
        let limit = self.limit.and_then(|limit| self.last_stop_before(context, now, limit));
        self.look_at_zones(context, now);
        // What was missed is not forgotten because something was commanded.
        self.expected = Expectation { due, since: now, overdue_said: false, end, limit, ..self.expected };
    }

    /// Looks at another limit, and at nothing else.
    pub(super) fn expect_limit(&mut self, context: TrackContext<'_>, now: Timestamp) {
        self.expected.limit = self.limit.and_then(|limit| self.last_stop_before(context, now, limit));
    }

    /// The same after a command to it. A contact that it should have come by already stays due: who is told something
    /// else every other second must not be lost for that without anybody noticing.
    pub(super) fn expect_on(&mut self, context: TrackContext<'_>, now: Timestamp) {
        let before = self.expected;
        self.expect_next(context, now);
        if self.commanded == SpeedStep::STAND {
            // Each run is judged by its own contacts; that one was silent stays known.
            self.expected.silent = 0;
            self.expected.lost_by = None;
        } else if let (Some(due), Some(next)) = (before.due, self.expected.due)
            && (due.sensor != next.sensor || before.overdue_said)
        {
            let Expectation { due, since, overdue_said, .. } = before;
            self.expected = Expectation { due, since, overdue_said, ..self.expected };
        }
    }

    /// It was seen where it can be.
    pub(super) const fn seen(&mut self) {
        self.expected.unseen = None;
        self.expected.silent = 0;
        self.expected.lost_by = None;
    }

    /// When a contact that does not come is overdue, and after that when the train is lost.
    pub(super) fn next_doubt(&self) -> Option<Timestamp> {
        // Nothing is expected of a train that has not heard yet that it should move.
        if self.commanded == SpeedStep::STAND || !self.is_told() {
            return None;
        }
        let Expectation { due, since, overdue_said, .. } = self.expected;
        let Some(due) = due else {
            return self.locator.is_located().then_some(since + LOST_WITHOUT);
        };
        let latest = due.time + TimeSpan::from_s(3.0 * due.uncertainty.as_s());
        let overdue = (!overdue_said).then_some(latest + OVERDUE);
        overdue.into_iter().chain(self.expected.lost_by).min()
    }

    pub(super) fn doubt(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        if self.next_doubt().is_none_or(|at| now < at) {
            return;
        }
        let is_over = self.expected.lost_by.is_some_and(|by| by <= now);
        match self.expected.due {
            Some(due) if !self.expected.overdue_said && !is_over => {
                out.say(Notice::Overdue { train: self.id(), sensor: due.sensor, by: now - due.time });
                let way = due.time - self.expected.since;
                self.expected.lost_by.get_or_insert(now + LOST.max(way + way));
                self.expected.unseen.get_or_insert(due.sensor);
                self.expected.silent = self.expected.silent.saturating_add(1);
                if self.expected.silent >= MOST_SILENT {
                    return self.lose(now, out);
                }
                let next = self.locator.next_contact(context, &self.model, now);
                // The one behind it is waited for now; where none is known only the clock ends the wait.
                let next = next.filter(|next| next.sensor != due.sensor);
                self.expected.overdue_said = next.is_none();
                self.expected.since = now;
                self.expected.due = next.or(self.expected.due);
            }
            _ => self.lose(now, out),
        }
    }

    /// Nobody knows any more where the train is.
    fn lose(&mut self, now: Timestamp, out: &mut Outputs) {
        self.locator.lose();
        self.passages.forget();
        self.expected = Expectation { since: now, ..Expectation::default() };
        let train = self.id();
        out.say(Notice::Lost { train });
        self.give_up(now, Refusal::Lost { train }, out);
    }

    /// When the train has to be commanded to stop so that it stays on the track and within its limit, whatever is reported
    /// until then.
    pub(super) fn guard(&self) -> Option<Timestamp> {
        [self.end_guard(), self.limit_guard()].into_iter().flatten().min()
    }

    /// Whoever has a plan stops before the end of the track.
    fn end_guard(&self) -> Option<Timestamp> {
        let has_plan = matches!(self.task.map(|task| task.phase), Some(Phase::Running { plan: Some(_) }));
        let (leaves, _) = self.expected.end.filter(|_| self.commanded > SpeedStep::STAND && !has_plan)?;
        Some(leaves - self.link.command)
    }

    /// A limit is kept whatever is planned: plans aim at the middle of what may be, and limits at its edge.
    fn limit_guard(&self) -> Option<Timestamp> {
        let leaves = self.expected.limit.filter(|_| self.commanded > SpeedStep::STAND)?;
        Some(leaves - self.link.command)
    }

    /// Stops the train where the track ends ahead of it, or what it may enter.
    pub(super) fn keep_on_track(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        let train = self.id();
        if self.limit_guard().is_some_and(|at| at <= now) {
            self.expected.limit = None;
            out.say(Notice::AuthorityEnds { train });
            self.give_up(now, Refusal::AtLimit { train }, out);
        }
        if let (Some(at), Some((_, end))) = (self.end_guard(), self.expected.end)
            && at <= now
        {
            self.expected.end = None;
            let name = context.layout.node_name(end).into();
            out.say(Notice::TrackEnds { train, end });
            self.give_up(now, Refusal::TrackEnds { train, end: name }, out);
        }
    }

    fn end_of_track(&self, context: TrackContext<'_>, now: Timestamp) -> Option<(Timestamp, NodeId)> {
        let located = self.located(context, now).filter(|_| self.commanded > SpeedStep::STAND)?;
        let (end, way) = track_end(context, &self.model, located.at.node)?;
        let at = WayPoint { node: located.at.node, way: way - BEFORE_END };
        Some((self.last_stop_before(context, now, at)?, end))
    }

    /// The latest time at which a command to stop may leave so that the train comes to rest before a point, but for one
    /// time in [`NEARER`]; the earliest that can still be kept where even that is too late; `None` while it does not
    /// come so far.
    pub(super) fn last_stop_before(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        at: WayPoint,
    ) -> Option<Timestamp> {
        if self.commanded == SpeedStep::STAND {
            return None;
        }
        let earliest = now + self.link.command;
        let found = command_time(earliest, |leaves| {
            let rest = self.locator.rest_if_stopped(context, &self.model, leaves)?;
            Some((rest, self.aimed_beyond(context, &rest, at, Aim::NotBeyond(NEARER))?))
        });
        match found {
            CommandTime::At(leaves, _) => Some(leaves),
            CommandTime::TooLate(..) => Some(earliest),
            CommandTime::Never => None,
        }
    }
}
