//! Follows another train at a gap.
//!
//! A gap in time `g` puts the follower at `t` where the leader was at `t − g`. That is mostly in the past and known
//! from the leader's detections (see [`LeadLine`]). In a chain, each train follows the first one by the sum of the
//! gaps, not its own leader's corrections: errors do not grow along the chain.
//!
//! Whatever the gap, the follower can stop before the rear of its leader if the leader is commanded to stop now, with
//! a probability of about 0.999. It slows down step by step before that takes a stop, each step once the last has
//! shown. If the leader's position is uncertain, only its last detection counts.

use alloc::collections::BTreeMap;

use crate::control::Notice;
use crate::control::drive::detections::STALL_FREE_SPEED;
use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::driver::Driver;
use crate::control::drive::order::{Aim, Gap, OrderId};
use crate::control::drive::outputs::Outputs;
use crate::control::drive::path::{circuit_length, distance_between};
use crate::control::drive::refusal::Refusal;
use crate::control::drive::task::{Goal, Task, TaskPhase};
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::{INTERRUPTED, PathPoint, TrackContext};
use crate::units::{Length, Ratio, Speed};

use super::lead_line::LeadLine;
use super::pace::{Following, Pace, Pacing};
use super::reference::{Reference, SurveyedPath};

/// Smallest clearance between the rear of a train and the front of the next.
pub(in crate::control) const SAFE_GAP: Length = Length::from_mm(50.0);
/// Probability that a follower comes to rest beyond its bound, ...
const BEYOND_PROBABILITY: Ratio = Ratio::from_percent(0.1);
/// ... and that its leader comes to rest short of its own. With equal spreads, both bounds together are 3.09 standard
/// deviations of the difference, exceeded once in a thousand times: 3.09 + 1.28 standard deviations of one train are
/// 3.09 times the root of the sum of both squares.
const LEADER_SHORT_PROBABILITY: Ratio = Ratio::from_percent(10.0);
/// One standard deviation of a train's position between sensors.
const POSITION_DEVIATION: Length = Length::from_mm(10.0);
/// The leader may lose this part of its speed without the follower having to stop.
const SPEED_DROP: f64 = 0.35;
/// Largest error of a paced train.
const PACING_ERROR: Length = Length::from_mm(25.0);
/// Shortest time between a step and a stop: the next check, and a poll.
const MIN_STEP_TIME: TimeSpan = TimeSpan::from_ms(300);
/// The leader is checked this often (s) without a report.
const RECHECK_INTERVAL: f64 = 0.4;
/// A stopped follower starts again when it can run this far before it would have to stop.
const WORTH_STARTING: Length = Length::from_mm(150.0);
/// A follower that will no longer be able to stop after this time slows down: a longer time would slow down trains in no danger.
const LOOKAHEAD: TimeSpan = TimeSpan::from_ms(500);
/// Below this speed a train may stall at any time.
const CREEP_SPEED: Speed = Speed::from_mm_per_s(60.0);
/// A train has run without a stop since its last detection if the time exceeds distance over speed by at most this
/// factor.
const MAX_TIME_RATIO: f64 = 1.5;
/// Longest chain of followers.
const MAX_CHAIN: usize = 12;
/// Gaps are checked between these speeds, or up to the leader's if that is faster: a leader at rest or at creep speed
/// will not stay so.
const MIN_GAP_SPEED: Speed = Speed::from_mm_per_s(200.0);
const MAX_GAP_SPEED: Speed = Speed::from_mm_per_s(250.0);
/// Number of speeds checked above the lowest.
const GAP_SPEEDS: u8 = 4;

impl Following {
    /// The fastest safe step, as of the last check.
    pub(super) const fn fastest(&self) -> Option<SpeedStep> {
        self.fastest
    }
}

/// The other trains.
pub(super) type Others = BTreeMap<TrainId, DrivenTrain>;

impl Driver {
    /// The train that a train has been ordered to follow.
    pub fn leader(&self, train: TrainId) -> Option<TrainId> {
        match &self.trains.get(&train)?.paced()?.pace {
            Pace::Follow(following) => Some(following.leader),
            _ => None,
        }
    }
}

impl DrivenTrain {
    /// Starts an order to follow.
    pub(in crate::control::drive) fn follow(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        order: OrderId,
        (leader, gap): (TrainId, Gap),
        others: &Others,
        out: &mut Outputs,
    ) -> Result<(), Refusal> {
        let ahead = others.get(&leader).ok_or(Refusal::UnknownTrain { train: leader })?;
        for train in [&*self, ahead] {
            if train.located(context, now).is_none() {
                return Err(Refusal::Lost { train: train.id() });
            }
        }
        if self.is_followed_by(leader, others) {
            return Err(Refusal::FollowsInCircle { train: self.id(), leader });
        }
        let shortest = self.shortest_gap(ahead, gap, others);
        let is_short = match (gap, shortest) {
            (Gap::Time(gap), Gap::Time(shortest)) => gap < shortest,
            (Gap::Way(gap), Gap::Way(shortest)) => gap < shortest,
            _ => true,
        };
        if is_short {
            return Err(Refusal::GapTooShort { leader, shortest });
        }
        self.start_task(Task { order, goal: Goal::Pace, phase: TaskPhase::Pacing }, out);
        let following = Following {
            leader,
            gap,
            is_stopped: self.commanded == SpeedStep::STAND,
            rear: None,
            fastest: None,
        };
        self.pacing = Some(Pacing::new(Pace::Follow(following), self.usable_steps(), now));
        Ok(())
    }

    fn followed(&self) -> Option<&Following> {
        match &self.paced()?.pace {
            Pace::Follow(following) => Some(following),
            _ => None,
        }
    }

    /// Whether a train follows this one, directly or behind others.
    fn is_followed_by(&self, other: TrainId, others: &Others) -> bool {
        let mut at = other;
        for _ in 0..MAX_CHAIN {
            if at == self.id() {
                return true;
            }
            match others.get(&at).and_then(Self::followed) {
                Some(following) => at = following.leader,
                None => return false,
            }
        }
        true
    }

    /// The shortest gap at which this train can still stop behind a leader that is commanded to stop, at all usual
    /// speeds.
    fn shortest_gap(&self, leader: &Self, gap: Gap, others: &Others) -> Gap {
        // Followers run faster for a while to catch up: the first train of the chain shows the usual speed.
        let mut first = leader;
        while let Some(next) = first.followed().and_then(|following| others.get(&following.leader)) {
            first = next;
        }
        let fastest = first.model.steady_speed(first.commanded, Approach::Below).max(MAX_GAP_SPEED);
        let speeds = (0..=GAP_SPEEDS)
            .map(|nth| MIN_GAP_SPEED + (fastest - MIN_GAP_SPEED) * (f64::from(nth) / f64::from(GAP_SPEEDS)));
        let gaps = speeds.map(|speed| (self.min_clearance(leader, speed), speed));
        match gap {
            Gap::Way(_) => Gap::Way(gaps.map(|(clearance, _)| clearance).fold(SAFE_GAP, Length::max)),
            Gap::Time(_) => {
                let times =
                    gaps.map(|(clearance, speed)| (clearance + leader.reach[1] + self.reach[0]) / speed);
                Gap::Time(times.fold(TimeSpan::ZERO, TimeSpan::max))
            }
        }
    }

    /// The smallest clearance at a speed.
    fn min_clearance(&self, leader: &Self, speed: Speed) -> Length {
        let stop = |train: &Self, speed: Speed, margins: f64| {
            let steady = |step: &SpeedStep| train.model.steady_speed(*step, Approach::Below);
            let off = |step: &SpeedStep| (steady(step) - speed).abs();
            let steps = train.usable_steps();
            let near = |one: &&SpeedStep, other: &&SpeedStep| {
                off(one).as_m_per_s().total_cmp(&off(other).as_m_per_s())
            };
            let nearest = steps.iter().min_by(near);
            nearest.map_or(Length::ZERO, |step| {
                let stop = train.model.stop(*step, Approach::Below);
                // Interpolates the stop between steps.
                let faster = speed - steady(step);
                let next = steps.iter().filter(|next| *next != step).min_by(near);
                // A paced train alternates between two steps.
                let switches = next.map_or(Speed::ZERO, |next| (steady(next) - steady(step)).abs());
                let is_paced = train.id() == self.id() || train.paced().is_some();
                let switching =
                    if is_paced { switches * TimeSpan::from_s(INTERRUPTED) } else { Length::ZERO };
                let deviations = [stop.doubt, stop.scatter, POSITION_DEVIATION, switching].map(Length::as_m);
                let deviation = Length::from_m(libm::sqrt(deviations.iter().map(|one| one * one).sum()));
                stop.distance + faster * stop.time + deviation * margins
            })
        };
        let own = stop(self, speed * (1.0 + SPEED_DROP), Aim::NotBeyond(BEYOND_PROBABILITY).margin());
        let ahead = stop(leader, speed, -Aim::NotBeyond(LEADER_SHORT_PROBABILITY).margin());
        let strays = if leader.followed().is_some() { PACING_ERROR + PACING_ERROR } else { PACING_ERROR };
        (own - ahead + speed * self.link.usually_left() + strays + SAFE_GAP).max(SAFE_GAP)
    }

    /// Where a follower should be; `None` while the position of its leader is unknown.
    pub(super) fn follow_reference(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        following: Following,
        node: NodeId,
        others: &Others,
    ) -> Option<Reference> {
        let located = self.located(context, now)?;
        let past = SurveyedPath::ahead(context, &self.model, node).surveyed(located.at.distance.as_m());
        let (mut late, mut behind) = (0.0, 0.0);
        let (mut train, mut following) = (self, following);
        // The first train of the chain, and the sum of the gaps.
        let first = loop {
            let leader = others.get(&following.leader)?;
            match following.gap {
                Gap::Time(gap) => late += gap.as_s(),
                Gap::Way(distance) => behind += (distance + leader.reach[1] + train.reach[0]).as_m(),
            }
            match leader.followed() {
                Some(next) => (train, following) = (leader, *next),
                None => break leader,
            }
        };
        let line = LeadLine::of(context, first, now, (node, past))?;
        let speeds = [0.0, Reference::SPAN].map(|ahead| line.speed(ahead - late));
        Some(Reference::of(|ahead| line.place(ahead - late) - behind, speeds))
    }

    /// The bound for the follower: the rear of its leader at rest, if that is commanded to stop at a time from now
    /// on, on the follower's path. `None` if no path leads there.
    fn rear_of(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        leader: &Self,
        stopped: Timestamp,
    ) -> Option<PathPoint> {
        let node = self.locator.rollout()?.node();
        let seen = leader
            .passages
            .iter()
            .next_back()
            .map(|(node, _)| node)
            .or(leader.locator.rollout().map(|rollout| rollout.node()))?;
        let rest = leader.locator.rest_if_stopped(context, &leader.model, stopped);
        let rest = rest.filter(|_| !leader.is_position_uncertain(context, now));
        let past = rest.map_or(Length::ZERO, |rest| {
            let short_of =
                rest.at.distance - rest.deviation() * Aim::NotBeyond(LEADER_SHORT_PROBABILITY).margin();
            short_of.max(Length::ZERO)
        });
        let from = rest.map_or(seen, |rest| rest.at.node);
        let between = distance_between(context, &self.model, node, from)?;
        let lap = self.lap_to(context, now, leader, node).unwrap_or(Length::ZERO);
        Some(PathPoint { node, distance: between + lap + past - leader.reach[1] - self.reach[0] - SAFE_GAP })
    }

    /// The lap by which a leader is further ahead than its distance past the sensor says: it has passed the only sensor of a
    /// circuit again, and this train not yet. `None` if that is not so.
    fn lap_to(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        leader: &Self,
        node: NodeId,
    ) -> Option<Length> {
        context.hops_ahead(node).next().filter(|hop| hop.to == node)?;
        let [own, ahead] = [self.located(context, now)?.at, leader.located(context, now)?.at];
        let is_lapped = own.node == node && ahead.node == node && ahead.distance < own.distance;
        circuit_length(context, &self.model, node).filter(|_| is_lapped)
    }

    /// Whether the train may be far from its estimated position. One that sets out on dirt stays where it is. Sensors miss
    /// a train thirty times as often as trains stall: one missed detection is no evidence against a train that was running
    /// and is too fast to stall, until the next is late. For a creeping train only the last detection is certain: it may
    /// stall at any time, and its next detection is late long after.
    fn is_position_uncertain(&self, context: TrackContext<'_>, now: Timestamp) -> bool {
        let Some(located) = self.located(context, now) else { return true };
        if self.passages.may_not_have_started() {
            return true;
        }
        let speed = self.model.steady_speed(self.commanded, Approach::Below);
        if self.missed_sensor().is_none() {
            return self.commanded > SpeedStep::STAND && speed < CREEP_SPEED;
        }
        let seen = self.passages.iter().next_back().map(|(_, time)| now - time);
        let has_run = seen.is_some_and(|since| located.speed * since <= located.at.distance * MAX_TIME_RATIO);
        !(has_run && speed >= STALL_FREE_SPEED && self.missed_just_one(now))
    }

    /// The fastest step that still allows a stop before the rear of the leader when the next command is due, if neither train is
    /// commanded anything else before: after [`LOOKAHEAD`], or once a new step has shown. Without such a step, one that allows it
    /// after [`LOOKAHEAD`]; `None` if the train has to stop.
    fn fastest_behind(&self, context: TrackContext<'_>, now: Timestamp, leader: &Self) -> Option<SpeedStep> {
        let start = now + self.link.usually_left();
        let is_safe = |step: &SpeedStep, until: Timestamp| {
            let Some(rear) = self.rear_of(context, now, leader, until) else { return false };
            let rest = self.locator.rest_after_move(context, &self.model, start, *step, until);
            let beyond = rest
                .and_then(|rest| self.aimed_beyond(context, &rest, rear, Aim::NotBeyond(BEYOND_PROBABILITY)));
            beyond.is_some_and(|beyond| beyond <= Length::ZERO)
        };
        let soon = now + LOOKAHEAD;
        // The next step down, or the stop, is commanded once this one has shown.
        let next = |step: &SpeedStep| {
            let shown = start + self.model.shows_within(self.commanded, *step) + MIN_STEP_TIME;
            if *step == self.commanded { soon } else { shown.max(soon) }
        };
        let runs = |step: &&SpeedStep| self.model.steady_speed(**step, Approach::Below) >= CREEP_SPEED;
        let steps = || self.pacing.iter().flat_map(|pacing| pacing.usable.iter().rev()).filter(runs);
        let lasting = steps().find(|step| is_safe(step, next(step)));
        lasting.or_else(|| steps().find(|step| is_safe(step, soon))).copied()
    }

    /// Checks the clearance to the leader and slows down or stops if need be. Returns whether the train may be paced
    /// now.
    pub(super) fn may_follow(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        others: &Others,
        out: &mut Outputs,
    ) -> bool {
        let Some(following) = self.followed().copied() else { return true };
        let leader = following.leader;
        let Some(ahead) = others.get(&leader) else {
            self.give_up(now, Refusal::UnknownTrain { train: leader }, out);
            return false;
        };
        let rear = self.rear_of(context, now, ahead, now);
        let fastest = self.fastest_behind(context, now, ahead);
        let soon = now + self.link.command + TimeSpan::from_s(RECHECK_INTERVAL);
        let stop_by = rear.and_then(|rear| self.last_stop_before(context, now, rear));
        let is_free = rear.is_some_and(|rear| {
            if self.commanded > SpeedStep::STAND {
                return fastest.is_some()
                    && stop_by.is_none_or(|by| by > now + self.link.command + self.link.command);
            }
            let rest = self.locator.rest_if_stopped(context, &self.model, now);
            let beyond = |end| rest.and_then(|rest| self.beyond(context, rest.at, end));
            let has_room = |beyond: Length| beyond < -WORTH_STARTING;
            // A stop and a start in turn are unpredictable: a decoder that eases in and out hardly does either, and a train that
            // almost rests may stick or not.
            ahead.commanded > SpeedStep::STAND
                && self.is_at_rest(context, now)
                && beyond(rear).is_some_and(has_room)
                && self.end_of_authority.and_then(beyond).is_none_or(has_room)
        });
        let commanded = self.commanded;
        let has_shown = self.locator.has_change_shown(&self.model, now);
        let stops_ahead = commanded > SpeedStep::STAND && self.has_stopping_ahead(others);
        let Some(Pacing { pace: Pace::Follow(following), next_update, .. }) = &mut self.pacing else {
            return true;
        };
        *next_update =
            Some(stop_by.map_or(soon, |by| (by - self.link.command).clamp(now + self.link.command, soon)));
        (following.rear, following.fastest) = (rear, fastest);
        if is_free {
            following.is_stopped = false;
            if stops_ahead {
                return false;
            }
            let slower = fastest.filter(|step| *step < commanded);
            if let Some(step) = slower.filter(|_| has_shown) {
                self.command_step(context, now, step, out);
            }
            return slower.is_none();
        }
        self.hold_back(now, out);
        false
    }

    /// Whether a train ahead, up to the first of the chain, was commanded to stop. Its follower will have to stop as well: one stop
    /// from a steady speed ends where it is expected to, one after several slower steps does not.
    fn has_stopping_ahead(&self, others: &Others) -> bool {
        let ahead = |train: &Self| others.get(&train.followed()?.leader);
        core::iter::successors(ahead(self), |train| ahead(train))
            .take(MAX_CHAIN)
            .any(|train| train.commanded == SpeedStep::STAND)
    }

    /// Stops a follower until the track ahead is free again. Returns whether the train follows another.
    pub(in crate::control::drive) fn hold_back(&mut self, now: Timestamp, out: &mut Outputs) -> bool {
        let (Some(task), Some(leader)) = (self.task, self.followed().map(|following| following.leader))
        else {
            return false;
        };
        let Some(Pacing { pace: Pace::Follow(following), .. }) = &mut self.pacing else { return false };
        if self.commanded > SpeedStep::STAND {
            if !core::mem::replace(&mut following.is_stopped, true) {
                out.notify(Notice::HeldBack { order: task.order, train: self.id(), leader });
            }
            self.command_stop(now, out);
        }
        true
    }

    /// Whether a step may be commanded now: a stop commanded as soon as the line is free again must still end before
    /// the leader. A slower step always may.
    pub(super) fn could_still_stop(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        step: SpeedStep,
    ) -> bool {
        let Some(following) = self.followed().filter(|_| step > self.commanded) else { return true };
        let Some(rear) = following.rear else { return false };
        let start = now + self.link.usually_left();
        let rest = self.locator.rest_after_move(context, &self.model, start, step, start + MIN_STEP_TIME);
        let beyond =
            rest.and_then(|rest| self.aimed_beyond(context, &rest, rear, Aim::NotBeyond(BEYOND_PROBABILITY)));
        beyond.is_some_and(|beyond| beyond <= Length::ZERO)
    }
}
