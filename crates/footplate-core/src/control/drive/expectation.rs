//! The next detection of a running train and the end of its authority, and what follows if the detection does not come.

use crate::event::Approach;
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{Located, PathPoint, TrackContext};
use crate::units::{Length, Ratio, Speed};

use super::command_time::{CommandTime, command_time};
use super::detections::STALL_FREE_SPEED;
use super::driven_train::DrivenTrain;
use super::driver::Driver;
use super::order::Aim;
use super::outputs::Outputs;
use super::path::{recount_from, sensors_within, track_end};
use super::refusal::Refusal;
use super::task::{Expectation, TaskPhase};
use crate::control::Notice;

/// A detection is overdue this long after its 99.7 % bound.
const OVERDUE: TimeSpan = TimeSpan::from_ms(500);
/// After one missed detection, the next is late this long after its 99.7 % bound: two polls of all modules. A
/// follower is not kept waiting longer.
const LATE: TimeSpan = TimeSpan::from_ms(250);
/// After a missed detection, the train is lost after this time, or twice the predicted travel time to the next sensor
/// if that is longer.
const LOST: TimeSpan = TimeSpan::from_s(10.0);
/// Where the next sensor is unknown, the train is lost after this time: the longest hop of the known layouts, 1.5 m,
/// at creep speed.
const LOST_WITHOUT: TimeSpan = TimeSpan::from_s(40.0);
/// A train should have passed a sensor that is this many standard deviations behind its estimate. Stops end that much
/// shorter once in 44 times, sensors miss one passage in 300, and one start in 1000 stalls on dirt: of the trains
/// that such a sensor did not report, most have not reached it.
const SHOULD_HAVE_PASSED: f64 = 2.0;
/// The length kept free before the end of the track: the front of a train, ahead of its pickup, and a margin.
const BEFORE_END: Length = Length::from_mm(200.0);
/// The probability that a train stopped before the end of the track, or its end of authority, comes closer than
/// intended.
const NEARER: Ratio = Ratio::from_percent(0.1);

impl Driver {
    /// Sets the end of a train's movement authority. Whatever is ordered or reported, the driver commands a stop in
    /// time, by the clock if no sensor reports, so that the train comes to rest before it with probability 0.999.
    /// Planned stops end before it, too. After a train is placed or reversed, it may not move until another end is
    /// set. `None` removes the limit.
    pub fn set_end_of_authority(&mut self, now: Timestamp, train: TrainId, end: Option<PathPoint>) {
        let context = self.track.context();
        if let Some(train) = self.trains.get_mut(&train) {
            train.set_end_of_authority(context, now, end);
        }
        self.update_line_requests(now);
    }

    /// The end of a train's movement authority.
    pub fn end_of_authority(&self, train: TrainId) -> Option<PathPoint> {
        self.trains.get(&train)?.end_of_authority
    }
}

impl DrivenTrain {
    /// A sensor that should have reported it: it may not have got there.
    pub(super) const fn missed_sensor(&self) -> Option<SensorId> {
        self.expected.missed_sensor
    }

    /// The last sensor that it should have passed without a report.
    pub(super) fn sensor_missed_before(
        &self,
        context: TrackContext<'_>,
        located: &Located,
    ) -> Option<SensorId> {
        let passed = located.at.distance - located.uncertainty * SHOULD_HAVE_PASSED;
        sensors_within(context, &self.model, located.at.node, passed).last().map(|(sensor, _)| sensor)
    }

    /// The highest speed at which a sensor may have missed it since its last detection.
    pub(super) fn missed_at(&self, context: TrackContext<'_>, now: Timestamp) -> Speed {
        self.speed(context, now).max(self.expected.fastest)
    }

    /// The share of detections that sensors missed of it since its last one.
    pub(super) fn missed_share(&self, context: TrackContext<'_>, now: Timestamp) -> f64 {
        self.detections.missed_share(self.missed_at(context, now))
    }

    /// Whether it may have stalled on dirt since its last detection: it has set out since, or is slow, or is to be.
    fn may_stall(&self, context: TrackContext<'_>, now: Timestamp) -> bool {
        let commanded = self.model.steady_speed(self.commanded, Approach::Below);
        self.passages.may_not_have_started()
            || self.speed(context, now) < STALL_FREE_SPEED
            || commanded < STALL_FREE_SPEED
    }

    /// Whether at most one detection was missed and the next is not late.
    pub(super) fn missed_just_one(&self, now: Timestamp) -> bool {
        let Expectation { due, overdue_reported, missed_in_a_row, .. } = self.expected;
        let by = due.map(|due| due.time + TimeSpan::from_s(3.0 * due.uncertainty.as_s()) + LATE);
        match missed_in_a_row {
            // The train has passed it, and the next is not overdue yet.
            0 => true,
            1 => !overdue_reported && by.is_some_and(|by| now < by),
            _ => false,
        }
    }

    /// The next sensor and the predicted time of its detection.
    pub(super) fn due(&self) -> Option<(SensorId, Timestamp)> {
        self.expected.due.map(|due| (due.sensor, due.time))
    }

    /// Predicts the next detection and the latest stops before the end of the track and the end of authority.
    pub(super) fn expect_next(&mut self, context: TrackContext<'_>, now: Timestamp) {
        let due = self.locator.next_sensor(context, &self.model, now);
        let track_end_stop = self.track_end_stop(context, now);
        let authority_stop = self.end_of_authority.and_then(|end| self.last_stop_before(context, now, end));
        self.schedule_zone_check(context, now);
        // A command does not clear the record of missed detections.
        self.expected = Expectation {
            due,
            since: now,
            overdue_reported: false,
            track_end_stop,
            authority_stop,
            fastest: self.missed_at(context, now),
            ..self.expected
        };
    }

    /// Predicts only the latest stop before the end of authority.
    pub(super) fn update_authority_stop(&mut self, context: TrackContext<'_>, now: Timestamp) {
        self.expected.authority_stop =
            self.end_of_authority.and_then(|end| self.last_stop_before(context, now, end));
    }

    /// Predicts again after a command. A detection that is already due remains due: otherwise a train commanded every
    /// other second would never be reported lost.
    pub(super) fn expect_after_command(&mut self, context: TrackContext<'_>, now: Timestamp) {
        let before = self.expected;
        self.expect_next(context, now);
        if self.commanded == SpeedStep::STAND {
            // Each run counts its own missed detections; `missed_sensor` remains.
            self.expected.missed_in_a_row = 0;
            self.expected.lost_by = None;
        } else if let (Some(due), Some(next)) = (before.due, self.expected.due)
            && (due.sensor != next.sensor || before.overdue_reported)
        {
            let Expectation { due, since, overdue_reported, .. } = before;
            self.expected = Expectation { due, since, overdue_reported, ..self.expected };
        }
    }

    /// Whether the next detection is overdue at a sensor.
    pub(super) fn is_overdue_at(&self, sensor: SensorId, now: Timestamp) -> bool {
        self.due().is_some_and(|(due, _)| due == sensor) && self.next_overdue().is_some_and(|at| at <= now)
    }

    /// A sensor reported it where it can be.
    pub(super) const fn clear_missed(&mut self) {
        self.expected.missed_sensor = None;
        self.expected.missed_in_a_row = 0;
        self.expected.lost_by = None;
        self.expected.fastest = Speed::ZERO;
    }

    /// When the next detection is overdue, or the train is lost.
    pub(super) fn next_overdue(&self) -> Option<Timestamp> {
        // A train whose start command has not been sent yet is not expected anywhere.
        if self.commanded == SpeedStep::STAND || !self.is_all_sent() {
            return None;
        }
        let Expectation { due, since, overdue_reported, .. } = self.expected;
        let Some(due) = due else {
            return self.locator.is_located().then_some(since + LOST_WITHOUT);
        };
        let latest = due.time + TimeSpan::from_s(3.0 * due.uncertainty.as_s());
        let overdue = (!overdue_reported).then_some(latest + OVERDUE);
        overdue.into_iter().chain(self.expected.lost_by).min()
    }

    pub(super) fn check_overdue(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        if self.next_overdue().is_none_or(|at| now < at) {
            return;
        }
        let is_over = self.expected.lost_by.is_some_and(|by| by <= now);
        match self.expected.due {
            Some(due) if !self.expected.overdue_reported && !is_over => {
                out.notify(Notice::Overdue { train: self.id(), sensor: due.sensor, by: now - due.time });
                let travel = due.time - self.expected.since;
                self.expected.lost_by.get_or_insert(now + LOST.max(travel + travel));
                self.expected.missed_sensor.get_or_insert(due.sensor);
                self.expected.missed_in_a_row = self.expected.missed_in_a_row.saturating_add(1);
                let missed_at = self.missed_at(context, now);
                let may_stall = self.may_stall(context, now);
                if self.expected.missed_in_a_row >= self.detections.lost_after(missed_at, may_stall) {
                    return self.lose(now, out);
                }
                let next = self.locator.next_sensor(context, &self.model, now);
                // From now on the sensor behind the missed one is due; if none is known, only the time limit applies.
                let next = next.filter(|next| next.sensor != due.sensor);
                self.expected.overdue_reported = next.is_none();
                self.expected.since = now;
                self.expected.due = next.or(self.expected.due);
            }
            _ => self.lose(now, out),
        }
    }

    /// The next detection does not come: the block there is still occupied by the train ahead, or its detector has not released
    /// it. The one behind it is due.
    pub(super) fn expect_beyond(&mut self, context: TrackContext<'_>, now: Timestamp) {
        let Some(due) = self.expected.due else { return };
        let next = self.locator.next_sensor(context, &self.model, now);
        let next = next.filter(|next| next.sensor != due.sensor);
        self.expected.since = now;
        self.expected.overdue_reported = next.is_none();
        self.expected.due = next.or(self.expected.due);
        self.expected.lost_by.get_or_insert(now + LOST);
    }

    /// Gives up the position and the task.
    fn lose(&mut self, now: Timestamp, out: &mut Outputs) {
        self.locator.lose();
        self.passages.forget();
        self.expected = Expectation { since: now, ..Expectation::default() };
        let train = self.id();
        out.notify(Notice::Lost { train });
        self.give_up(now, Refusal::Lost { train }, out);
    }

    /// The latest time at which a stop has to be commanded, whatever is reported until then, to stay on the track and
    /// within the authority.
    pub(super) fn latest_safe_stop(&self) -> Option<Timestamp> {
        [self.track_end_stop_time(), self.authority_stop_time()].into_iter().flatten().min()
    }

    /// A planned stop already ends before the end of the track.
    fn track_end_stop_time(&self) -> Option<Timestamp> {
        let has_plan = matches!(self.task.map(|task| task.phase), Some(TaskPhase::Running { plan: Some(_) }));
        let (leaves, _) =
            self.expected.track_end_stop.filter(|_| self.commanded > SpeedStep::STAND && !has_plan)?;
        Some(leaves - self.link.command)
    }

    /// The end of authority applies to planned stops, too: a plan aims at the median, the authority at the bound.
    fn authority_stop_time(&self) -> Option<Timestamp> {
        let leaves = self.expected.authority_stop.filter(|_| self.commanded > SpeedStep::STAND)?;
        Some(leaves - self.link.command)
    }

    /// Stops a train before the end of its track or of its authority.
    pub(super) fn enforce_track_limits(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        out: &mut Outputs,
    ) {
        let train = self.id();
        if self.authority_stop_time().is_some_and(|at| at <= now) {
            self.expected.authority_stop = None;
            // A follower goes on once the trains ahead have left the track behind them.
            if !self.hold_back(now, out) {
                out.notify(Notice::AuthorityEnds { train });
                self.give_up(now, Refusal::AtLimit { train }, out);
            }
        }
        if let (Some(at), Some((_, end))) = (self.track_end_stop_time(), self.expected.track_end_stop)
            && at <= now
        {
            self.expected.track_end_stop = None;
            let name = context.layout.node_name(end).into();
            out.notify(Notice::TrackEnds { train, end });
            self.give_up(now, Refusal::TrackEnds { train, end: name }, out);
        }
    }

    fn track_end_stop(&self, context: TrackContext<'_>, now: Timestamp) -> Option<(Timestamp, NodeId)> {
        let located = self.located(context, now).filter(|_| self.commanded > SpeedStep::STAND)?;
        let (end, distance) = track_end(context, &self.model, located.at.node)?;
        let at = PathPoint { node: located.at.node, distance: distance - BEFORE_END };
        Some((self.last_stop_before(context, now, at)?, end))
    }

    /// The latest time at which a stop command may be sent for a rest before a point, with probability 1 −
    /// [`NEARER`]. Returns the earliest possible time if even that is too late, and `None` if the train does not get
    /// so far.
    pub(super) fn last_stop_before(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        at: PathPoint,
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

    /// Sets the end of authority, or removes it.
    pub(super) fn set_end_of_authority(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        end: Option<PathPoint>,
    ) {
        self.give_authority(end);
        self.update_authority_stop(context, now);
    }

    fn give_authority(&mut self, end: Option<PathPoint>) {
        self.end_of_authority = end;
        self.authorities_given = self.authorities_given.wrapping_add(1);
    }

    /// Ends the authority where the train is: it was placed or reversed, and the authority no longer applies.
    pub(super) fn end_authority_here(&mut self, context: TrackContext<'_>, now: Timestamp) {
        if self.end_of_authority.is_some() {
            self.give_authority(self.located(context, now).map(|located| located.at));
        }
    }

    /// Measures the end of authority from a sensor that the train has passed. If no path leads there from this
    /// sensor, the train has left its route, and its authority ends here.
    pub(super) fn recount_end_of_authority(&mut self, context: TrackContext<'_>, node: NodeId) {
        if let Some(end) = self.end_of_authority {
            let counted = recount_from(context, &self.model, end, node);
            self.end_of_authority = Some(counted.unwrap_or(PathPoint { node, distance: Length::ZERO }));
        }
    }
}
