//! What keeps a train to speed restrictions, whatever it was told and by whom.
//!
//! A train is told the step that is asked for, or the fastest below it that the zones about it allow: within a zone those of
//! which its speed is believed to be within the limit but for a stated share of cases, ahead of one those from which it can
//! still be slowed down before its front comes there. Whatever is reported, it is told the slower step by the clock, at the
//! last moment at which that is sure. When its rear end has certainly left, it is told what was asked for.
//!
//! ```text
//! x(t) + k σ_x + front = zone   ⇒   v(t) + k σ_v ≤ limit          until   x(t) − k σ_x − rear ≥ end of the zone
//! ```

use alloc::vec::Vec;

use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Zone;
use crate::tracking::{ReachableSet, TrackContext, WayPoint};
use crate::units::{Length, Ratio, Speed};

use super::driven_train::DrivenTrain;
use super::driver::Driver;
use super::order::Aim;
use super::outputs::Outputs;
use super::restricted_stretch::RestrictedStretch;
use super::task::{Destination, Goal, Phase};
use crate::control::Notice;

/// How often a train may come to a zone nearer than is believed, and how often it may be faster there: in one case of a
/// hundred each. A restriction is no end of the track, where ten times as much is asked.
const TOO_FAST: Ratio = Ratio::from_percent(1.0);
/// A step that was asked for is followed by a slower one no sooner than this: the next look, and a poll.
const UNDONE: TimeSpan = TimeSpan::from_ms(300);
/// A train that has left a zone gets faster when it need not slow down again for so long: about what it takes to be faster
/// at all.
const WORTHWHILE: TimeSpan = TimeSpan::from_ms(2_000);
/// Within a zone a train gets faster only where this part of the limit is left: no train is told up and down for a
/// thousandth.
const SPARED: f64 = 0.03;
/// Where not even the slowest step is within the limit, the train has slowed down for it once its speed is within this
/// part of that step's.
const SETTLED: f64 = 0.03;
/// What is restricted is looked at again after this, whatever is reported.
const AGAIN: TimeSpan = TimeSpan::from_ms(1_000);
/// Looks are no nearer to each other: a train of 400 mm/s runs 8 mm.
const TICK: TimeSpan = TimeSpan::from_ms(20);
/// Halvings of a few seconds that leave less than a look takes.
const HALVINGS: usize = 8;

/// From where a train is judged: when a command can leave, how far it reaches and how it moves.
struct Lookahead<'t> {
    train: &'t DrivenTrain,
    here: ReachableSet,
    now: Timestamp,
    usable: Vec<SpeedStep>,
    k: f64,
    /// Whether it is still faster than the step commanded last will have it, ...
    slows_down: bool,
    /// ... or slower, or one of the two.
    changes: bool,
    /// Where its front may be and where its rear may still be (m past the contact).
    ends: [f64; 2],
}

/// A restricted way, and the fastest step that keeps to it.
struct Slow<'g> {
    way: RestrictedStretch<'g>,
    step: SpeedStep,
}

impl Driver {
    /// Looks at the zones about the trains for which that is due.
    pub(super) fn heed_zones(&mut self, now: Timestamp) {
        let context = self.track.context();
        if context.layout.zones().is_empty() {
            return;
        }
        for train in self.trains.values_mut().filter(|train| train.zone_look().is_some_and(|at| at <= now)) {
            train.heed_zones(context, now, &mut self.outputs);
        }
    }
}

impl DrivenTrain {
    /// When the zones about it are looked at next.
    pub(super) fn zone_look(&self) -> Option<Timestamp> {
        self.speed_supervision.look.filter(|_| self.commanded > SpeedStep::STAND)
    }

    /// Something is known anew, or the train was told something. Where nothing is restricted nobody looks.
    pub(super) fn look_at_zones(&mut self, context: TrackContext<'_>, now: Timestamp) {
        self.speed_supervision.look = (!context.layout.zones().is_empty()).then_some(now);
    }

    /// Whether it has been told a slower step than it was asked to run at.
    pub(super) const fn is_restrained(&self) -> bool {
        self.speed_supervision.wanted.is_some()
    }

    /// The fastest step of those that move it, if zones leave less than all of them.
    pub(super) fn fastest_allowed(&self, context: TrackContext<'_>, now: Timestamp) -> Option<SpeedStep> {
        if context.layout.zones().is_empty() {
            return None;
        }
        let (fastest, zone) = self.allowed(context, now, self.model.highest());
        zone.map(|_| fastest)
    }

    /// What is restricted on the way to a place, each with the fastest step that keeps to it.
    pub(super) fn restricted_until<'g>(
        &self,
        context: TrackContext<'g>,
        now: Timestamp,
        at: WayPoint,
    ) -> Vec<(RestrictedStretch<'g>, SpeedStep)> {
        if context.layout.zones().is_empty() {
            return Vec::new();
        }
        let lookahead = Lookahead::of(self, now);
        let [_, rear] = lookahead.ends;
        let mut ways = RestrictedStretch::about(context, &self.model, at.node, -rear, at.way.as_m());
        ways.retain(|way| way.to >= rear && way.from <= at.way.as_m());
        ways.into_iter().map(|way| (way, lookahead.within(way.zone.limit.as_m_per_s()))).collect()
    }

    /// The step to be told if one is asked for, which is kept in mind. Says so if zones leave less.
    pub(super) fn restrained(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        step: SpeedStep,
        out: &mut Outputs,
    ) -> SpeedStep {
        self.speed_supervision.wanted = None;
        self.look_at_zones(context, now);
        if step == SpeedStep::STAND || context.layout.zones().is_empty() {
            return step;
        }
        let (allowed, zone) = self.allowed(context, now, step);
        if let Some(zone) = zone {
            self.speed_supervision.wanted = Some(step);
            self.say_restrained(allowed, zone, out);
        }
        allowed
    }

    fn say_restrained(&mut self, step: SpeedStep, zone: &Zone, out: &mut Outputs) {
        if self.speed_supervision.said.as_ref() != Some(&zone.name) {
            self.speed_supervision.said = Some(zone.name.clone());
            let (train, name, limit) = (self.id(), zone.name.clone(), zone.limit);
            out.say(Notice::SpeedLimited { train, step, zone: name, limit });
        }
    }

    /// The fastest step up to one that may be commanded now, and the zone that leaves no more.
    fn allowed<'g>(
        &self,
        context: TrackContext<'g>,
        now: Timestamp,
        step: SpeedStep,
    ) -> (SpeedStep, Option<&'g Zone>) {
        let lookahead = Lookahead::of(self, now);
        let ways = lookahead.ways(context, step);
        // Who slows down for a zone is commanded nothing faster until it has: what came of a change and its opposite within a moment
        // nobody could say.
        if lookahead.slows_down
            && step > self.commanded
            && self.commanded > SpeedStep::STAND
            && let Some(slow) = ways.iter().find(|slow| step > slow.step)
        {
            let commanded = lookahead.forbids(&ways, self.commanded, UNDONE);
            let step = if commanded.is_some() {
                lookahead.fastest_below(&ways, self.commanded, UNDONE)
            } else {
                self.commanded
            };
            return (step, Some(slow.way.zone));
        }
        let Some(zone) = lookahead.forbids(&ways, step, UNDONE) else { return (step, None) };
        (lookahead.fastest_below(&ways, step, UNDONE), Some(zone))
    }

    /// Slows down for what is ahead, and gets faster where nothing restricts it any more.
    fn heed_zones(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        let commanded = self.commanded;
        let wanted = self.speed_supervision.wanted.filter(|wanted| *wanted > commanded);
        let lookahead = Lookahead::of(self, now);
        let ways = lookahead.ways(context, wanted.unwrap_or(commanded));
        let by = lookahead.slow_down_by(&ways, commanded);
        let due = by.filter(|(by, _)| *by <= lookahead.start() + TICK);
        let slower = due.map(|(_, zone)| (lookahead.fastest_below(&ways, commanded, WORTHWHILE), zone));
        let slower = slower.filter(|(step, _)| *step < commanded);
        let leaves = lookahead.leaves(&ways);
        let faster = wanted.filter(|_| due.is_none()).and_then(|wanted| {
            let faster = lookahead.usable.iter().rev().filter(|step| **step > commanded && **step <= wanted);
            let mut faster = faster.copied().chain(Some(wanted));
            faster.find(|step| {
                !lookahead.slows_down
                    && lookahead.forbids(&ways, *step, WORTHWHILE).is_none()
                    && lookahead.spares(&ways, *step)
                    && self.is_worth_it(context, now, *step)
            })
        });
        let next =
            by.map(|(by, _)| by - self.link.soonest).into_iter().chain(leaves.filter(|_| wanted.is_some()));
        let next = next.chain(Some(now + AGAIN)).min().unwrap_or(now).max(now + TICK);
        self.speed_supervision.look = Some(next);
        if let Some((step, zone)) = slower {
            // Who is paced is told what it should do at every look.
            if self.is_paced_by_itself() {
                self.speed_supervision.wanted = None;
            } else {
                self.speed_supervision.wanted.get_or_insert(commanded);
            }
            self.say_restrained(step, zone, out);
            self.interrupt_line();
            self.issue_at_once(now, step, out);
        } else if let Some(step) = faster {
            if Some(step) == wanted {
                self.speed_supervision.wanted = None;
            }
            self.resume_line(now, step);
            self.issue_at_once(now, step, out);
        } else if by.is_none() && leaves.is_none() {
            self.speed_supervision.said = None;
        }
    }

    /// Whether a train should get faster that is under way to a place: only if it can stop from the faster step as surely.
    fn is_worth_it(&self, context: TrackContext<'_>, now: Timestamp, step: SpeedStep) -> bool {
        let Some(Goal::RestAt(Destination { at: Some(at), .. })) = self.goal() else { return true };
        let is_running = matches!(self.task.map(|task| task.phase), Some(Phase::Running { .. }));
        let located = self.located(context, now);
        is_running && located.is_some_and(|located| self.settles_before(context, &located, at, step))
    }
}

impl<'t> Lookahead<'t> {
    fn of(train: &'t DrivenTrain, now: Timestamp) -> Self {
        let k = Aim::NotBeyond(TOO_FAST).margin();
        let here = train.locator.reachable_set();
        let [ahead, behind] = train.reach.map(Length::as_m);
        let ends = [here.place(&train.model, now, k) + ahead, here.place(&train.model, now, -k) - behind];
        let beyond = here.unsettled(&train.model, now + train.link.soonest);
        let slows_down = train.commanded.get() < here.step() || beyond > SETTLED;
        let changes = slows_down || train.commanded.get() != here.step() || beyond < -SETTLED;
        Self { train, here, now, usable: train.usable_steps(), k, slows_down, changes, ends }
    }

    /// When a command can leave at the latest.
    fn start(&self) -> Timestamp {
        self.now + self.train.link.soonest
    }

    /// The zones that matter for a train that runs at a step or faster; for one of which nobody knows where it is, the
    /// slowest of all, wherever it goes.
    fn ways<'g>(&self, context: TrackContext<'g>, step: SpeedStep) -> Vec<Slow<'g>> {
        let slow = |way: RestrictedStretch<'g>| Slow { way, step: self.within(way.zone.limit.as_m_per_s()) };
        let Some(node) = self.here.node() else {
            let zones = context.layout.zones().iter();
            let slowest =
                zones.min_by(|one, other| one.limit.as_m_per_s().total_cmp(&other.limit.as_m_per_s()));
            let everywhere = |zone| RestrictedStretch { zone, from: f64::NEG_INFINITY, to: f64::INFINITY };
            return slowest.map(everywhere).map(slow).into_iter().collect();
        };
        let model = &self.train.model;
        let step = step.max(self.train.commanded);
        let slowest = self.usable.first().copied().unwrap_or(step);
        let soon = self.train.link.soonest + WORTHWHILE + AGAIN + model.settles_within(step, slowest);
        let [front, rear] = self.ends;
        let ahead = front + (model.steady_speed(step, Approach::Above) * soon).as_m() * (1.0 + SPARED);
        let ways = RestrictedStretch::about(context, model, node, -rear, ahead);
        ways.into_iter().filter(|way| way.to >= rear && way.from <= ahead).map(slow).collect()
    }

    /// The fastest step within a limit, of which the slowest that moves it is taken to be.
    fn within(&self, limit: f64) -> SpeedStep {
        let keeps = |step: &SpeedStep| {
            let mut commanded = self.here;
            commanded.command(&self.train.model, self.start(), *step);
            let settled = commanded.after_all(&self.train.model).fastest_settled(self.k);
            settled * self.gain_from_above(*step) <= limit
        };
        let within = self.usable.partition_point(keeps).max(1);
        self.usable.get(within - 1).copied().unwrap_or(SpeedStep::STAND)
    }

    /// By which factor it is faster at a step than if it came to it from below: a train that is told another step while
    /// it still changes to the last one may come to it from above.
    fn gain_from_above(&self, step: SpeedStep) -> f64 {
        if !self.changes || step <= self.train.commanded {
            return 1.0;
        }
        let [below, above] =
            [Approach::Below, Approach::Above].map(|from| self.train.model.steady_speed(step, from));
        if below > Speed::ZERO { (above / below).max(1.0) } else { 1.0 }
    }

    /// Whether it may be on a way already.
    fn may_be_on(&self, way: &RestrictedStretch<'_>) -> bool {
        way.from <= self.ends[0]
    }

    /// The first zone that a step would be too fast for, if it is commanded now and a slower one so long after.
    fn forbids<'g>(&self, ways: &[Slow<'g>], step: SpeedStep, lasting: TimeSpan) -> Option<&'g Zone> {
        let (mut commanded, mut brakes) = (self.here, self.start());
        if commanded.step() != step.get() {
            commanded.command(&self.train.model, brakes, step);
            brakes += lasting;
        }
        let is_too_fast = |slow: &&Slow<'g>| {
            step > slow.step && (self.may_be_on(&slow.way) || !self.slows_for(commanded, slow, brakes))
        };
        ways.iter().find(is_too_fast).map(|slow| slow.way.zone)
    }

    /// Whether a step leaves something of the limit of every zone that it may be in.
    fn spares(&self, ways: &[Slow<'_>], step: SpeedStep) -> bool {
        let mut on = ways.iter().filter(|slow| self.may_be_on(&slow.way));
        on.all(|slow| step <= self.within(slow.way.zone.limit.as_m_per_s() * (1.0 - SPARED)))
    }

    /// Whether a train is within the limit when it comes to a zone ahead if it is told the slower step at a time.
    fn slows_for(&self, mut commanded: ReachableSet, slow: &Slow<'_>, at: Timestamp) -> bool {
        let model = &self.train.model;
        commanded.command(model, at, slow.step);
        let commanded = commanded.after_all(model);
        let limit = slow.way.zone.limit.as_m_per_s();
        let limit = limit.max(commanded.fastest_settled(self.k) * (1.0 + SETTLED));
        let enters = commanded.reaches(model, self.entry(&slow.way), self.now, self.k);
        enters.is_none_or(|enters| commanded.fastest_from(model, enters, self.k) <= limit)
    }

    /// Where it is when its front comes to a way.
    fn entry(&self, way: &RestrictedStretch<'_>) -> f64 {
        way.from - self.train.reach[0].as_m()
    }

    /// The fastest step below one that may be commanded now if a slower one follows so long after; the slowest that moves it where
    /// none may.
    fn fastest_below(&self, ways: &[Slow<'_>], step: SpeedStep, lasting: TimeSpan) -> SpeedStep {
        let below = self.usable.partition_point(|usable| *usable < step);
        let below = self.usable.get(..below).unwrap_or_default();
        let may = below.partition_point(|usable| self.forbids(ways, *usable, lasting).is_none()).max(1);
        below.get(may - 1).copied().unwrap_or(step)
    }

    /// When a slower step has to leave at the latest, and for which zone; at once for a zone that it may be in.
    fn slow_down_by<'g>(&self, ways: &[Slow<'g>], commanded: SpeedStep) -> Option<(Timestamp, &'g Zone)> {
        let model = &self.train.model;
        let mut here = self.here;
        here.command(model, self.start(), commanded);
        let by = |slow: &Slow<'g>| {
            if commanded <= slow.step {
                return None;
            }
            let is_in_time = |at: Timestamp| self.slows_for(here, slow, at);
            if self.may_be_on(&slow.way) || !is_in_time(self.start()) {
                return Some((self.start(), slow.way.zone));
            }
            let entry = self.entry(&slow.way);
            let mut late = here.after_all(model).reaches(model, entry, self.start(), self.k)?;
            let mut in_time = self.start();
            for _ in 0..HALVINGS {
                let middle = in_time + TimeSpan::from_s(0.5 * (late - in_time).as_s());
                if is_in_time(middle) { in_time = middle } else { late = middle }
            }
            Some((in_time, slow.way.zone))
        };
        ways.iter().filter_map(by).min_by_key(|(at, _)| *at)
    }

    /// When its rear end will have left the first of the zones that it may be in.
    fn leaves(&self, ways: &[Slow<'_>]) -> Option<Timestamp> {
        let model = &self.train.model;
        let after = self.here.after_all(model);
        let on = ways.iter().filter(|slow| self.may_be_on(&slow.way) && slow.way.to.is_finite());
        let left = |slow: &Slow<'_>| {
            after.reaches(model, slow.way.to + self.train.reach[1].as_m(), self.now, -self.k)
        };
        on.filter_map(left).min()
    }
}
