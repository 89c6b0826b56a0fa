//! The reactions of the dispatcher to notices of the driver and the watchdog.

use alloc::vec::Vec;

use crate::control::Notice;
use crate::control::drive::Refusal;
use crate::control::supervise::Alarm;
use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::PathPoint;
use crate::units::Length;

use super::dispatched_train::{DispatchedTrain, State};
use super::dispatcher::Dispatcher;
use super::movement_authority::standstill_reservation;
use super::path::Path;
use super::reservation::{Reservation, Span};

/// A stop at its end of authority multiplies the overrun of a train by this, up to `MAX_CAUTION`.
const CAUTION_FACTOR: f64 = 1.5;
const MAX_CAUTION: f64 = 4.0;
/// Margin on the predicted stop of a train that is on the wrong track.
const MORE: Length = Length::from_mm(60.0);

impl Dispatcher {
    /// Reacts to a notice of the driver or its watchdog.
    pub(super) fn handle_notice(&mut self, now: Timestamp, notice: &Notice) {
        match notice {
            Notice::TurnoutThrown { turnout, curved, .. } => self.turnout_commanded(now, *turnout, *curved),
            Notice::Noise | Notice::NoiseOver => self.distrust_turnouts(),
            Notice::TurnoutMismatch { turnout, curved, train } => {
                self.turnout_observed(now, *turnout, *curved);
                if !self.watchdog.is_in_danger(*train) {
                    self.diverged(now, *train);
                }
            }
            Notice::Passed { train, passed, .. } => {
                if let Some(train) = self.trains.get_mut(train) {
                    train.detected_since_reversal = true;
                    train.detected_since_start = true;
                    train.has_looked_ahead = false;
                }
                self.detected_by_hand(now, *train);
                let node = self.watchdog.driver().layout().sensor_node(passed.sensor);
                let is_on_its_path = node.is_some_and(|node| self.confirmed_at(now, *train, node));
                let state = self.trains.get(train).map(|train| train.state);
                let has_strayed = matches!(state, Some(State::Halting { strayed: true, .. }));
                if !is_on_its_path || has_strayed {
                    self.diverged(now, *train);
                }
            }
            Notice::Done(finished) => {
                let Some(train) = self.trains.get(&finished.train) else { return };
                match train.state {
                    State::Running { order, .. } if order == finished.order => {
                        let error = finished.achieved.and_then(|achieved| achieved.error);
                        self.run_ended(now, finished.train, finished.unseen.is_some(), error);
                    }
                    State::Reversing { order } if order == finished.order => self.run(now, finished.train),
                    _ => {}
                }
            }
            Notice::GivenUp { order, train, why } => {
                let Some(known) = self.trains.get(train) else { return };
                match known.state {
                    State::Running { order: running, .. } if running == *order => {
                        self.run_given_up(now, *train, why);
                    }
                    State::Reversing { order: turning } if turning == *order => self.set_halting(now, *train),
                    _ => {}
                }
            }
            // The watchdog has switched the power off, or stopped the train for another reason.
            Notice::Replaced { order, train } => match self.trains.get(train).map(|known| known.state) {
                Some(State::Running { order: running, .. } | State::Reversing { order: running })
                    if running == *order =>
                {
                    self.set_halting(now, *train);
                }
                _ => {}
            },
            Notice::Arrives(planned) => {
                if let Some(train) = self.trains.get_mut(&planned.train) {
                    train.arrives_by = Some(planned.by);
                }
            }
            Notice::Lost { train } => {
                self.set_halting(now, *train);
                self.set_state(*train, State::Lost);
                self.notify(Notice::ReservedAsUnknown { train: *train });
            }
            other => self.handle_danger(now, other),
        }
    }

    /// The driver gave up a run. Near the destination the train has arrived, once it is at rest.
    fn run_given_up(&mut self, now: Timestamp, id: TrainId, why: &Refusal) {
        let is_last = self.trains.get(&id).is_some_and(|train| train.authorities.len() == 1);
        if is_last && matches!(why, Refusal::AtLimit { .. }) {
            self.remember_last_run(now, id);
        }
        if let Some(train) = self.trains.get_mut(&id).filter(|_| matches!(why, Refusal::AtLimit { .. })) {
            train.caution = (train.caution * CAUTION_FACTOR).min(MAX_CAUTION);
        }
        self.set_halting(now, id);
    }

    /// Keeps the last run, to check at rest whether the train is near its destination.
    fn remember_last_run(&mut self, now: Timestamp, id: TrainId) {
        // It may not even have started.
        if self.watchdog.driver().missed_sensor(id, now).is_none()
            && let Some(train) = self.trains.get_mut(&id)
        {
            train.last_run = train.authorities.front().cloned();
        }
    }

    /// Ends a journey whose destination cannot be reached.
    pub(super) fn cannot_go(&mut self, now: Timestamp, id: TrainId, why: Refusal) {
        self.give_up_journey(id, why.clone());
        self.withdraw(now, id, Some(why));
    }

    /// Stops a train that is not on its reserved track, and every train that it could meet before it is at rest.
    fn diverged(&mut self, now: Timestamp, id: TrainId) {
        self.halt(now, id);
        let Some(train) = self.trains.get(&id) else { return };
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let envelope = self.envelope(now, train);
        let layout = self.watchdog.driver().layout();
        let rest = self.watchdog.driver().rest_if_stopped(id, now + TimeSpan::from_ms(100));
        let located = self.watchdog.driver().locate(id, now);
        let runs_on =
            rest.zip(located).map_or(Length::ZERO, |(rest, located)| rest.distance - located.at.distance);
        let ahead = envelope.ahead + runs_on.max(Length::ZERO) + MORE;
        let (path, at) = Path::around(
            layout,
            self.watchdog.driver().turnouts(),
            place,
            &train.occupied,
            envelope.behind,
            ahead,
        );
        let taken = self.reserved(path.reservation(layout, at - envelope.behind, at + ahead));
        let mut reservation = taken.clone();
        // Part of it may still be on track that it came over and that the turnouts no longer lead to.
        reservation.add(layout, &train.kept);
        self.reserve_anchors(now, id, place, &mut reservation);
        if let Some(train) = self.trains.get_mut(&id) {
            train.reservation = reservation.clone();
            train.kept = reservation;
            train.state = State::Halting { confirmed: true, strayed: true };
        }
        let stopped = self.stop_on(now, id, &taken);
        self.notify(Notice::Diverged { train: id, stopped });
    }

    /// Stops every other train whose authority leads over this track, and returns those that ran.
    pub(super) fn stop_on(&mut self, now: Timestamp, id: TrainId, taken: &Reservation) -> Vec<TrainId> {
        let others = self.trains.values().filter(|other| other.id != id && other.reservation.meets(taken));
        let meets: Vec<TrainId> = others.map(|other| other.id).collect();
        let mut stopped = Vec::new();
        for other in meets {
            match self.trains.get(&other).map(|train| train.state) {
                Some(State::Running { .. } | State::ByHand | State::Reversing { .. }) => {
                    self.halt(now, other);
                    stopped.push(other);
                }
                Some(State::Setting { .. }) => self.withdraw(now, other, None),
                _ => {}
            }
        }
        stopped
    }
}

/// The gap between two reservations: reservations that touch overlap.
const APART: Length = Length::from_mm(1.0);

impl Dispatcher {
    /// Reacts to a notice of the watchdog: while a train is in danger no other starts.
    pub(super) fn handle_danger(&mut self, now: Timestamp, notice: &Notice) {
        match notice {
            Notice::Danger { train, stopped, why, .. } => {
                if matches!(why, Alarm::Lost | Alarm::Elsewhere(_)) {
                    self.distrust_turnouts();
                }
                for stopped in stopped {
                    self.set_halting(now, *stopped);
                }
                self.set_halting(now, *train);
                self.set_state(*train, State::InDanger);
            }
            Notice::UnauthorisedMovement { stopped, .. } => {
                stopped.iter().for_each(|train| self.set_halting(now, *train));
            }
            Notice::AsksToCreep { train } => {
                self.awaiting_creep.insert(*train);
            }
            Notice::Recovered { train, .. } => {
                self.awaiting_creep.remove(train);
                // It is no longer on the track of its authority, and perhaps before points of unknown position.
                let under = self.trains.get(train).map(|known| self.track_under(now, known));
                if let (Some(known), Some(under)) = (self.trains.get_mut(train), under) {
                    known.reservation = under;
                    known.kept = Reservation::empty();
                    known.detected_since_start = true;
                }
                self.halted(now, *train, true);
            }
            Notice::NeedsOperator { train, .. } => {
                self.awaiting_creep.remove(train);
                self.set_state(*train, State::Lost);
            }
            Notice::PowerOff { .. }
            | Notice::PowerOn
            | Notice::Creeps { .. }
            | Notice::Located { .. }
            | Notice::SpeedMeasured { .. }
            | Notice::StopChecked { .. }
            | Notice::Resumed { .. }
            | Notice::Cancelled { .. }
            | Notice::TrackClear => {}
            _ => return,
        }
        self.has_changed = true;
    }

    /// After a wrong position, or while the station was silent: several turnouts may not be in their commanded
    /// positions. Each is commanded again before it is used.
    pub(super) fn distrust_turnouts(&mut self) {
        self.commanded.values_mut().for_each(|commanded| commanded.times = 0);
    }

    /// Permits a train in danger to creep once all others are at rest, one at a time; from then on no other moves. Returns whether
    /// one was permitted.
    pub(super) fn permit_creeping(&mut self, now: Timestamp) -> bool {
        if self.watchdog.recovers() {
            return false;
        }
        let awaiting_creep: Vec<TrainId> = self.awaiting_creep.iter().copied().collect();
        for id in awaiting_creep {
            let others = self.trains.keys().filter(|other| **other != id);
            let moves = |other: &TrainId| {
                !self.watchdog.is_in_danger(*other) && !self.watchdog.driver().is_at_rest(*other, now)
            };
            if !others.copied().any(|other| moves(&other)) {
                self.awaiting_creep.remove(&id);
                self.reserve_under_halted(now, id);
                let free = self.free_track(id);
                if let Some(train) = self.trains.get_mut(&id) {
                    train.reservation = free;
                }
                let layout = self.watchdog.driver().layout();
                let mut others = Reservation::empty();
                let trains = self.trains.values().filter(|other| other.id != id);
                for other in trains {
                    others.add(layout, &other.reservation);
                    if other.reservation.is_empty() {
                        // It may be anywhere.
                        layout
                            .edges()
                            .for_each(|(edge, known)| others.take(layout, edge, Length::ZERO, known.length));
                    }
                }
                self.watchdog.permit(now, id, others);
                return true;
            }
        }
        false
    }

    /// The track under a train, wherever it may be by the turnouts whose position is known: over both legs of the others, and of those
    /// behind a train that an operator placed where it may stand on points that it pushed over.
    pub(super) fn track_under(&self, now: Timestamp, train: &DispatchedTrain) -> Reservation {
        let driver = self.watchdog.driver();
        let (layout, envelope) = (driver.layout(), self.envelope(now, train));
        if let Some(place) = driver.position(train.id, now) {
            let turnouts = driver.turnouts();
            let mut taken = standstill_reservation(layout, turnouts, place, &train.occupied, envelope);
            if self.watchdog.was_placed_on_points(train.id)
                && let Some(back) = layout.reversed(place)
            {
                for (id, left) in layout.edges_within([(back.edge, back.offset + envelope.behind)]) {
                    let from = if id == back.edge { back.offset } else { Length::ZERO };
                    taken.take(layout, id, from, left);
                }
            }
            return self.reserved(taken);
        }
        let mut taken = Reservation::empty();
        let Some(located) = driver.locate(train.id, now) else { return taken };
        let PathPoint { node, distance } = located.at;
        let from = |node, reach| layout.outgoing(node).edges().map(move |edge| (edge, reach));
        let ahead = from(node, distance + envelope.ahead);
        for (id, left) in layout.edges_within(ahead.chain(from(node.reverse(), envelope.behind - distance))) {
            taken.take(layout, id, Length::ZERO, left);
        }
        self.reserved(taken)
    }

    /// Reserves, besides what it has, the track under each other train that was stopped: it may have run beyond its reservation
    /// while no command reached it.
    fn reserve_under_halted(&mut self, now: Timestamp, except: TrainId) {
        let layout = self.watchdog.driver().layout();
        let was_stopped = |train: &&DispatchedTrain| {
            matches!(train.state, State::InDanger | State::Lost) && train.id != except
        };
        let stopped = self.trains.values().filter(was_stopped);
        let under: Vec<(TrainId, Reservation)> =
            stopped.map(|train| (train.id, self.track_under(now, train))).collect();
        for (id, taken) in under {
            if let Some(train) = self.trains.get_mut(&id) {
                train.reservation.add(layout, &taken);
            }
        }
    }

    /// All track that no other train has reserved: a creeping train may enter any of it, and no other starts.
    fn free_track(&self, id: TrainId) -> Reservation {
        let layout = self.watchdog.driver().layout();
        let others = || self.trains.values().filter(|other| other.id != id);
        let mut free = Reservation::empty();
        for (edge, known) in layout.edges().filter(|(edge, _)| *edge < edge.twin()) {
            let taken = others().flat_map(|other| other.reservation.obstructed());
            let mut taken: Vec<Span> =
                taken.filter(|(stretch, _)| *stretch == edge.stretch()).map(|(_, span)| span).collect();
            taken.sort_by(|one, other| one.from.as_m().total_cmp(&other.from.as_m()));
            let mut from = Length::ZERO;
            for span in taken {
                free.take_rails(layout, edge, from, span.from - APART);
                from = from.max(span.to + APART);
            }
            free.take_rails(layout, edge, from, known.length);
        }
        for (turnout, _) in layout.turnouts() {
            if !others().any(|other| other.reservation.takes(turnout)) {
                free.take_turnout(layout, turnout);
            }
        }
        free
    }
}
