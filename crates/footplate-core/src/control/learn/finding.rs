//! Finding the train, turning it around if it faces nowhere, and getting it onto a circuit.

use alloc::collections::BTreeMap;

use super::accuracy::usable_steps;
use super::activity::Activity;
use super::calibrator::Calibrator;
use super::notice::{CalibrationNotice, Ending};
use super::points::{end_within, held_turnouts, wanted_legs, way_from};
use crate::event::{Approach, Command, Event};
use crate::ids::{NodeId, SpeedStep, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Circuit, Leg};
use crate::units::{Length, Speed};

/// Contacts that hang report within this, with every module polled.
const LISTEN: TimeSpan = TimeSpan::from_ms(700);

/// Without a contact for this long a train that is looked for is pushed up a step.
const PUSH_UP_AFTER: TimeSpan = TimeSpan::from_ms(4_000);

/// At the highest step it should meet a contact within this; otherwise it stands against something.
const GIVE_UP_AFTER: TimeSpan = TimeSpan::from_ms(8_000);

/// A train that is looked for runs about this fast, if it is known: slow enough to stop in time, fast enough to get on.
const FINDING_SPEED: Speed = Speed::from_mm_per_s(180.0);

/// The part of all steps at which most trains move and none is fast (the published tables: step 5 of 14).
const FINDING_STEP: f64 = 0.36;

/// No slower than this: below it many trains stall (the published tables).
const SLOWEST_STEP: u8 = 3;

/// Turned around this often without getting onto a circuit, a train cannot be calibrated where it is.
const MOST_TURNS: u8 = 3;

/// A turnout moves within this, and the command before it has left within that.
const THROWN_WITHIN: TimeSpan = TimeSpan::from_ms(700);

/// Experiments begin when the turnouts lie right on so much of the way: the longest stop and the hop before it.
const SET_AHEAD: Length = Length::from_mm(2_500.0);

/// A turnout that was found on the wrong leg this often is taken as it lies.
const JAMMED_AFTER: u8 = 2;

/// Added to every way that must be clear.
const MARGIN: Length = Length::from_mm(100.0);

/// A turnout that was asked for is asked for again after this.
const ASK_AGAIN: TimeSpan = TimeSpan::from_ms(3_000);

/// An unknown train stands within this after it was told to (the longest of the published stops).
const STANDS_WITHIN: TimeSpan = TimeSpan::from_ms(5_000);

impl Calibrator<'_> {
    /// The first words.
    pub(super) fn begin(&mut self, now: Timestamp) {
        if self.started.is_none() {
            self.started = Some(now);
            self.issue(now, SpeedStep::STAND);
            self.activity = Activity::Listening { until: now + LISTEN };
        }
    }

    /// Sends the train to wherever a contact is.
    pub(super) fn find(&mut self, now: Timestamp) {
        self.tracker.lose();
        self.locator.lose();
        self.circuit = None;
        self.pushes = 0;
        self.pushed_from = None;
        let step = self.finding_step();
        self.issue(now, step);
        self.activity = Activity::Finding { push_at: now + self.push_up_after() };
        self.say_progress(now);
    }

    fn finding_step(&self) -> SpeedStep {
        let model = self.model();
        let usable = usable_steps(model);
        let slow = |step: &&SpeedStep| model.speed(**step, Approach::Below).value <= FINDING_SPEED;
        let known = usable.iter().rev().find(slow).or(usable.first()).copied();
        let stride = model.stride();
        let first = stride * libm::ceil(FINDING_STEP * f64::from(model.highest().get() / stride)) as u8;
        let step = known.or(SpeedStep::new(first)).unwrap_or(model.highest());
        let slower = step.get().saturating_sub(stride * self.slowed_by());
        let slower = slower.max((stride * SLOWEST_STEP).min(step.get()));
        SpeedStep::new(slower).unwrap_or(step)
    }

    /// By how many measured steps slower it runs after it was turned around. Where lengths are unknown, a turnout or the end of the
    /// track may be near; a slower train needs less room for either.
    fn slowed_by(&self) -> u8 {
        if self.layout.is_measured() { 0 } else { self.turns.min(MOST_TURNS) }
    }

    fn most_turns(&self) -> u8 {
        if self.layout.is_measured() { MOST_TURNS } else { 2 * MOST_TURNS }
    }

    /// How long it may take to the next contact; longer at a slower step.
    fn push_up_after(&self) -> TimeSpan {
        TimeSpan::from_ns(PUSH_UP_AFTER.as_ns() * i64::from(1 + self.slowed_by()))
    }

    /// No contact for a while: up a step; at the highest the other way.
    pub(super) fn push_up_to_find(&mut self, now: Timestamp) {
        let highest = self.model().highest();
        let step = self.asked.map_or(self.stance.step, |(step, _)| step);
        if step < highest {
            let next = self.model().next_knot(step);
            let patience = if next == highest { GIVE_UP_AFTER } else { PUSH_UP_AFTER };
            self.issue(now, next);
            self.activity = Activity::Finding { push_at: now + patience };
        } else if self.turns < self.most_turns() {
            self.turn_around(now);
        } else {
            self.end(now, Ending::NotFound);
        }
    }

    /// Stops the train, to turn it around when it stands.
    fn turn_around(&mut self, now: Timestamp) {
        self.turns = self.turns.saturating_add(1);
        self.issue(now, SpeedStep::STAND);
        self.activity = Activity::Turning { at: now + STANDS_WITHIN };
        self.say_progress(now);
    }

    /// The train has been turned around: it faces where it came from.
    pub(super) fn handle_turned(&mut self, now: Timestamp, event: &Event) {
        let context = crate::tracking::TrackContext {
            layout: self.layout,
            sections: &self.sections,
            turnouts: &self.turnouts,
        };
        self.fit.take(self.layout, &self.turnouts, event);
        self.locator.handle_command(context, self.fit.model(), event);
        if matches!(self.activity, Activity::Turning { .. }) {
            self.find(now);
        }
    }

    /// The command to turn around, once the train stands.
    pub(super) fn turn(&mut self, now: Timestamp) {
        self.command(Command::Reverse { train: self.train });
        // If it never leaves, it is asked for again.
        self.activity = Activity::Turning { at: now + STANDS_WITHIN };
    }

    /// A contact told where the train is: chooses a circuit from there, or turns it around.
    pub(super) fn join(&mut self, now: Timestamp, node: NodeId) {
        if !matches!(self.activity, Activity::Joining) {
            self.say(CalibrationNotice::Found { node, step: self.stance.step });
        }
        let held = self.held(node);
        let circuit = self.circuit_worth_most(node, &held);
        if let Some(circuit) = circuit {
            self.turns = 0;
            self.say(CalibrationNotice::Circuit(circuit.clone()));
            self.circuit = Some(circuit);
            self.activity = Activity::Joining;
            self.throw_turnouts(now, node);
            self.go_on_if_set(now, node);
            return;
        }
        let reach = self.stopping_reach();
        let is_safe = end_within(self.layout, &self.turnouts, node, reach).is_none();
        if is_safe && self.layout.circuit_from(node, &BTreeMap::new(), &self.settings.avoid).is_some() {
            // Only turnouts that are too near are in the way: the next contact tells how they lie.
            self.activity = Activity::Joining;
        } else if self.turns < self.most_turns() {
            self.say(CalibrationNotice::TurnsAround { node });
            self.turn_around(now);
        } else {
            self.end(now, Ending::NoCircuit);
        }
    }

    /// Goes on to experiments when the train is on its lap and the turnouts ahead lie right, as far as they can be
    /// thrown by now.
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

    /// Whether the turnouts on the next metres lie as the circuit needs them; those behind are thrown in passing.
    fn is_set_ahead(&self, circuit: &Circuit, node: NodeId) -> bool {
        let mut left = SET_AHEAD;
        let hops = way_from(self.layout, circuit, node).filter_map(|id| self.layout.hop(id));
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

    /// Whether the circuit leads on from a node.
    pub(super) fn is_on_circuit(&self, node: NodeId) -> bool {
        self.circuit.as_ref().is_some_and(|circuit| way_from(self.layout, circuit, node).next().is_some())
    }

    /// Throws what the circuit wants otherwise, where the train is not and will not be in time.
    pub(super) fn throw_turnouts(&mut self, now: Timestamp, node: NodeId) {
        let Some(circuit) = &self.circuit else { return };
        let wanted = wanted_legs(self.layout, circuit, node);
        let held = self.held(node);
        let mut throws: alloc::vec::Vec<(TurnoutId, Leg)> = alloc::vec::Vec::new();
        for (turnout, leg) in wanted {
            if held.contains_key(&turnout) || self.turnouts.get(turnout) == Some(leg) {
                continue;
            }
            // Its partner in the same place has to lie straight first.
            let partner = self.layout.never_curved_with(turnout).filter(|_| leg.is_curved());
            let in_the_way = partner.filter(|partner| self.turnouts.get(*partner) != Some(Leg::Straight));
            throws.extend(in_the_way.map(|partner| (partner, Leg::Straight)));
            throws.push((turnout, leg));
        }
        for (turnout, leg) in throws {
            let asked = self.asked_turnouts.get(&turnout);
            if asked.is_some_and(|(asked, since)| *asked == leg && now - *since < ASK_AGAIN) {
                continue;
            }
            self.asked_turnouts.insert(turnout, (leg, now));
            self.command(Command::Turnout { turnout, curved: leg.is_curved() });
        }
    }

    /// Turnouts that the train is on, or reaches before they would have moved, and those that do not move at all.
    pub(super) fn held(&self, node: NodeId) -> BTreeMap<TurnoutId, Option<Leg>> {
        // Turnouts move one after the other: the last of a handful does so after as many times.
        let ahead = self.fastest_now() * THROWN_WITHIN + MARGIN;
        let mut held = held_turnouts(self.layout, &self.turnouts, node, ahead, self.settings.train_length);
        let jammed = self.failures.iter().filter(|(_, failures)| **failures >= JAMMED_AFTER);
        held.extend(jammed.map(|(turnout, _)| (*turnout, self.turnouts.get(*turnout))));
        held
    }

    /// The speed that the train has at most, as far as is known.
    fn fastest_now(&self) -> Speed {
        let speed = self.model().speed(self.stance.step, self.stance.approach);
        speed.value + speed.uncertainty
    }

    /// The way within which the train would surely stand if it were commanded to stop now.
    fn stopping_reach(&self) -> Length {
        let stop = self.model().stop(self.stance.step, self.stance.approach);
        stop.distance + 2.0 * stop.doubt + 2.0 * stop.scatter + MARGIN
    }
}
