//! The runs of a train, one after the other: set the turnouts, reverse, run, come to rest.

use crate::control::Notice;
use crate::control::drive::AT_TARGET;
use crate::control::drive::{Aim, Order, Refusal, StopOrder};
use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Landmark, Position, TurnoutNeed};
use crate::units::Length;

use super::dispatched_train::{Purpose, State};
use super::dispatcher::{Dispatcher, LOOK};
use super::itinerary::SHORTEST_RUN;
use super::movement_authority::{MovementAuthority, SLACK, Start};
use super::path::Path;
use super::reservation::Reservation;

/// What could not be done is tried again after this.
const PAUSE: TimeSpan = TimeSpan::from_s(2.0);

/// A journey that could not be begun this many times in a row is given up.
const MOST_WITHDRAWN: u8 = 5;

/// The largest standard deviation of a stop at a destination: two thirds of the stops end within a centimetre.
const SURE: Length = Length::from_mm(10.0);

/// How far a train runs ahead so that a sensor reports it: a little more than the shortest run.
const AHEAD_TO_BE_SEEN: Length = Length::from_mm(220.0);

/// A train that was stopped on the way goes on after this.
const AFTER_HALT: TimeSpan = TimeSpan::from_s(1.0);

/// A train stopped no further than this from its destination has arrived: to come nearer it would have to leave first.
const NEAR_ENOUGH: Length = Length::from_mm(80.0);

impl Dispatcher {
    /// Takes the next step of every train.
    pub(super) fn go_on(&mut self, now: Timestamp) {
        let ids: alloc::vec::Vec<TrainId> = self.trains.keys().copied().collect();
        for id in ids {
            let Some(state) = self.trains.get(&id).map(|train| train.state) else { continue };
            match state {
                State::Setting { .. } if self.set(now, id) => self.depart(now, id),
                State::Halting { confirmed, .. } if self.watchdog.driver().is_at_rest(id, now) => {
                    self.halted(now, id, confirmed);
                }
                State::Lost
                    if self.watchdog.driver().is_at_rest(id, now)
                        && self.watchdog.driver().position(id, now).is_some() =>
                {
                    self.halted(now, id, true);
                }
                State::Lost if self.watchdog.driver().position(id, now).is_some() => {
                    self.found_by_hand(now, id);
                }
                State::Lost if self.is_forgotten(now, id) => self.watchdog.lose(now, id),
                State::ByHand if !self.rest_by_hand(now, id) => self.drive_by_hand(now, id),
                State::Resting
                    if self.is_somewhere(id)
                        && self.watchdog.driver().position(id, now).is_none()
                        && !self.unknown_turnout_ahead(now, id).is_some_and(|unknown| unknown.is_clear) =>
                {
                    self.set_state(id, State::Lost);
                    self.say(Notice::ReservedAsUnknown { train: id });
                }
                _ => {}
            }
        }
    }

    /// Whether a train is lost and nothing looks for it.
    fn is_forgotten(&self, now: Timestamp, id: TrainId) -> bool {
        self.watchdog.is_watching()
            && !self.watchdog.is_in_danger(id)
            && self.watchdog.driver().locate(id, now).is_none()
    }

    /// A sensor did not report a train where it should have, and no path leads to where one could: the watchdog locates it
    /// again; without one, a person has to say where it is.
    pub(super) fn lose(&mut self, now: Timestamp, id: TrainId) {
        self.watchdog.lose(now, id);
        self.set_state(id, State::Lost);
        self.say(Notice::ReservedAsUnknown { train: id });
    }

    /// A train reverses: no sensor has reported it since.
    pub(super) fn note_turned(&mut self, id: TrainId) {
        if let Some(train) = self.trains.get_mut(&id) {
            train.seen_since_turn = false;
        }
    }

    /// A sensor did not report a train where it should have, and ahead of it there is no path. Returns whether the train looks
    /// back from now on: the sensor that reported it last reports it again, wherever it is in between. A train that no
    /// sensor has reported since it reversed may not have left at all, and the track behind it may end soon.
    pub(super) fn begins_to_look_back(&mut self, id: TrainId) -> bool {
        let Some(train) = self.trains.get_mut(&id).filter(|train| train.seen_since_turn) else {
            return false;
        };
        self.is_stirred = true;
        train.looked_at = Timestamp::ZERO;
        !core::mem::replace(&mut train.looks_back, true)
    }

    /// Sends a train that a sensor did not report a short distance ahead on its edge, where the track allows it: one that
    /// came to rest short of the sensor is reported then. Returns whether it goes; once until a sensor reports it.
    pub(super) fn looks_ahead(&mut self, now: Timestamp, id: TrainId, start: &Start) -> bool {
        let has_looked = self
            .trains
            .get_mut(&id)
            .is_none_or(|train| core::mem::replace(&mut train.has_looked_ahead, true));
        let target = Position { offset: start.place.offset + AHEAD_TO_BE_SEEN, ..start.place };
        let proposal = self.propose(start, &[target], &self.obstacles_of_others(id));
        let Some(proposal) = proposal.filter(|found| !has_looked && self.is_free(id, found)) else {
            return false;
        };
        self.grant(now, id, Purpose::Aside(id), proposal);
        true
    }

    fn is_somewhere(&self, id: TrainId) -> bool {
        self.trains.get(&id).is_some_and(|train| !train.held.is_empty())
    }

    /// The turnouts lie for the next run: reverses, or runs.
    fn depart(&mut self, now: Timestamp, id: TrainId) {
        let Some(run) = self.trains.get(&id).and_then(|train| train.course.front()) else { return };
        if run.turns {
            if let Some(need) = self.missing_to_turn(now, id) {
                return self.need_more(now, id, need);
            }
            let turn = Order::Reverse { train: id, then: crate::ids::SpeedStep::STAND };
            match self.watchdog.order(now, turn) {
                Ok(order) => {
                    self.set_state(id, State::Turning { order });
                    self.note_turned(id);
                }
                Err(why) => self.withdraw(now, id, Some(why)),
            }
        } else {
            self.run(now, id);
        }
    }

    /// How the turnout behind a train has to lie so that its place can be counted from there once it has reversed. It may be
    /// on another edge than planned.
    fn missing_to_turn(&self, now: Timestamp, id: TrainId) -> Option<TurnoutNeed> {
        let turned = self.watchdog.driver().reversed_position(id, now)?;
        let lies = |need: &TurnoutNeed| self.watchdog.driver().turnouts().get(need.turnout) == Some(need.leg);
        self.watchdog.driver().layout().needs_of(turned.edge).find(|need| need.facing && !lies(need))
    }

    /// Adds a turnout to a run, unless another train has reserved it.
    fn need_more(&mut self, now: Timestamp, id: TrainId, need: TurnoutNeed) {
        let is_held = self.trains.values().any(|other| other.id != id && other.held.takes(need.turnout));
        let layout = self.watchdog.driver().layout();
        let run = self.trains.get_mut(&id).and_then(|train| train.course.front_mut());
        let Some(run) = run.filter(|run| !is_held && !run.needs.contains(&need)) else {
            return self.withdraw(now, id, None);
        };
        run.needs.retain(|known| known.turnout != need.turnout);
        run.needs.push(need);
        run.taken.take_turnout(layout, need.turnout);
        self.set_state(id, State::Setting { ready: None, since: now });
        self.hold(now, id);
    }

    /// Begins the run itself.
    pub(super) fn run(&mut self, now: Timestamp, id: TrainId) {
        let Some(train) = self.trains.get(&id) else { return };
        let Some(run) = train.course.front() else { return };
        let room = self.room(now, train);
        let located = self.watchdog.driver().locate(id, now);
        let place = self.watchdog.driver().position(id, now);
        let from = run.start - room.behind;
        let found = located.zip(place).and_then(|(located, place)| {
            let at = run.path.find(place, from)?;
            let limit = run.path.place(run.limit)?;
            let limit = self.watchdog.driver().way_point_ahead(id, located.at, limit)?;
            let stop = run.path.place(run.stop)?;
            let direct = self.watchdog.driver().way_point(id, located.at.node, stop)?.way - located.at.way;
            // The path may lead round to where it is already.
            let next_round = direct > -AT_TARGET && run.stop - at > direct + SHORTEST_RUN;
            (limit.way > located.at.way).then_some((at, limit, (stop, next_round)))
        });
        let run_begin = run.begin;
        let Some((at, limit, (stop, next_round))) = found else { return self.withdraw(now, id, None) };
        let layout = self.watchdog.driver().layout();
        let Some(edge) = layout.edge(stop.edge) else { return self.withdraw(now, id, None) };
        let target = Landmark { node: edge.from, offset: stop.offset };
        let is_last = train.course.len() == 1 && train.purpose == Purpose::Journey;
        let aim = train.asked.filter(|_| is_last).map_or(Aim::Median, |asked| asked.journey.aim);
        // Where a train only reverses or waits, time counts more than millimetres.
        let step = self.step_for(id, run.stop - at, |spread| !is_last || spread <= SURE);
        let stop = StopOrder { train: id, target, aim, step, next_round };
        self.watchdog.set_end_of_authority(now, id, Some(limit));
        let taken = self.watchdog.order(now, Order::Stop(stop));
        let retried = |_| self.watchdog.order(now, Order::Stop(StopOrder { step: None, ..stop }));
        match if step.is_some() { taken.or_else(retried) } else { taken } {
            Ok(order) => {
                // It has not moved since, however uncertain reversing makes its place.
                let rear = (at - room.behind).max(run_begin);
                self.set_state(id, State::Running { order, rear, confirmed: false });
                if let Some(train) = self.trains.get_mut(&id) {
                    train.withdrawn = 0;
                    train.seen_since_start = false;
                }
                self.hold(now, id);
            }
            Err(why) => self.withdraw(now, id, Some(why)),
        }
    }

    /// A run has ended where it should.
    pub(super) fn run_ended(&mut self, now: Timestamp, id: TrainId, unseen: bool, error: Option<Length>) {
        let Some(train) = self.trains.get_mut(&id) else { return };
        let State::Running { rear, confirmed, .. } = train.state else { return };
        let gave_way = self.is_on_points_that_gave_way(now, id);
        let Some(train) = self.trains.get_mut(&id) else { return };
        let confirmed = confirmed && !unseen && !self.watchdog.driver().is_position_ambiguous(id);
        let ended = train.course.pop_front();
        if unseen && !train.course.is_empty() {
            // It is not where it should be, so the runs planned from there do not hold.
            return self.halted(now, id, false);
        }
        let turns_next = train.course.front().is_some_and(|run| run.turns);
        if turns_next && gave_way {
            return self.halted(now, id, confirmed);
        }
        if train.course.is_empty() {
            train.state = State::Resting;
            self.watchdog.set_end_of_authority(now, id, None);
            self.rest(now, id, rear, confirmed.then_some(ended).flatten());
            self.arrived(now, id, error);
        } else {
            train.state = State::Setting { ready: None, since: now };
            train.skipped.clear();
            // It may still be on the path of this run, unless a sensor said otherwise.
            if let (false, Some(run)) = (confirmed, ended) {
                let layout = self.watchdog.driver().layout();
                train.kept.add(layout, &run.taken);
            }
            self.hold(now, id);
        }
        self.is_stirred = true;
    }

    /// A train that was commanded to stop stands.
    pub(super) fn halted(&mut self, now: Timestamp, id: TrainId, confirmed: bool) {
        let is_sure = self.watchdog.driver().position(id, now).is_some();
        if let Some(train) = self.trains.get_mut(&id) {
            train.course.clear();
            train.state = if is_sure { State::Resting } else { State::Lost };
            train.waits_said = false;
            train.purpose = Purpose::Journey;
            train.not_before = now + AFTER_HALT;
            train.unobstructed_s = None;
        }
        self.watchdog.set_end_of_authority(now, id, None);
        if !is_sure {
            self.say(Notice::ReservedAsUnknown { train: id });
        } else if confirmed {
            self.stand(now, id);
        }
        self.forgive(now, id);
        self.is_stirred = true;
    }

    /// A train that was stopped on its last run and rests near its destination has arrived.
    fn forgive(&mut self, now: Timestamp, id: TrainId) {
        let Some(run) = self.trains.get_mut(&id).and_then(|train| train.last_run.take()) else { return };
        let Some(rest) = self.watchdog.driver().position(id, now) else { return };
        let error = run.path.find(rest, run.start).map(|at| at - run.stop);
        if let Some(error) = error.filter(|error| error.abs() <= NEAR_ENOUGH) {
            self.arrived(now, id, Some(error));
        }
    }

    /// Whether a train at rest is on a turnout that lies for another leg than it came from: it trailed the points.
    pub(super) fn is_on_points_that_gave_way(&self, now: Timestamp, id: TrainId) -> bool {
        let place = self.watchdog.driver().position(id, now);
        let Some((train, place)) = self.trains.get(&id).zip(place) else { return false };
        let room = self.room(now, train);
        let (layout, turnouts) = (self.watchdog.driver().layout(), self.watchdog.driver().turnouts());
        let (path, at) = Path::around(layout, turnouts, place, &train.came, room.behind, room.ahead);
        let mut trailed = path.trailed(layout, at - room.behind, at + room.ahead);
        trailed.any(|need| turnouts.get(need.turnout) != Some(need.leg))
    }

    /// Releases the track that a train at rest at the end of its run is certainly not on. Without a run that a sensor has
    /// confirmed it keeps its whole reservation.
    fn rest(&mut self, now: Timestamp, id: TrainId, rear: Length, ended: Option<MovementAuthority>) {
        if ended.is_some() {
            self.free_anchors(now, id);
        }
        let Some((train, run)) = self.trains.get(&id).zip(ended) else { return };
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let room = self.room(now, train);
        // The path may lead round to where it began.
        let Some(at) = run.path.find(place, rear) else { return };
        let layout = self.watchdog.driver().layout();
        // Released track may be reserved for another train by now.
        let from = (at - room.behind).max(rear);
        let mut held = self.reserved(run.path.reservation(layout, from, (at + room.ahead).min(run.end)));
        self.take_anchors(now, id, place, &mut held);
        let is_free = self.is_free_for(id, &held);
        if let Some(train) = self.trains.get_mut(&id).filter(|_| is_free) {
            train.held = held;
            train.kept = Reservation::empty();
        }
    }

    /// Withdraws the authority of a train at rest.
    pub(super) fn withdraw(&mut self, now: Timestamp, id: TrainId, why: Option<Refusal>) {
        // The next path begins with the turnouts as they lie under it.
        let is_in_its_own_way = why.as_ref().and_then(Refusal::occupier) == Some(id);
        if let Some(train) = self.trains.get_mut(&id) {
            train.course.clear();
            train.state = State::Resting;
            train.purpose = Purpose::Journey;
            train.withdrawn = train.withdrawn.saturating_add(1);
            train.not_before = now + if is_in_its_own_way { LOOK } else { PAUSE };
        }
        self.watchdog.set_end_of_authority(now, id, None);
        self.hold_again(now, id);
        self.say(Notice::Withdrawn { train: id, why });
        if self.trains.get_mut(&id).is_some_and(|train| train.withdrawn >= MOST_WITHDRAWN) {
            self.give_up_journey(id, self.unreachable(id));
        }
    }

    /// Ends a journey that cannot be carried out.
    pub(super) fn give_up_journey(&mut self, id: TrainId, why: Refusal) {
        let Some(train) = self.trains.get_mut(&id) else { return };
        train.withdrawn = 0;
        if let Some(asked) = train.asked.take() {
            self.say(Notice::GivenUp { order: asked.order, train: id, why });
        }
    }

    /// Restores the reservation of a train at rest that does not go, with the track under it, as it may have reversed.
    fn hold_again(&mut self, now: Timestamp, id: TrainId) {
        let kept = self.trains.get_mut(&id).map(|train| core::mem::take(&mut train.kept));
        self.stand(now, id);
        let layout = self.watchdog.driver().layout();
        if let (Some(train), Some(kept)) = (self.trains.get_mut(&id), kept) {
            train.held.add(layout, &kept);
        }
    }

    /// Reports that a train has come to its destination.
    pub(super) fn arrived(&mut self, now: Timestamp, id: TrainId, error: Option<Length>) {
        let Some(train) = self.trains.get_mut(&id) else { return };
        train.purpose = Purpose::Journey;
        let granted_for = train.granted_for.take();
        if let Some(asked) = train.asked.take_if(|asked| Some(asked.order) == granted_for) {
            let took = now - asked.since;
            train.caution = 1.0;
            self.say(Notice::Arrived { order: asked.order, train: id, error, took });
        }
    }

    /// Reserves the track of the runs of a train, from where its rear end certainly is.
    pub(super) fn hold(&mut self, now: Timestamp, id: TrainId) {
        let Some(train) = self.trains.get(&id) else { return };
        let layout = self.watchdog.driver().layout();
        let mut held = train.kept.clone();
        for (nth, run) in train.course.iter().enumerate() {
            match train.state {
                State::Running { rear, confirmed, .. } if nth == 0 => {
                    let from = if confirmed { rear } else { rear.max(run.taken_from) };
                    held.add(layout, &self.reserved(run.takes_beyond(layout, from)));
                }
                _ => held.add(layout, &run.taken),
            }
        }
        if let Some(place) = self.watchdog.driver().position(id, now) {
            self.take_anchors(now, id, place, &mut held);
        }
        if let Some(train) = self.trains.get_mut(&id)
            && train.held != held
        {
            train.held = held;
            self.is_stirred = true;
        }
    }

    /// A sensor has reported a running train: releases the track behind it. Returns whether the sensor is on its path.
    pub(super) fn confirmed_at(&mut self, now: Timestamp, id: TrainId, contact: crate::ids::NodeId) -> bool {
        let Some(train) = self.trains.get(&id) else { return true };
        let State::Running { order, rear, .. } = train.state else { return true };
        let Some(run) = train.course.front() else { return true };
        let layout = self.watchdog.driver().layout();
        let Some(at) = run.path.find_node(layout, contact, rear) else { return false };
        // Another train may have caused the detection, or none.
        if self.watchdog.driver().is_position_ambiguous(id) {
            return true;
        }
        let rear = rear.max(at - train.lengths.behind() - SLACK);
        // Near its start it keeps the track that it stood on.
        let body = self.reserved(run.takes_beyond(layout, rear));
        if rear < run.taken_from && !self.is_free_for(id, &body) {
            return true;
        }
        if let Some(train) = self.trains.get_mut(&id) {
            train.state = State::Running { order, rear, confirmed: true };
            train.kept = Reservation::empty();
        }
        self.hold(now, id);
        true
    }
}
