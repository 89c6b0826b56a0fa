//! A train that runs behind another and keeps the gap to it.
//!
//! A gap in time `g` asks the follower to be at `t` where the leader was at `t − g`. Mostly that is past, and known from
//! when the leader came by the contacts about that place (see [`LeadLine`]). Who follows a follower does not run after what
//! that one does to make up for its own errors: it follows the first train of all, by the sum of the gaps, so that errors do
//! not grow from train to train.
//!
//! Whatever the gap, the follower can come to rest before the rear of its leader, should that be commanded to stop now, but for
//! one time in about a thousand. It slows down step by step before that needs a stop. Of a leader that is in doubt only the
//! contact counts at which it was seen last.

use alloc::collections::BTreeMap;

use crate::control::Notice;
use crate::control::drive::command_time::spread;
use crate::control::drive::driven_train::DrivenTrain;
use crate::control::drive::driver::Driver;
use crate::control::drive::order::{Aim, Gap, OrderId};
use crate::control::drive::outputs::Outputs;
use crate::control::drive::path_length::way_between;
use crate::control::drive::refusal::Refusal;
use crate::control::drive::task::{Goal, Phase, Task};
use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::INTERRUPTED;
use crate::tracking::{TrackContext, WayPoint};
use crate::units::{Length, Ratio, Speed};

use super::command_budget::seconds;
use super::lead_line::LeadLine;
use super::pace::{Following, Pace, Pacing};
use super::reference::Reference;
use super::surveyed_way::SurveyedWay;

/// From the rear of one train to the front of the next there is never less: a hand's breadth.
pub(in crate::control) const SAFE: Length = Length::from_mm(50.0);
/// How often a follower may come to rest beyond the place where it should, ...
const NEARER: Ratio = Ratio::from_percent(0.1);
/// ... and its leader short of where it is thought to. Where both scatter alike, both together are as far off as one time in
/// a thousand: 3.09 + 1.28 standard deviations of one are 3.09 of the root of the sum of both squares.
const SHORTER: Ratio = Ratio::from_percent(10.0);
/// One standard deviation of where a train is believed to be between contacts.
const BELIEVED: Length = Length::from_mm(10.0);
/// A leader may slow down to what is left of its speed without this part, and its follower need not be held back for it.
const SLOWS: f64 = 0.35;
/// So far a train strays from where it should be.
const STRAYS: Length = Length::from_mm(25.0);
/// A step that was told is followed by a stop no sooner than this: the next look, and a poll.
const UNDONE: TimeSpan = TimeSpan::from_ms(300);
/// A leader is looked at this often (s), whatever is reported.
const LOOK_AGAIN: f64 = 0.4;
/// A train that was held back starts again when it can run so far before it would have to stop: no train should start for
/// less.
const WORTH_STARTING: Length = Length::from_mm(150.0);
/// A follower that will not be able to stop in so much time slows down: a change of step begins to be felt within it, and a
/// longer one would hold back trains that are in no danger.
const FORESEEN: TimeSpan = TimeSpan::from_ms(500);
/// It does not creep up to its leader, and trains that run so fast do not stall.
const CREEPS: Speed = Speed::from_mm_per_s(60.0);
const LIVELY: Speed = Speed::from_mm_per_s(150.0);
/// A train has run ever since it was seen if it needed no more than this part of the time for its way at its speed.
const RAN_ON: f64 = 1.5;
/// More trains in a row are on no layout.
const MOST_IN_A_ROW: usize = 12;
/// Gaps are judged for speeds from the one to the other, or to that of the leader if it is faster: one that stands, or crawls,
/// will not do so for ever.
const SLOWEST_JUDGED: Speed = Speed::from_mm_per_s(200.0);
const USUAL_SPEED: Speed = Speed::from_mm_per_s(250.0);
/// So many speeds beside the slowest.
const SPEEDS_JUDGED: u8 = 4;

impl Following {
    /// The fastest step that is safe, as of the last look.
    pub(super) const fn fastest(&self) -> Option<SpeedStep> {
        self.fastest
    }
}

/// The other trains.
pub(super) type Others = BTreeMap<TrainId, DrivenTrain>;

impl Driver {
    /// The train behind which a train has been ordered to keep a gap.
    #[must_use]
    pub fn leader(&self, train: TrainId) -> Option<TrainId> {
        match &self.trains.get(&train)?.paced()?.pace {
            Pace::Follow(following) => Some(following.leader),
            _ => None,
        }
    }
}

impl DrivenTrain {
    /// Takes an order to follow.
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
        if self.leads(leader, others) {
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
        self.take(Task { order, goal: Goal::Pace, phase: Phase::Pacing }, out);
        let following =
            Following { leader, gap, is_held: self.commanded == SpeedStep::STAND, rear: None, fastest: None };
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
    fn leads(&self, other: TrainId, others: &Others) -> bool {
        let mut at = other;
        for _ in 0..MOST_IN_A_ROW {
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

    /// The shortest gap at which it could still stop behind a leader that is commanded to stop, whatever usual speed they run at.
    fn shortest_gap(&self, leader: &Self, gap: Gap, others: &Others) -> Gap {
        // Who follows runs faster for a while to catch up: the first of all says how fast all of them usually are.
        let mut first = leader;
        while let Some(next) = first.followed().and_then(|following| others.get(&following.leader)) {
            first = next;
        }
        let fastest = first.model.steady_speed(first.commanded, Approach::Below).max(USUAL_SPEED);
        let speeds = (0..=SPEEDS_JUDGED).map(|nth| {
            SLOWEST_JUDGED + (fastest - SLOWEST_JUDGED) * (f64::from(nth) / f64::from(SPEEDS_JUDGED))
        });
        let gaps = speeds.map(|speed| (self.bumpers_apart(leader, speed), speed));
        match gap {
            Gap::Way(_) => Gap::Way(gaps.map(|(bumpers, _)| bumpers).fold(SAFE, Length::max)),
            Gap::Time(_) => {
                let times = gaps.map(|(bumpers, speed)| (bumpers + leader.reach[1] + self.reach[0]) / speed);
                Gap::Time(times.fold(TimeSpan::ZERO, TimeSpan::max))
            }
        }
    }

    /// The least way from bumper to bumper at a speed.
    fn bumpers_apart(&self, leader: &Self, speed: Speed) -> Length {
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
                // Steps are coarse: what a stop from just this speed takes.
                let faster = speed - steady(step);
                let next = steps.iter().filter(|next| *next != step).min_by(near);
                // Who is paced is always between two steps.
                let switches = next.map_or(Speed::ZERO, |next| (steady(next) - steady(step)).abs());
                let is_paced = train.id() == self.id() || train.paced().is_some();
                let switching =
                    if is_paced { switches * TimeSpan::from_s(INTERRUPTED) } else { Length::ZERO };
                let doubts = [stop.doubt, stop.scatter, BELIEVED, switching].map(Length::as_m);
                let doubt = Length::from_m(libm::sqrt(doubts.iter().map(|doubt| doubt * doubt).sum()));
                stop.distance + faster * stop.time + doubt * margins
            })
        };
        let own = stop(self, speed * (1.0 + SLOWS), Aim::NotBeyond(NEARER).margin());
        let ahead = stop(leader, speed, -Aim::NotBeyond(SHORTER).margin());
        let strays = if leader.followed().is_some() { STRAYS + STRAYS } else { STRAYS };
        (own - ahead + speed * self.link.usually_left() + strays + SAFE).max(SAFE)
    }

    /// Where a follower should be; `None` while nobody knows where its leader is.
    pub(super) fn follow_reference(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        following: Following,
        node: NodeId,
        others: &Others,
    ) -> Option<Reference> {
        let located = self.located(context, now)?;
        let past = SurveyedWay::ahead(context, &self.model, node).of_felt(located.at.way.as_m());
        let (mut late, mut behind) = (0.0, 0.0);
        let (mut train, mut following) = (self, following);
        // The first of all, by the sum of what is kept.
        let first = loop {
            let leader = others.get(&following.leader)?;
            match following.gap {
                Gap::Time(gap) => late += gap.as_s(),
                Gap::Way(way) => behind += (way + leader.reach[1] + train.reach[0]).as_m(),
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

    /// What the follower shall not pass: the rear of its leader, where that comes to rest if it is commanded to stop at a time
    /// from now on, on the follower's way. `None` if no way leads there.
    fn rear_of(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        leader: &Self,
        stopped: Timestamp,
    ) -> Option<WayPoint> {
        let node = self.locator.rollout()?.node();
        let seen = leader
            .passages
            .iter()
            .next_back()
            .map(|(node, _)| node)
            .or(leader.locator.rollout().map(|rollout| rollout.node()))?;
        let rest = leader.locator.rest_if_stopped(context, &leader.model, stopped);
        let rest = rest.filter(|_| !leader.is_in_doubt(context, now));
        let past = rest.map_or(Length::ZERO, |rest| {
            let surely = rest.at.way - spread(&rest) * Aim::NotBeyond(SHORTER).margin();
            surely.max(Length::ZERO)
        });
        let from = rest.map_or(seen, |rest| rest.at.node);
        let between = way_between(context, &self.model, node, from)?;
        Some(WayPoint { node, way: between + past - leader.reach[1] - self.reach[0] - SAFE })
    }

    /// Whether it may be elsewhere than where it is believed to be. Contacts fail thirty times as often as trains stall: one
    /// that was silent is no doubt of a train that was seen running before, and runs too fast to stall, until the next is late.
    /// Of one that creeps only the contact is sure that it came by last: it stalls any time, and the next is late long after.
    fn is_in_doubt(&self, context: TrackContext<'_>, now: Timestamp) -> bool {
        let Some(located) = self.located(context, now) else { return true };
        let speed = self.model.steady_speed(self.commanded, Approach::Below);
        if self.unseen().is_none() {
            return self.commanded > SpeedStep::STAND && speed < CREEPS;
        }
        let seen = self.passages.iter().next_back().map(|(_, time)| now - time);
        let has_run = seen.is_some_and(|since| located.speed * since <= located.at.way * RAN_ON);
        !(has_run && speed >= LIVELY && self.missed_just_one(now))
    }

    /// The fastest step that it could be commanded now and still stop before the rear of its leader in a while, if neither is told
    /// anything else until then; `None` if it is time to stand.
    fn fastest_behind(&self, context: TrackContext<'_>, now: Timestamp, leader: &Self) -> Option<SpeedStep> {
        let later = now + FORESEEN;
        let rear = self.rear_of(context, now, leader, later)?;
        let start = now + self.link.usually_left();
        let is_safe = |step: &SpeedStep| {
            let rest = self.locator.rest_after_move(context, &self.model, start, *step, later);
            let beyond =
                rest.and_then(|rest| self.aimed_beyond(context, &rest, rear, Aim::NotBeyond(NEARER)));
            beyond.is_some_and(|beyond| beyond <= Length::ZERO)
        };
        let runs = |step: &&SpeedStep| self.model.steady_speed(**step, Approach::Below) >= CREEPS;
        self.pacing.as_ref()?.usable.iter().rev().filter(runs).find(|step| is_safe(step)).copied()
    }

    /// Looks after the distance to the leader. Says whether the train may be paced now.
    pub(super) fn may_follow(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        others: &Others,
        out: &mut Outputs,
    ) -> bool {
        let Some(following) = self.followed().copied() else { return true };
        let Some(task) = self.task else { return false };
        let leader = following.leader;
        let Some(ahead) = others.get(&leader) else {
            self.give_up(now, Refusal::UnknownTrain { train: leader }, out);
            return false;
        };
        let rear = self.rear_of(context, now, ahead, now);
        let fastest = self.fastest_behind(context, now, ahead);
        let soon = now + self.link.command + TimeSpan::from_s(LOOK_AGAIN);
        let stop_by = rear.and_then(|rear| self.last_stop_before(context, now, rear));
        let is_free = rear.is_some_and(|rear| {
            if self.commanded > SpeedStep::STAND {
                return fastest.is_some()
                    && stop_by.is_none_or(|by| by > now + self.link.command + self.link.command);
            }
            let rest = self.locator.rest_if_stopped(context, &self.model, now);
            let beyond = rest.and_then(|rest| self.beyond(context, rest.at, rear));
            ahead.commanded > SpeedStep::STAND && beyond.is_some_and(|beyond| beyond < -WORTH_STARTING)
        });
        let commanded = self.commanded;
        let Some(Pacing { pace: Pace::Follow(following), look, budget, .. }) = &mut self.pacing else {
            return true;
        };
        *look =
            Some(stop_by.map_or(soon, |by| (by - self.link.command).clamp(now + self.link.command, soon)));
        (following.rear, following.fastest) = (rear, fastest);
        if is_free {
            following.is_held = false;
            let slower = fastest.filter(|step| *step < commanded);
            if let Some(step) = slower.filter(|_| budget.spaced() <= seconds(now)) {
                self.issue_step(context, now, step, out);
            }
            return slower.is_none();
        }
        if commanded > SpeedStep::STAND {
            if !following.is_held {
                following.is_held = true;
                out.say(Notice::HeldBack { order: task.order, train: self.id(), leader });
            }
            self.issue_stop(now, out);
        }
        false
    }

    /// Whether a step may be commanded now: whether a stop that is told as soon as the line is free again would still end before
    /// the leader. Who gets slower always may.
    pub(super) fn could_still_stop(
        &self,
        context: TrackContext<'_>,
        now: Timestamp,
        step: SpeedStep,
    ) -> bool {
        let Some(following) = self.followed().filter(|_| step > self.commanded) else { return true };
        let Some(rear) = following.rear else { return false };
        let start = now + self.link.usually_left();
        let rest = self.locator.rest_after_move(context, &self.model, start, step, start + UNDONE);
        let beyond = rest.and_then(|rest| self.aimed_beyond(context, &rest, rear, Aim::NotBeyond(NEARER)));
        beyond.is_some_and(|beyond| beyond <= Length::ZERO)
    }
}
