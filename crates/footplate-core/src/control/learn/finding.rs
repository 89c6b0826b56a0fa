//! Finds the train, reverses it if no circuit is ahead, and brings it to a circuit.

use alloc::collections::BTreeMap;

use super::accuracy::usable_steps;
use super::activity::Activity;
use super::calibrator::Calibrator;
use super::circuits::{end_within, locked_turnouts, path_from, wanted_legs};
use super::notice::{CalibrationNotice, Ending};
use crate::event::{Approach, Command, Event};
use crate::ids::{NodeId, SpeedStep, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Circuit, Leg};
use crate::units::{Length, Speed};

/// Stuck sensors report within this time, once every module has been polled.
const LISTEN: TimeSpan = TimeSpan::from_ms(700);

/// The step of a lost train is raised after this time without a detection.
const PUSH_UP_AFTER: TimeSpan = TimeSpan::from_ms(4_000);

/// At the highest step it reaches a sensor within this time, unless something blocks it.
const GIVE_UP_AFTER: TimeSpan = TimeSpan::from_ms(8_000);

/// The speed of a lost train, if its speeds are known: slow enough to stop in time, and not too slow.
const FINDING_SPEED: Speed = Speed::from_mm_per_s(180.0);

/// The fraction of all steps at which most trains move and none is fast (published tables: step 5 of 14).
const FINDING_STEP: f64 = 0.36;

/// The lowest step for that: many trains stall below it (published tables).
const SLOWEST_STEP: u8 = 3;

/// After this many reversals without reaching a circuit, the calibration ends.
const MAX_REVERSALS: u8 = 3;

/// A turnout has moved within this time, its command and the one before it included.
pub(super) const THROWN_WITHIN: TimeSpan = TimeSpan::from_ms(700);

/// A turnout that waits behind another one moves later by this time: half of the above, which counts two commands.
const NEXT_THROWN_WITHIN: TimeSpan = TimeSpan::from_ms(350);

/// Experiments begin when the turnouts are set over this distance: the longest stop and the hop before it.
const SET_AHEAD: Length = Length::from_mm(2_500.0);

/// A turnout that was in the wrong position this often counts as jammed and is used as it is.
const JAMMED_AFTER: u8 = 2;

/// A train that runs this long without its turnouts set is slowed down: a slower train needs less distance to a turnout ...
const SLOWED_AFTER: TimeSpan = TimeSpan::from_ms(25_000);

/// ... and after this time the calibration ends: more laps change nothing.
const LONGEST_JOIN: TimeSpan = TimeSpan::from_ms(150_000);

/// Margin added to every distance that must be clear.
const MARGIN: Length = Length::from_mm(100.0);

/// So many sensors in a row leave the direction of a train open only where their order is the same in both: on a circuit of three, one
/// that is silent costs three more.
const MOST_UNDECIDED: usize = 8;

/// A turnout is requested again after this time.
const ASK_AGAIN: TimeSpan = TimeSpan::from_ms(3_000);

/// An unknown train is at rest this long after the stop command (the longest of the published stops).
const AT_REST_WITHIN: TimeSpan = TimeSpan::from_ms(5_000);

impl Calibrator<'_> {
    /// Starts the calibration: stops the train and listens for stuck sensors.
    pub(super) fn begin(&mut self, now: Timestamp) {
        if self.started.is_none() {
            self.started = Some(now);
            self.issue(now, SpeedStep::STAND);
            self.activity = Activity::Listening { until: now + LISTEN };
        }
    }

    /// Sets turnouts of unknown position straight while the train is at rest. Returns whether there are any; they are
    /// commanded again until they are known.
    fn is_setting_turnouts(&mut self, now: Timestamp) -> bool {
        if !self.settings.sets_turnouts {
            return false;
        }
        let unknown: alloc::vec::Vec<TurnoutId> = self
            .layout
            .turnouts()
            .filter_map(|(turnout, _)| self.turnouts.get(turnout).is_none().then_some(turnout))
            .collect();
        let mut until = now;
        for turnout in &unknown {
            until += THROWN_WITHIN;
            self.requested_turnouts.insert(*turnout, (Leg::Straight, now));
            self.command(Command::Turnout { turnout: *turnout, curved: false });
        }
        if !unknown.is_empty() {
            self.activity = Activity::Listening { until };
        }
        !unknown.is_empty()
    }

    /// Runs the lost train to any sensor.
    pub(super) fn find(&mut self, now: Timestamp) {
        if self.is_setting_turnouts(now) {
            return;
        }
        self.tracker.lose();
        self.locator.lose();
        self.circuit = None;
        self.joins_since = None;
        self.pushes = 0;
        self.pushed_from = None;
        let step = self.finding_step();
        self.issue(now, step);
        self.activity = Activity::Finding { push_at: now + self.push_up_after() };
        self.report_progress(now);
    }

    /// A sensor that does not report the direction reported the lost train: the next ones show where it runs.
    pub(super) fn found_without_direction(&mut self, now: Timestamp) {
        if self.tracker.undecided() >= MOST_UNDECIDED {
            return self.end(now, Ending::NoDirection);
        }
        if matches!(self.activity, Activity::Finding { .. }) {
            self.activity = Activity::Finding { push_at: now + self.push_up_after() };
        }
    }

    fn finding_step(&self) -> SpeedStep {
        let model = self.model();
        let usable = usable_steps(model);
        let slow = |step: &&SpeedStep| model.steady_speed(**step, Approach::Below) <= FINDING_SPEED;
        let known = usable.iter().rev().find(slow).or(usable.first()).copied();
        let stride = model.stride();
        let first = stride * libm::ceil(FINDING_STEP * f64::from(model.highest().get() / stride)) as u8;
        let step = known.or(SpeedStep::new(first)).unwrap_or(model.highest());
        let slower = step.get().saturating_sub(stride * self.slowed_by());
        let slower = slower.max((stride * SLOWEST_STEP).min(step.get()));
        SpeedStep::new(slower).unwrap_or(step)
    }

    /// The number of measured steps by which the train runs slower after reversals. If lengths are unknown, a turnout or the
    /// end of the track may be near, and a slower train needs less distance.
    fn slowed_by(&self) -> u8 {
        if self.layout.is_measured() { 0 } else { self.reversals.min(MAX_REVERSALS) }
    }

    fn max_reversals(&self) -> u8 {
        if self.layout.is_measured() { MAX_REVERSALS } else { 2 * MAX_REVERSALS }
    }

    /// The longest time to the next sensor; longer at a slower step.
    fn push_up_after(&self) -> TimeSpan {
        TimeSpan::from_ns(PUSH_UP_AFTER.as_ns() * i64::from(1 + self.slowed_by()))
    }

    /// No detection for a while: raises the step; reverses the train at the highest one.
    pub(super) fn push_up_to_find(&mut self, now: Timestamp) {
        let highest = self.model().highest();
        let step = self.requested.map_or(self.throttle.step, |(step, _)| step);
        if step < highest {
            let next = self.model().next_knot(step);
            let timeout = if next == highest { GIVE_UP_AFTER } else { PUSH_UP_AFTER };
            self.issue(now, next);
            self.activity = Activity::Finding { push_at: now + timeout };
        } else if self.reversals < self.max_reversals() {
            self.stop_and_reverse(now);
        } else {
            self.end(now, Ending::NotFound);
        }
    }

    /// Stops the train, and reverses it when it is at rest.
    fn stop_and_reverse(&mut self, now: Timestamp) {
        self.reversals = self.reversals.saturating_add(1);
        self.issue(now, SpeedStep::STAND);
        self.activity = Activity::Reversing { at: now + AT_REST_WITHIN };
        self.report_progress(now);
    }

    /// The train has reversed.
    pub(super) fn handle_reversed(&mut self, now: Timestamp, event: &Event) {
        let context = crate::tracking::TrackContext {
            layout: self.layout,
            sections: &self.sections,
            turnouts: &self.turnouts,
        };
        self.fit.take(self.layout, &self.turnouts, event);
        self.locator.handle_command(context, self.fit.model(), event);
        self.tracker.reverse(context);
        if matches!(self.activity, Activity::Reversing { .. }) {
            self.find(now);
        }
    }

    /// Commands the train at rest to reverse.
    pub(super) fn reverse(&mut self, now: Timestamp) {
        self.command(Command::Reverse { train: self.train });
        // Requested again if it is never sent.
        self.activity = Activity::Reversing { at: now + AT_REST_WITHIN };
    }

    /// The train was detected: chooses a circuit from there, or reverses the train.
    pub(super) fn join(&mut self, now: Timestamp, node: NodeId) {
        if !matches!(self.activity, Activity::Joining) {
            self.notify(CalibrationNotice::Found { node, step: self.throttle.step });
        }
        let locked = self.locked(node);
        let circuit = self.best_circuit(node, &locked);
        if let Some(circuit) = circuit {
            self.reversals = 0;
            self.notify(CalibrationNotice::Circuit(circuit.clone()));
            self.circuit = Some(circuit);
            self.activity = Activity::Joining;
            self.throw_turnouts(now, node);
            self.go_on_if_set(now, node);
            return;
        }
        let reach = self.stopping_reach();
        let is_safe = end_within(self.layout, &self.turnouts, node, reach).is_none();
        if is_safe && self.layout.circuit_from(node, &BTreeMap::new(), &self.settings.avoid).is_some() {
            // Only turnouts that are too near prevent it: the next detection shows their positions.
            self.activity = Activity::Joining;
        } else if self.reversals < self.max_reversals() {
            self.notify(CalibrationNotice::TurnsAround { node });
            self.stop_and_reverse(now);
        } else {
            self.end(now, Ending::NoCircuit);
        }
    }

    /// Begins experiments when the train is on its lap and the turnouts ahead are set.
    pub(super) fn go_on_if_set(&mut self, now: Timestamp, node: NodeId) {
        let Some(circuit) = &self.circuit else { return };
        let is_set = self.is_set_ahead(circuit, node);
        if is_set && circuit.lead.is_empty() {
            self.begin_next(now);
        } else if is_set && self.is_on_lap(node) {
            if let Some(circuit) = &mut self.circuit {
                circuit.lead.clear();
            }
            self.begin_next(now);
        }
    }

    /// The train passed a sensor and its turnouts are not set yet: it runs slower after a while, because one that is slow can
    /// be nearer to a turnout that is thrown. In the end the calibration is given up.
    pub(super) fn note_unset(&mut self, now: Timestamp) {
        if !matches!(self.activity, Activity::Joining) {
            return;
        }
        let since = *self.joins_since.get_or_insert(now);
        if now - since >= LONGEST_JOIN {
            self.end(now, Ending::TurnoutsUnset);
        } else if now - since >= SLOWED_AFTER && self.requested.is_none() && !self.layout.is_measured() {
            let stride = self.model().stride();
            let slower = self.throttle.step.get().saturating_sub(stride).max(stride * SLOWEST_STEP);
            if let Some(slower) = SpeedStep::new(slower).filter(|slower| *slower < self.throttle.step) {
                self.issue(now, slower);
            }
        }
    }

    /// Whether the turnouts on the next metres are set for the circuit; those beyond are thrown later.
    fn is_set_ahead(&self, circuit: &Circuit, node: NodeId) -> bool {
        let mut left = SET_AHEAD;
        let hops = path_from(self.layout, circuit, node).filter_map(|id| self.layout.hop(id));
        let near = hops.take_while(|hop| {
            let is_near = left > Length::ZERO;
            left += -hop.length;
            is_near
        });
        near.flat_map(|hop| hop.needs).all(|need| self.turnouts.get(need.turnout) == Some(need.leg))
    }

    fn is_on_lap(&self, node: NodeId) -> bool {
        let lap = self.circuit.as_ref().map_or(&[][..], |circuit| &circuit.lap);
        lap.iter().filter_map(|id| self.layout.hop(*id)).any(|hop| hop.from == node)
    }

    /// Whether the circuit leads ahead from a node.
    pub(super) fn is_on_circuit(&self, node: NodeId) -> bool {
        self.circuit.as_ref().is_some_and(|circuit| path_from(self.layout, circuit, node).next().is_some())
    }

    /// Throws turnouts for the circuit that are not locked by the train. A station throws one after the other, and the train runs on
    /// meanwhile: one that it has reached by then, and needs only when it comes back, waits until the train has passed.
    pub(super) fn throw_turnouts(&mut self, now: Timestamp, node: NodeId) {
        let locked = self.locked(node);
        self.throw_unlocked(now, node, &locked, true);
    }

    /// Throws turnouts for the circuit, but none that is locked or, under a running train, has to wait. Returns how many were
    /// commanded.
    pub(super) fn throw_unlocked(
        &mut self,
        now: Timestamp,
        node: NodeId,
        locked: &BTreeMap<TurnoutId, Option<Leg>>,
        is_running: bool,
    ) -> usize {
        let Some(circuit) = &self.circuit else { return 0 };
        let wanted = wanted_legs(self.layout, circuit, node);
        let mut commanded = 0;
        for (turnout, leg, needed_after) in wanted {
            if self.turnouts.get(turnout) == Some(leg) {
                continue;
            }
            // Its partner in the same place has to be straight first.
            let partner = self.layout.never_curved_with(turnout).filter(|_| leg.is_curved());
            let partner = partner.filter(|partner| self.turnouts.get(*partner) != Some(Leg::Straight));
            let both = || partner.map(|partner| (partner, Leg::Straight)).into_iter().chain([(turnout, leg)]);
            let stays = |(turnout, _): (TurnoutId, Leg)| {
                locked.contains_key(&turnout)
                    || is_running && self.has_to_wait(node, turnout, needed_after, commanded)
            };
            if both().any(stays) {
                continue;
            }
            for (turnout, leg) in both() {
                let requested = self.requested_turnouts.get(&turnout);
                if requested.is_some_and(|(requested, since)| *requested == leg && now - *since < ASK_AGAIN) {
                    continue;
                }
                self.requested_turnouts.insert(turnout, (leg, now));
                self.command(Command::Turnout { turnout, curved: leg.is_curved() });
                commanded += 1;
            }
        }
        commanded
    }

    /// Turnouts that the train occupies or reaches before they have moved, and jammed ones, with their positions.
    pub(super) fn locked(&self, node: NodeId) -> BTreeMap<TurnoutId, Option<Leg>> {
        self.locked_within(node, self.reach_when_thrown(0), self.settings.train_length)
    }

    /// Whether the train has reached a turnout by the time that it is thrown behind so many others, and needs it only later.
    fn has_to_wait(&self, node: NodeId, turnout: TurnoutId, needed_after: Length, behind: usize) -> bool {
        let reach = self.reach_when_thrown(behind);
        let locked = || self.locked_within(node, reach, self.settings.train_length);
        needed_after > reach && locked().contains_key(&turnout)
    }

    /// How far the train runs until a turnout has moved that is thrown behind so many others.
    fn reach_when_thrown(&self, behind: usize) -> Length {
        let within = THROWN_WITHIN + TimeSpan::from_ns(NEXT_THROWN_WITHIN.as_ns() * behind as i64);
        self.fastest_now() * within + MARGIN
    }

    /// The same for a train at rest beyond a node: turnouts under it, within the uncertainty of its position. `None` if that is
    /// unknown.
    pub(super) fn locked_at_rest(
        &self,
        now: Timestamp,
        node: NodeId,
    ) -> Option<BTreeMap<TurnoutId, Option<Leg>>> {
        let located = self.locator.locate(self.context(), self.model(), now)?;
        let is_here = located.at.node == node && located.speed <= Speed::ZERO;
        let margin = 2.0 * located.uncertainty;
        let behind = self.settings.train_length + margin - located.at.distance;
        is_here.then(|| {
            self.locked_within(node, located.at.distance + margin + MARGIN, behind.max(Length::ZERO))
        })
    }

    fn locked_within(&self, node: NodeId, ahead: Length, behind: Length) -> BTreeMap<TurnoutId, Option<Leg>> {
        let mut locked = locked_turnouts(self.layout, &self.turnouts, node, ahead, behind);
        let jammed = self.failures.iter().filter(|(_, failures)| **failures >= JAMMED_AFTER);
        locked.extend(jammed.map(|(turnout, _)| (*turnout, self.turnouts.get(*turnout))));
        locked
    }

    /// An upper bound of the speed.
    fn fastest_now(&self) -> Speed {
        let speed = self.model().speed(self.throttle.step, self.throttle.approach);
        speed.value + speed.uncertainty
    }

    /// An upper bound of the stopping distance from now.
    fn stopping_reach(&self) -> Length {
        let stop = self.model().stop(self.throttle.step, self.throttle.approach);
        stop.distance + 2.0 * stop.doubt + 2.0 * stop.scatter + MARGIN
    }
}
