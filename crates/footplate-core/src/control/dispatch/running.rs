//! The runs of a train, one after the other: set the turnouts, reverse, run, stop.

use crate::control::Notice;
use crate::control::drive::AT_TARGET;
use crate::control::drive::{Aim, Order, Refusal, StopOrder};
use crate::estimate::HALF_95;
use crate::ids::{SpeedStep, TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Landmark, Position, TurnoutNeed};
use crate::units::Length;

use super::dispatched_train::{Purpose, State};
use super::dispatcher::{ACT_EVERY, Dispatcher};
use super::itinerary::SHORTEST_RUN;
use super::movement_authority::{ClearanceEnvelope, MovementAuthority, SLACK, Start};
use super::path::Path;
use super::reservation::Reservation;

/// A withdrawn authority is tried again after this time.
const PAUSE: TimeSpan = TimeSpan::from_s(2.0);

/// A journey whose authority was withdrawn this many times in a row is given up.
const MAX_WITHDRAWN: u8 = 5;

/// The largest standard deviation of a stop at a destination: two thirds of the stops end within a centimetre.
const SURE: Length = Length::from_mm(10.0);

/// A train runs this far ahead to be detected: a little more than the shortest run.
const AHEAD_TO_BE_DETECTED: Length = Length::from_mm(220.0);

/// A train that was stopped on its run starts again after this time.
const RESTART_AFTER: TimeSpan = TimeSpan::from_s(1.0);

/// A train that was stopped this close to its destination has arrived: to come closer it would have to leave first.
const NEAR_ENOUGH: Length = Length::from_mm(80.0);

/// A run that ends this far from its destination was planned from a wrong position: the train has not arrived. The most cautious
/// stop, five standard deviations of 5 cm before its target, is nearer.
pub(super) const FAR: Length = Length::from_mm(500.0);

impl Dispatcher {
    /// Advances every train.
    pub(super) fn advance_trains(&mut self, now: Timestamp) {
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
                State::Lost if self.is_unattended(now, id) => self.watchdog.lose(now, id),
                State::Resting if self.is_to_be_located(now, id) => self.lose(now, id),
                State::ByHand if !self.rest_by_hand(now, id) => self.drive_by_hand(now, id),
                State::Resting if self.is_resolved_at_rest(now, id) => self.reserve_standstill(now, id),
                State::Resting
                    if self.has_reservation(id)
                        && self.watchdog.driver().position(id, now).is_none()
                        && !self.unknown_turnout_ahead(now, id).is_some_and(|unknown| unknown.is_clear) =>
                {
                    self.set_state(id, State::Lost);
                    self.notify(Notice::ReservedAsUnknown { train: id });
                }
                _ => {}
            }
        }
    }

    /// Whether a train has arrived while its position depended on an ambiguous detection, and no longer does.
    fn is_resolved_at_rest(&mut self, now: Timestamp, id: TrainId) -> bool {
        let driver = self.watchdog.driver();
        let is_certain = !driver.is_position_ambiguous(id, now)
            && driver.missed_sensor(id, now).is_none()
            && driver.position(id, now).is_some();
        let known = self.trains.get_mut(&id).filter(|_| is_certain);
        known.is_some_and(|train| core::mem::take(&mut train.ambiguous_at_rest))
    }

    /// Whether a train is lost, and neither a recovery searches for it nor an operator runs it over a sensor.
    fn is_unattended(&self, now: Timestamp, id: TrainId) -> bool {
        self.watchdog.is_watching()
            && !self.watchdog.is_in_danger(id)
            && self.watchdog.driver().locate(id, now).is_none()
            && self.watchdog.driver().commanded(id) == SpeedStep::STAND
    }

    /// Whether the position of a train at rest is too uncertain to run it, and nothing locates it yet.
    fn is_to_be_located(&self, now: Timestamp, id: TrainId) -> bool {
        self.watchdog.is_watching()
            && !self.watchdog.is_in_danger(id)
            && self.watchdog.driver().missed_sensor(id, now).is_none()
            && self.is_too_uncertain(now, id)
    }

    /// Gives up the position of a train that a sensor did not report, if no path leads to a sensor: the watchdog
    /// locates it again; without a watchdog, an operator has to enter its position.
    pub(super) fn lose(&mut self, now: Timestamp, id: TrainId) {
        self.watchdog.lose(now, id);
        self.set_state(id, State::Lost);
        self.notify(Notice::ReservedAsUnknown { train: id });
    }

    /// A train reversed: no sensor has reported it since.
    pub(super) fn note_reversal(&mut self, id: TrainId) {
        if let Some(train) = self.trains.get_mut(&id) {
            train.detected_since_reversal = false;
        }
    }

    /// Lets a train that a sensor did not report, and that has no path ahead, run back: the sensor that reported it
    /// last reports it again, wherever it is in between. Returns `false` if it may do so already, or if no sensor has
    /// reported it since it reversed: it may not have started at all, and the track behind it may end soon.
    pub(super) fn look_back(&mut self, id: TrainId) -> bool {
        let Some(train) = self.trains.get_mut(&id).filter(|train| train.detected_since_reversal) else {
            return false;
        };
        self.has_changed = true;
        train.examined_at = Timestamp::ZERO;
        !core::mem::replace(&mut train.looks_back, true)
    }

    /// Sends a train that a sensor did not report a short distance ahead on its edge, if the track is free: if it
    /// stopped short of the sensor, the sensor reports it then. Returns whether it runs; only once between two
    /// detections.
    pub(super) fn look_ahead(&mut self, now: Timestamp, id: TrainId, start: &Start) -> bool {
        let has_looked = self
            .trains
            .get_mut(&id)
            .is_none_or(|train| core::mem::replace(&mut train.has_looked_ahead, true));
        let target = Position { offset: start.place.offset + AHEAD_TO_BE_DETECTED, ..start.place };
        let proposal = self.propose(start, &[target], &self.obstacles_of_others(id));
        let Some(proposal) = proposal.filter(|found| !has_looked && self.is_free(id, found)) else {
            return false;
        };
        self.grant(now, id, Purpose::Aside(id), proposal);
        true
    }

    fn has_reservation(&self, id: TrainId) -> bool {
        self.trains.get(&id).is_some_and(|train| !train.reservation.is_empty())
    }

    /// The turnouts are set for the next run: reverses the train, or starts the run.
    fn depart(&mut self, now: Timestamp, id: TrainId) {
        let Some(run) = self.trains.get(&id).and_then(|train| train.authorities.front()) else { return };
        if run.reverses {
            if let Some(need) = self.watchdog.driver().missing_for_reversal(now, id) {
                return self.need_more(now, id, need);
            }
            let turn = Order::Reverse { train: id, then: SpeedStep::STAND };
            match self.watchdog.order(now, turn) {
                Ok(order) => {
                    self.set_state(id, State::Reversing { order });
                    self.note_reversal(id);
                }
                Err(why) => self.withdraw(now, id, Some(why)),
            }
        } else {
            self.run(now, id);
        }
    }

    /// Adds a turnout to a run, unless another train has reserved it.
    fn need_more(&mut self, now: Timestamp, id: TrainId, need: TurnoutNeed) {
        let is_held =
            self.trains.values().any(|other| other.id != id && other.reservation.takes(need.turnout));
        let layout = self.watchdog.driver().layout();
        let run = self.trains.get_mut(&id).and_then(|train| train.authorities.front_mut());
        let Some(run) = run.filter(|run| !is_held && !run.needs.contains(&need)) else {
            return self.withdraw(now, id, None);
        };
        run.needs.retain(|known| known.turnout != need.turnout);
        run.needs.push(need);
        run.taken.take_turnout(layout, need.turnout);
        self.set_state(id, State::Setting { ready: None, since: now });
        self.reserve_runs(now, id);
    }

    /// Starts a run.
    pub(super) fn run(&mut self, now: Timestamp, id: TrainId) {
        let Some(train) = self.trains.get(&id) else { return };
        let Some(run) = train.authorities.front() else { return };
        let envelope = self.envelope(now, train);
        let located = self.watchdog.driver().locate(id, now);
        let place = self.watchdog.driver().position(id, now);
        let from = run.start - envelope.behind;
        let found = located.zip(place).and_then(|(located, place)| {
            let at = run.path.find(place, from)?;
            let limit = run.path.place(run.limit)?;
            let limit = self.watchdog.driver().path_point_ahead(id, located.at, limit, run.limit - at)?;
            let stop = run.path.place(run.stop)?;
            let direct =
                self.watchdog.driver().path_point(id, located.at.node, stop)?.distance - located.at.distance;
            // The path may lead round a circuit to the present place.
            let next_round = direct > -AT_TARGET && run.stop - at > direct + SHORTEST_RUN;
            Some((at, limit, (stop, next_round)))
        });
        let run_begin = run.begin;
        let Some((at, limit, (stop, next_round))) = found else { return self.withdraw(now, id, None) };
        let layout = self.watchdog.driver().layout();
        let Some(edge) = layout.edge(stop.edge) else { return self.withdraw(now, id, None) };
        let target = Landmark { node: edge.from, offset: stop.offset };
        let is_last = train.authorities.len() == 1 && train.purpose == Purpose::Journey;
        let aim = train.assigned.filter(|_| is_last).map_or(Aim::Median, |assigned| assigned.journey.aim);
        // If a train only reverses or waits at the stop, time counts more than precision.
        let step = self.step_for(id, run.stop - at, |spread| !is_last || spread <= SURE);
        let stop = StopOrder { train: id, target, aim, step, next_round };
        self.watchdog.set_end_of_authority(now, id, Some(limit));
        let taken = self.watchdog.order(now, Order::Stop(stop));
        let retried = |_| self.watchdog.order(now, Order::Stop(StopOrder { step: None, ..stop }));
        match if step.is_some() { taken.or_else(retried) } else { taken } {
            Ok(order) => {
                // It has not moved, although reversing made its position more uncertain.
                let rear = (at - envelope.behind).max(run_begin);
                self.set_state(id, State::Running { order, rear, confirmed: false });
                if let Some(train) = self.trains.get_mut(&id) {
                    train.withdrawn = 0;
                    train.detected_since_start = false;
                    train.ambiguous_at_rest = false;
                }
                self.reserve_runs(now, id);
            }
            Err(why) => self.withdraw(now, id, Some(why)),
        }
    }

    /// A run has ended as planned.
    pub(super) fn run_ended(&mut self, now: Timestamp, id: TrainId, unseen: bool, error: Option<Length>) {
        let Some(train) = self.trains.get_mut(&id) else { return };
        let State::Running { rear, confirmed, .. } = train.state else { return };
        let is_on_trailed = self.is_on_trailed_points(now, id);
        let Some(train) = self.trains.get_mut(&id) else { return };
        let is_ambiguous = self.watchdog.driver().is_position_ambiguous(id, now);
        train.ambiguous_at_rest = confirmed && !unseen && is_ambiguous;
        let confirmed = confirmed && !unseen && !is_ambiguous;
        let ended = train.authorities.pop_front();
        if unseen && !train.authorities.is_empty() {
            // Its position is wrong, so the runs planned from there are invalid.
            return self.halted(now, id, false);
        }
        let reverses_next = train.authorities.front().is_some_and(|run| run.reverses);
        if reverses_next && is_on_trailed {
            return self.halted(now, id, confirmed);
        }
        if train.authorities.is_empty() {
            train.state = State::Resting;
            self.watchdog.set_end_of_authority(now, id, None);
            self.rest(now, id, rear, confirmed.then_some(ended).flatten());
            // Otherwise its journey goes on.
            if error.is_none_or(|error| error.abs() <= FAR) {
                self.arrived(now, id, error);
            }
        } else {
            train.state = State::Setting { ready: None, since: now };
            train.skipped.clear();
            // It may still be on the path of this run, unless a sensor has reported it.
            if let (false, Some(run)) = (confirmed, ended) {
                let layout = self.watchdog.driver().layout();
                train.kept.add(layout, &run.taken);
            }
            self.reserve_runs(now, id);
        }
        self.has_changed = true;
    }

    /// A train that was commanded to stop is at rest.
    pub(super) fn halted(&mut self, now: Timestamp, id: TrainId, confirmed: bool) {
        // A turnout of unknown position ahead of it is set before any train starts.
        let is_certain = self.watchdog.driver().position(id, now).is_some()
            || self.unknown_turnout_ahead(now, id).is_some_and(|unknown| unknown.is_clear);
        if let Some(train) = self.trains.get_mut(&id) {
            train.authorities.clear();
            train.state = if is_certain { State::Resting } else { State::Lost };
            train.waiting_reported = false;
            train.purpose = Purpose::Journey;
            train.not_before = now + RESTART_AFTER;
            train.unobstructed_s = None;
        }
        self.watchdog.set_end_of_authority(now, id, None);
        if !is_certain {
            self.notify(Notice::ReservedAsUnknown { train: id });
        } else if confirmed && self.watchdog.driver().is_position_ambiguous(id, now) {
            // It may be on another leg than it was estimated on, or short of there.
            if let Some(train) = self.trains.get_mut(&id) {
                train.ambiguous_at_rest = true;
            }
        } else if confirmed {
            self.reserve_standstill(now, id);
        }
        self.accept_near_stop(now, id);
        self.has_changed = true;
    }

    /// A train that was stopped on its last run near its destination has arrived.
    fn accept_near_stop(&mut self, now: Timestamp, id: TrainId) {
        let Some(run) = self.trains.get_mut(&id).and_then(|train| train.last_run.take()) else { return };
        let Some(rest) = self.watchdog.driver().position(id, now) else { return };
        let error = run.path.find(rest, run.start).map(|at| at - run.stop);
        if let Some(error) = error.filter(|error| error.abs() <= NEAR_ENOUGH) {
            self.arrived(now, id, Some(error));
        }
    }

    /// Whether a train at rest may be on a turnout that is set for another leg than it came from.
    pub(super) fn is_on_trailed_points(&self, now: Timestamp, id: TrainId) -> bool {
        let Some(train) = self.trains.get(&id) else { return false };
        let ClearanceEnvelope { ahead, behind, .. } = self.envelope(now, train);
        self.trailed_points(now, id, behind, ahead).is_some()
            // The legs behind a train that was placed are those that are set, which it may not have come from.
            || self.watchdog.was_placed_on_points(id)
    }

    /// A turnout that a train at rest trailed and may be on, as far as its 95 % interval and its length go. A person who reverses it sees
    /// it, and is not refused for less.
    pub(super) fn trailed_points_under(&self, now: Timestamp, id: TrainId) -> Option<TurnoutId> {
        let uncertainty = self.watchdog.driver().locate(id, now)?.uncertainty;
        let margin = uncertainty * HALF_95;
        let lengths = self.trains.get(&id)?.lengths;
        self.trailed_points(now, id, lengths.behind() + margin, lengths.ahead() + margin)
    }

    /// A turnout within distances behind and ahead of a train at rest that it trailed: it is set for another leg than the train
    /// came from.
    fn trailed_points(
        &self,
        now: Timestamp,
        id: TrainId,
        behind: Length,
        ahead: Length,
    ) -> Option<TurnoutId> {
        let place = self.watchdog.driver().position(id, now)?;
        let train = self.trains.get(&id)?;
        let (layout, turnouts) = (self.watchdog.driver().layout(), self.watchdog.driver().turnouts());
        let (path, at) = Path::around(layout, turnouts, place, &train.occupied, behind, ahead);
        let mut trailed = path.trailed(layout, at - behind, at + ahead);
        trailed.find(|need| turnouts.get(need.turnout) != Some(need.leg)).map(|need| need.turnout)
    }

    /// Releases the track that a train at rest at the end of its run certainly does not occupy. It keeps its whole
    /// reservation if no sensor has confirmed the run.
    fn rest(&mut self, now: Timestamp, id: TrainId, rear: Length, ended: Option<MovementAuthority>) {
        let Some(run) = ended else {
            if let Some(train) = self.trains.get_mut(&id) {
                train.kept = train.reservation.clone();
            }
            return;
        };
        self.release_anchors(now, id);
        let Some(train) = self.trains.get(&id) else { return };
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let envelope = self.envelope(now, train);
        // The path may lead round a circuit to its start.
        let Some(at) = run.path.find(place, rear) else { return };
        let layout = self.watchdog.driver().layout();
        // Released track may be reserved for another train by now.
        let from = (at - envelope.behind).max(rear);
        let mut reservation =
            self.reserved(run.path.reservation(layout, from, (at + envelope.ahead).min(run.end)));
        self.reserve_anchors(now, id, place, &mut reservation);
        let is_free = self.is_free_for(id, &reservation);
        if let Some(train) = self.trains.get_mut(&id).filter(|_| is_free) {
            train.reservation = reservation;
            train.kept = Reservation::empty();
        }
    }

    /// Withdraws the authority of a train at rest.
    pub(super) fn withdraw(&mut self, now: Timestamp, id: TrainId, why: Option<Refusal>) {
        // The next path begins with the present positions of the turnouts under the train.
        let blocks_itself = why.as_ref().and_then(Refusal::occupier) == Some(id);
        let mut makes_room_for = None;
        if let Some(train) = self.trains.get_mut(&id) {
            makes_room_for = train.makes_room_for();
            train.authorities.clear();
            train.state = State::Resting;
            train.purpose = Purpose::Journey;
            // What holds all trains for a while says nothing against its path.
            let is_held = why.as_ref().is_some_and(Refusal::is_passing);
            train.withdrawn = train.withdrawn.saturating_add(u8::from(!is_held));
            train.not_before = now + if blocks_itself { ACT_EVERY } else { PAUSE };
        }
        self.watchdog.set_end_of_authority(now, id, None);
        self.restore_reservation(now, id);
        self.notify(Notice::Withdrawn { train: id, why });
        if self.trains.get_mut(&id).is_some_and(|train| train.withdrawn >= MAX_WITHDRAWN) {
            self.give_up_journey(id, self.unreachable(id));
            if let Some(train) = makes_room_for {
                self.notify(Notice::Deadlocked { train });
            }
        }
    }

    /// Ends a journey that cannot be carried out.
    pub(super) fn give_up_journey(&mut self, id: TrainId, why: Refusal) {
        let Some(train) = self.trains.get_mut(&id) else { return };
        train.withdrawn = 0;
        if let Some(assigned) = train.assigned.take() {
            self.notify(Notice::GivenUp { order: assigned.order, train: id, why });
        }
    }

    /// Restores the reservation of a train that does not start, with the track under it, as it may have reversed.
    pub(super) fn restore_reservation(&mut self, now: Timestamp, id: TrainId) {
        let kept = self.trains.get(&id).map(|train| train.kept.clone());
        self.reserve_standstill(now, id);
        let layout = self.watchdog.driver().layout();
        if let (Some(train), Some(kept)) = (self.trains.get_mut(&id), kept) {
            train.reservation.add(layout, &kept);
        }
    }

    /// Reports that a train has come to its destination.
    pub(super) fn arrived(&mut self, now: Timestamp, id: TrainId, error: Option<Length>) {
        let Some(train) = self.trains.get_mut(&id) else { return };
        train.purpose = Purpose::Journey;
        let authorised_for = train.authorised_for.take();
        if let Some(assigned) = train.assigned.take_if(|assigned| Some(assigned.order) == authorised_for) {
            let took = now - assigned.since;
            train.caution = 1.0;
            self.notify(Notice::Arrived { order: assigned.order, train: id, error, took });
        }
    }

    /// Reserves the track of the runs of a train, from the bound of its rear.
    pub(super) fn reserve_runs(&mut self, now: Timestamp, id: TrainId) {
        let Some(train) = self.trains.get(&id) else { return };
        let layout = self.watchdog.driver().layout();
        let mut reservation = train.kept.clone();
        for (nth, run) in train.authorities.iter().enumerate() {
            match train.state {
                State::Running { rear, confirmed, .. } if nth == 0 => {
                    let from = if confirmed { rear } else { rear.max(run.taken_from) };
                    reservation.add(layout, &self.reserved(run.takes_beyond(layout, from)));
                }
                _ => reservation.add(layout, &run.taken),
            }
        }
        if let Some(place) = self.watchdog.driver().position(id, now) {
            self.reserve_anchors(now, id, place, &mut reservation);
        }
        if let Some(train) = self.trains.get_mut(&id)
            && train.reservation != reservation
        {
            train.reservation = reservation;
            self.has_changed = true;
        }
    }

    /// A sensor has reported a running train: releases the track behind it. Returns whether the sensor is on its path.
    pub(super) fn confirmed_at(&mut self, now: Timestamp, id: TrainId, sensor: crate::ids::NodeId) -> bool {
        let Some(train) = self.trains.get(&id) else { return true };
        let State::Running { order, rear, .. } = train.state else { return true };
        let Some(run) = train.authorities.front() else { return true };
        let layout = self.watchdog.driver().layout();
        let Some(at) = run.path.find_node(layout, sensor, rear) else { return false };
        // Another train may have caused the detection, or none.
        if self.watchdog.driver().is_position_ambiguous(id, now) {
            return true;
        }
        let rear = rear.max(at - train.lengths.behind() - SLACK);
        // Near its start it keeps the track that it occupied at rest.
        let body = self.reserved(run.takes_beyond(layout, rear));
        if rear < run.taken_from && !self.is_free_for(id, &body) {
            return true;
        }
        if let Some(train) = self.trains.get_mut(&id) {
            train.state = State::Running { order, rear, confirmed: true };
            train.kept = Reservation::empty();
        }
        self.reserve_runs(now, id);
        true
    }
}
