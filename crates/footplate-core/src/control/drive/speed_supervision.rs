//! Speed supervision: keeps trains below the speed limits of zones, whatever was ordered.
//!
//! A train is commanded the ordered step, or the fastest lower step that the zones around it permit. Within a zone, a
//! permitted step keeps the speed below the limit with a stated probability. Ahead of a zone, a permitted step leaves
//! time to slow down before the front of the train enters. The slower step is commanded by the clock, at the last
//! safe time, even if no sensor reports. The ordered step is commanded again when the rear of the train has certainly
//! left the zone.
//!
//! ```text
//! x(t) + k σ_x + front = zone   ⇒   v(t) + k σ_v ≤ limit          until   x(t) − k σ_x − rear ≥ end of the zone
//! ```

use alloc::vec::Vec;

use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Zone;
use crate::tracking::{PathPoint, ReachableSet, TrackContext};
use crate::units::{Length, Ratio, Speed};

use super::driven_train::DrivenTrain;
use super::driver::Driver;
use super::order::Aim;
use super::outputs::Outputs;
use super::path::RestrictedStretch;
use super::task::{Destination, Goal, TaskPhase};
use crate::control::Notice;

/// Probability of entering a zone earlier than assumed, and of being faster in it, each. The probabilities for the
/// end of the track are ten times lower.
const OVERSPEED_PROBABILITY: Ratio = Ratio::from_percent(1.0);
/// Shortest time between an ordered step and a slower one: the next check, and a poll.
const MIN_STEP_TIME: TimeSpan = TimeSpan::from_ms(300);
/// A train behind a zone accelerates only if it need not slow down again for this long: about the time that it needs
/// to become faster at all.
const MIN_FASTER_TIME: TimeSpan = TimeSpan::from_ms(2_000);
/// A train within a zone accelerates only if this part of the limit remains: the step does not toggle for a
/// thousandth.
const LIMIT_MARGIN: f64 = 0.03;
/// Where even the slowest step exceeds the limit, the train has slowed down once its speed is within this part of
/// that step's.
const SETTLED: f64 = 0.03;
/// The zones are checked again after this time without a report.
const RECHECK_INTERVAL: TimeSpan = TimeSpan::from_ms(1_000);
/// Shortest time between two checks: 8 mm at 400 mm/s.
const MIN_CHECK_INTERVAL: TimeSpan = TimeSpan::from_ms(20);
/// Enough to halve a few seconds down to a check interval.
const HALVINGS: usize = 8;

/// What one check uses: the time of the next command, the extent of the train, and its reachable set.
struct Lookahead<'t> {
    train: &'t DrivenTrain,
    here: ReachableSet,
    now: Timestamp,
    usable: Vec<SpeedStep>,
    k: f64,
    /// Whether it is still faster than the last commanded step, ...
    is_slowing: bool,
    /// ... or in any transition between speeds.
    is_changing: bool,
    /// Extreme positions of its front and rear (m past the sensor).
    ends: [f64; 2],
}

/// A restricted stretch, and the fastest step that keeps its limit.
struct Restriction<'g> {
    stretch: RestrictedStretch<'g>,
    step: SpeedStep,
}

impl Driver {
    /// Checks the zones around the trains whose check is due.
    pub(super) fn supervise_speed(&mut self, now: Timestamp) {
        let context = self.track.context();
        if context.layout.zones().is_empty() {
            return;
        }
        for train in
            self.trains.values_mut().filter(|train| train.next_zone_check().is_some_and(|at| at <= now))
        {
            train.supervise_speed(context, now, &mut self.outputs);
        }
    }
}

impl DrivenTrain {
    /// When the zones around it are checked next.
    pub(super) fn next_zone_check(&self) -> Option<Timestamp> {
        self.speed_supervision.next_check.filter(|_| self.commanded > SpeedStep::STAND)
    }

    /// Schedules a check now, after a report or command; none if the layout has no zones.
    pub(super) fn schedule_zone_check(&mut self, context: TrackContext<'_>, now: Timestamp) {
        self.speed_supervision.next_check = (!context.layout.zones().is_empty()).then_some(now);
    }

    /// Whether a slower step than the ordered one is commanded.
    pub(super) const fn is_speed_limited(&self) -> bool {
        self.speed_supervision.wanted.is_some()
    }

    /// The fastest permitted step, if zones permit fewer than all.
    pub(super) fn fastest_allowed(&self, context: TrackContext<'_>, now: Timestamp) -> Option<SpeedStep> {
        if context.layout.zones().is_empty() {
            return None;
        }
        let (fastest, zone) = self.permitted_step(context, now, self.model.highest());
        zone.map(|_| fastest)
    }

    /// The restrictions on the path to a point, each with the fastest step that keeps its limit.
    pub(super) fn restricted_until<'g>(
        &self,
        context: TrackContext<'g>,
        now: Timestamp,
        at: PathPoint,
    ) -> Vec<(RestrictedStretch<'g>, SpeedStep)> {
        if context.layout.zones().is_empty() {
            return Vec::new();
        }
        let lookahead = Lookahead::of(self, now);
        let [_, rear] = lookahead.ends;
        let mut restrictions =
            RestrictedStretch::about(context, &self.model, at.node, -rear, at.distance.as_m());
        restrictions.retain(|stretch| stretch.to >= rear && stretch.from <= at.distance.as_m());
        restrictions
            .into_iter()
            .map(|stretch| (stretch, lookahead.within(stretch.zone.limit.as_m_per_s())))
            .collect()
    }

    /// Stores an ordered step and returns the one to command. Reports a zone that limits it.
    pub(super) fn supervised_step(
        &mut self,
        context: TrackContext<'_>,
        now: Timestamp,
        step: SpeedStep,
        out: &mut Outputs,
    ) -> SpeedStep {
        self.speed_supervision.wanted = None;
        self.schedule_zone_check(context, now);
        if step == SpeedStep::STAND || context.layout.zones().is_empty() {
            return step;
        }
        let (allowed, zone) = self.permitted_step(context, now, step);
        if let Some(zone) = zone {
            self.speed_supervision.wanted = Some(step);
            self.report_limit(allowed, zone, out);
        }
        allowed
    }

    fn report_limit(&mut self, step: SpeedStep, zone: &Zone, out: &mut Outputs) {
        if self.speed_supervision.reported_zone.as_ref() != Some(&zone.name) {
            self.speed_supervision.reported_zone = Some(zone.name.clone());
            let (train, name, limit) = (self.id(), zone.name.clone(), zone.limit);
            out.notify(Notice::SpeedLimited { train, step, zone: name, limit });
        }
    }

    /// The fastest step, up to a given one, that may be commanded now, and the zone that limits it.
    fn permitted_step<'g>(
        &self,
        context: TrackContext<'g>,
        now: Timestamp,
        step: SpeedStep,
    ) -> (SpeedStep, Option<&'g Zone>) {
        let lookahead = Lookahead::of(self, now);
        let restrictions = lookahead.restrictions(context, step);
        // A train that is slowing for a zone gets no faster step until it has settled: two opposite changes in a row
        // cannot be predicted.
        if lookahead.is_slowing
            && step > self.commanded
            && self.commanded > SpeedStep::STAND
            && let Some(restriction) = restrictions.iter().find(|restriction| step > restriction.step)
        {
            let commanded = lookahead.too_fast_for(&restrictions, self.commanded, MIN_STEP_TIME);
            let step = if commanded.is_some() {
                lookahead.fastest_below(&restrictions, self.commanded, MIN_STEP_TIME)
            } else {
                self.commanded
            };
            return (step, Some(restriction.stretch.zone));
        }
        let Some(zone) = lookahead.too_fast_for(&restrictions, step, MIN_STEP_TIME) else {
            return (step, None);
        };
        (lookahead.fastest_below(&restrictions, step, MIN_STEP_TIME), Some(zone))
    }

    /// Slows down for zones ahead, and accelerates to the ordered step behind them.
    fn supervise_speed(&mut self, context: TrackContext<'_>, now: Timestamp, out: &mut Outputs) {
        let commanded = self.commanded;
        let wanted = self.speed_supervision.wanted.filter(|wanted| *wanted > commanded);
        let lookahead = Lookahead::of(self, now);
        let restrictions = lookahead.restrictions(context, wanted.unwrap_or(commanded));
        let by = lookahead.latest_slowdown(&restrictions, commanded);
        let due = by.filter(|(by, _)| *by <= lookahead.start() + MIN_CHECK_INTERVAL);
        let slower =
            due.map(|(_, zone)| (lookahead.fastest_below(&restrictions, commanded, MIN_FASTER_TIME), zone));
        let slower = slower.filter(|(step, _)| *step < commanded);
        let leaves = lookahead.leaves_zone_at(&restrictions);
        let faster = wanted.filter(|_| due.is_none()).and_then(|wanted| {
            let faster = lookahead.usable.iter().rev().filter(|step| **step > commanded && **step <= wanted);
            let mut faster = faster.copied().chain(Some(wanted));
            faster.find(|step| {
                !lookahead.is_slowing
                    && lookahead.too_fast_for(&restrictions, *step, MIN_FASTER_TIME).is_none()
                    && lookahead.leaves_margin(&restrictions, *step)
                    && self.can_settle_at(context, now, *step)
            })
        });
        let next =
            by.map(|(by, _)| by - self.link.soonest).into_iter().chain(leaves.filter(|_| wanted.is_some()));
        let next =
            next.chain(Some(now + RECHECK_INTERVAL)).min().unwrap_or(now).max(now + MIN_CHECK_INTERVAL);
        self.speed_supervision.next_check = Some(next);
        if let Some((step, zone)) = slower {
            // Pacing chooses the step again at every update.
            if self.chooses_steps_itself() {
                self.speed_supervision.wanted = None;
            } else {
                self.speed_supervision.wanted.get_or_insert(commanded);
            }
            self.report_limit(step, zone, out);
            self.interrupt_line();
            self.command_unsupervised(now, step, out);
        } else if let Some(step) = faster {
            if Some(step) == wanted {
                self.speed_supervision.wanted = None;
            }
            self.resume_line(now, step);
            self.command_unsupervised(now, step, out);
        } else if by.is_none() && leaves.is_none() {
            self.speed_supervision.reported_zone = None;
        }
    }

    /// Whether a train that runs to a target may accelerate: only if it can still settle and stop as precisely from
    /// the faster step.
    fn can_settle_at(&self, context: TrackContext<'_>, now: Timestamp, step: SpeedStep) -> bool {
        let Some(Goal::RestAt(Destination { at: Some(at), .. })) = self.goal() else { return true };
        let is_running = matches!(self.task.map(|task| task.phase), Some(TaskPhase::Running { .. }));
        let located = self.located(context, now);
        is_running && located.is_some_and(|located| self.settles_before(context, &located, at, step))
    }
}

impl<'t> Lookahead<'t> {
    fn of(train: &'t DrivenTrain, now: Timestamp) -> Self {
        let k = Aim::NotBeyond(OVERSPEED_PROBABILITY).margin();
        let here = train.locator.reachable_set();
        let [ahead, behind] = train.reach.map(Length::as_m);
        let ends = [here.place(&train.model, now, k) + ahead, here.place(&train.model, now, -k) - behind];
        let beyond = here.unsettled(&train.model, now + train.link.soonest);
        let is_slowing = train.commanded.get() < here.step() || beyond > SETTLED;
        let is_changing = is_slowing || train.commanded.get() != here.step() || beyond < -SETTLED;
        Self { train, here, now, usable: train.usable_steps(), k, is_slowing, is_changing, ends }
    }

    /// The latest time at which the next command is sent.
    fn start(&self) -> Timestamp {
        self.now + self.train.link.soonest
    }

    /// The zones that matter for a train at a step or faster. If its position is unknown: the slowest zone,
    /// everywhere.
    fn restrictions<'g>(&self, context: TrackContext<'g>, step: SpeedStep) -> Vec<Restriction<'g>> {
        let restriction = |stretch: RestrictedStretch<'g>| Restriction {
            stretch,
            step: self.within(stretch.zone.limit.as_m_per_s()),
        };
        let Some(node) = self.here.node() else {
            let zones = context.layout.zones().iter();
            let slowest =
                zones.min_by(|one, other| one.limit.as_m_per_s().total_cmp(&other.limit.as_m_per_s()));
            let everywhere = |zone| RestrictedStretch { zone, from: f64::NEG_INFINITY, to: f64::INFINITY };
            return slowest.map(everywhere).map(restriction).into_iter().collect();
        };
        let model = &self.train.model;
        let step = step.max(self.train.commanded);
        let slowest = self.usable.first().copied().unwrap_or(step);
        let soon = self.train.link.soonest
            + MIN_FASTER_TIME
            + RECHECK_INTERVAL
            + model.settles_within(step, slowest);
        let [front, rear] = self.ends;
        let ahead = front + (model.steady_speed(step, Approach::Above) * soon).as_m() * (1.0 + LIMIT_MARGIN);
        let restrictions = RestrictedStretch::about(context, model, node, -rear, ahead);
        restrictions
            .into_iter()
            .filter(|stretch| stretch.to >= rear && stretch.from <= ahead)
            .map(restriction)
            .collect()
    }

    /// The fastest step within a limit; the slowest usable step always counts as within.
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

    /// The ratio of a step's speed reached from above to that reached from below: during a transition, a new step may
    /// be reached from above.
    fn gain_from_above(&self, step: SpeedStep) -> f64 {
        if !self.is_changing || step <= self.train.commanded {
            return 1.0;
        }
        let [below, above] =
            [Approach::Below, Approach::Above].map(|from| self.train.model.steady_speed(step, from));
        if below > Speed::ZERO { (above / below).max(1.0) } else { 1.0 }
    }

    /// Whether its front may be on a stretch.
    fn may_be_on(&self, stretch: &RestrictedStretch<'_>) -> bool {
        stretch.from <= self.ends[0]
    }

    /// The first zone whose limit a step would exceed, if it is commanded now and a slower one after `lasting`.
    fn too_fast_for<'g>(
        &self,
        restrictions: &[Restriction<'g>],
        step: SpeedStep,
        lasting: TimeSpan,
    ) -> Option<&'g Zone> {
        let (mut commanded, mut brakes) = (self.here, self.start());
        if commanded.step() != step.get() {
            commanded.command(&self.train.model, brakes, step);
            brakes += lasting;
        }
        let is_too_fast = |restriction: &&Restriction<'g>| {
            step > restriction.step
                && (self.may_be_on(&restriction.stretch)
                    || !self.can_slow_for(commanded, restriction, brakes))
        };
        restrictions.iter().find(is_too_fast).map(|restriction| restriction.stretch.zone)
    }

    /// Whether a step leaves a margin below the limit of every zone that the train may be in.
    fn leaves_margin(&self, restrictions: &[Restriction<'_>], step: SpeedStep) -> bool {
        let mut on = restrictions.iter().filter(|restriction| self.may_be_on(&restriction.stretch));
        on.all(|restriction| {
            step <= self.within(restriction.stretch.zone.limit.as_m_per_s() * (1.0 - LIMIT_MARGIN))
        })
    }

    /// Whether the train enters a zone within its limit if the slower step is commanded at a time.
    fn can_slow_for(
        &self,
        mut commanded: ReachableSet,
        restriction: &Restriction<'_>,
        at: Timestamp,
    ) -> bool {
        let model = &self.train.model;
        commanded.command(model, at, restriction.step);
        let commanded = commanded.after_all(model);
        let limit = restriction.stretch.zone.limit.as_m_per_s();
        let limit = limit.max(commanded.fastest_settled(self.k) * (1.0 + SETTLED));
        let enters = commanded.reaches(model, self.entry(&restriction.stretch), self.now, self.k);
        enters.is_none_or(|enters| commanded.fastest_from(model, enters, self.k) <= limit)
    }

    /// Where the pickup is (m) when the front reaches a stretch.
    fn entry(&self, stretch: &RestrictedStretch<'_>) -> f64 {
        stretch.from - self.train.reach[0].as_m()
    }

    /// The fastest step below a given one that may be commanded now if a slower one follows after `lasting`;
    /// otherwise the slowest usable one.
    fn fastest_below(
        &self,
        restrictions: &[Restriction<'_>],
        step: SpeedStep,
        lasting: TimeSpan,
    ) -> SpeedStep {
        let below = self.usable.partition_point(|usable| *usable < step);
        let below = self.usable.get(..below).unwrap_or_default();
        let may = below
            .partition_point(|usable| self.too_fast_for(restrictions, *usable, lasting).is_none())
            .max(1);
        below.get(may - 1).copied().unwrap_or(step)
    }

    /// The latest time for a slower step, and the zone that requires it; now for a zone that the train may be in.
    fn latest_slowdown<'g>(
        &self,
        restrictions: &[Restriction<'g>],
        commanded: SpeedStep,
    ) -> Option<(Timestamp, &'g Zone)> {
        let model = &self.train.model;
        let mut here = self.here;
        here.command(model, self.start(), commanded);
        let by = |restriction: &Restriction<'g>| {
            if commanded <= restriction.step {
                return None;
            }
            let is_in_time = |at: Timestamp| self.can_slow_for(here, restriction, at);
            if self.may_be_on(&restriction.stretch) || !is_in_time(self.start()) {
                return Some((self.start(), restriction.stretch.zone));
            }
            let entry = self.entry(&restriction.stretch);
            let mut late = here.after_all(model).reaches(model, entry, self.start(), self.k)?;
            let mut in_time = self.start();
            for _ in 0..HALVINGS {
                let middle = in_time + TimeSpan::from_s(0.5 * (late - in_time).as_s());
                if is_in_time(middle) { in_time = middle } else { late = middle }
            }
            Some((in_time, restriction.stretch.zone))
        };
        restrictions.iter().filter_map(by).min_by_key(|(at, _)| *at)
    }

    /// When the rear will have left the first of the zones that the train may be in.
    fn leaves_zone_at(&self, restrictions: &[Restriction<'_>]) -> Option<Timestamp> {
        let model = &self.train.model;
        let after = self.here.after_all(model);
        let on = restrictions
            .iter()
            .filter(|restriction| self.may_be_on(&restriction.stretch) && restriction.stretch.to.is_finite());
        let left = |restriction: &Restriction<'_>| {
            after.reaches(model, restriction.stretch.to + self.train.reach[1].as_m(), self.now, -self.k)
        };
        on.filter_map(left).min()
    }
}
