//! Trains driven by plain orders: the track ahead of them is reserved as far as it is free, and the track behind them until a
//! sensor reports them. Trains stall on dirt, and are then not where they are estimated.

use alloc::vec::Vec;

use crate::control::drive::Refusal;
use crate::ids::{SpeedStep, TrainId};
use crate::time::{TimeSpan, Timestamp};
use crate::units::Length;

use super::dispatched_train::State;
use super::dispatcher::Dispatcher;
use super::path::Path;
use super::reservation::Reservation;

/// The smallest and the largest distance that is reserved ahead of a train driven by hand: the length of a
/// locomotive, and more than any train needs to stop from its highest step (1.2 m) and the next sensor.
const AHEAD: [Length; 2] = [Length::from_mm(300.0), Length::from_mm(2_500.0)];
/// It reserves the track to stop on a command after this time, in which it is examined only a few times.
const REACTION: TimeSpan = TimeSpan::from_ms(1_000);
/// The end of the free track is searched in steps of this.
const END_EVERY: Length = Length::from_mm(50.0);

impl Dispatcher {
    /// Starts driving a train by hand, with plain orders: ends its journey, and reserves the track ahead of it.
    pub(super) fn take_by_hand(&mut self, now: Timestamp, id: TrainId) -> Result<(), Refusal> {
        let train = self.trains.get_mut(&id).ok_or(Refusal::UnknownTrain { train: id })?;
        train.assigned = None;
        if train.state == State::InDanger {
            // It keeps the track in which its recovery may creep.
            return Ok(());
        }
        train.authorities.clear();
        if !matches!(train.state, State::ByHand | State::Lost) {
            train.kept = train.reservation.clone();
            train.state = State::ByHand;
        }
        self.drive_by_hand(now, id);
        Ok(())
    }

    /// Stops driving a train by hand, for a journey: it comes to rest first.
    pub(super) fn give_back(&mut self, now: Timestamp, id: TrainId) {
        if self.trains.get(&id).is_some_and(|train| train.state == State::ByHand)
            && !self.rest_by_hand(now, id)
        {
            self.halt(now, id);
        }
    }

    /// Ends driving a train by hand that is at rest without an order. Its reservation is reduced to the track under it, unless it
    /// has run since a sensor reported it. Returns whether it is at rest.
    pub(super) fn rest_by_hand(&mut self, now: Timestamp, id: TrainId) -> bool {
        let is_done = self.watchdog.driver().is_at_rest(id, now) && self.watchdog.driver().busy(id).is_none();
        let is_known = self.watchdog.driver().locate(id, now).is_some();
        if is_done && is_known {
            let confirmed = self.trains.get(&id).is_some_and(|train| train.detected_since_start);
            self.halted(now, id, confirmed);
            if !confirmed {
                self.keep_run_by_hand(now, id);
            }
        }
        is_done && is_known
    }

    /// Reduces the reservation of a train at rest to the track under it, and on which it may have stalled.
    fn keep_run_by_hand(&mut self, now: Timestamp, id: TrainId) {
        self.restore_reservation(now, id);
        if let Some(train) = self.trains.get_mut(&id) {
            train.kept = train.reservation.clone();
        }
    }

    /// A lost train was detected while it runs.
    pub(super) fn found_by_hand(&mut self, now: Timestamp, id: TrainId) {
        self.set_state(id, State::ByHand);
        self.drive_by_hand(now, id);
    }

    /// A sensor has reported a train: the track behind it is released, unless the report is ambiguous.
    pub(super) fn detected_by_hand(&mut self, now: Timestamp, id: TrainId) {
        let is_ambiguous = self.watchdog.driver().is_position_ambiguous(id, now);
        let known =
            self.trains.get_mut(&id).filter(|train| matches!(train.state, State::ByHand | State::Lost));
        if let Some(train) = known.filter(|_| !is_ambiguous) {
            train.kept = Reservation::empty();
        }
    }

    /// Reserves more of the track ahead. The track behind stays reserved until a sensor reports the train.
    pub(super) fn drive_by_hand(&mut self, now: Timestamp, id: TrainId) {
        let Some(train) = self.trains.get(&id) else { return };
        let (Some(place), Some(located)) =
            (self.watchdog.driver().position(id, now), self.watchdog.driver().locate(id, now))
        else {
            return;
        };
        let layout = self.watchdog.driver().layout();
        let envelope = self.envelope(now, train);
        let ahead = self.watchdog.driver().rest_if_stopped(id, now + REACTION).map_or(AHEAD[1], |rest| {
            let runs_on = rest.distance - located.at.distance + self.overrun(id, located.uncertainty);
            runs_on.max(AHEAD[0]).min(AHEAD[1])
        });
        let (path, at) = Path::around(
            layout,
            self.watchdog.driver().turnouts(),
            place,
            &train.occupied,
            envelope.behind,
            ahead + envelope.ahead,
        );
        // A follower may run over the track of its leader, of that one's leader, and so on: the driver keeps gaps
        // safe. It reserves none of it; otherwise its leader would be stopped before its own follower.
        let row = self.row_ahead(id);
        let reserved_between =
            |from: Length, end: Length| self.reserved(path.reservation(layout, from, end + envelope.ahead));
        let rear = at - envelope.behind;
        let is_free = |end: Length, shared: &[TrainId]| {
            let taken = reserved_between(rear, end);
            // The margins of its followers, close behind, may overlap its own.
            let ahead = reserved_between(at, end);
            self.trains.values().all(|other| {
                let taken = if self.row_ahead(other.id).contains(&id) { &ahead } else { &taken };
                shared.contains(&other.id) || !other.reservation.meets(taken)
            })
        };
        let free_until = |from: Length, shared: &[TrainId]| {
            let mut end = from;
            while end > at && !is_free(end, shared) {
                end -= END_EVERY;
            }
            end.max(at)
        };
        let reach = (path.length() - envelope.ahead).min(at + ahead);
        let end = free_until(reach, &row);
        if !is_free(end, &row) {
            // Not even the track under it is free: it keeps its reservation, and does not move.
            self.watchdog.set_end_of_authority(now, id, Some(located.at));
            return;
        }
        let own_end = free_until(end, &[id]);
        let mut reservation = reserved_between(rear, own_end);
        self.reserve_anchors(now, id, place, &mut reservation);
        reservation.add(layout, &train.kept);
        let driver = self.watchdog.driver();
        let runs = driver.commanded(id) > SpeedStep::STAND || !driver.is_at_rest(id, now);
        let kept = runs.then(|| {
            // Not the track ahead, where it may never come.
            let mut kept = reserved_between(rear, at);
            kept.add(layout, &train.kept);
            kept
        });
        // Neither the horizon nor a turnout of unknown position is an end of authority: the operator sees them.
        let limit = (end < reach).then(|| {
            let limit = path
                .place(end)
                .and_then(|place| self.watchdog.driver().path_point(id, located.at.node, place));
            limit.filter(|limit| limit.distance >= located.at.distance).unwrap_or(located.at)
        });
        self.watchdog.set_end_of_authority(now, id, limit);
        if let Some(train) = self.trains.get_mut(&id) {
            if let Some(kept) = kept {
                train.detected_since_start = false;
                train.kept = kept;
            }
            if train.reservation != reservation {
                train.reservation = reservation;
                self.has_changed = true;
            }
        }
    }

    /// A train, its leader, the leader of that one, and so on.
    fn row_ahead(&self, id: TrainId) -> Vec<TrainId> {
        let mut row = alloc::vec![id];
        let leader = |row: &[TrainId]| self.watchdog.driver().leader(*row.last()?);
        while let Some(next) = leader(&row).filter(|next| !row.contains(next)) {
            row.push(next);
        }
        row
    }
}

/// Reservations are searched this far beyond the end of authority: twice [`END_EVERY`].
const BEYOND: Length = Length::from_mm(100.0);

impl Dispatcher {
    /// The trains that have reserved the track just beyond a train's end of authority; none if it has no end within the
    /// horizon.
    pub fn holders_beyond(&self, train: TrainId, now: Timestamp) -> Vec<TrainId> {
        let found = || {
            let known = self.trains.get(&train)?;
            let limit =
                self.watchdog.driver().position_at(train, self.watchdog.driver().end_of_authority(train)?)?;
            let layout = self.watchdog.driver().layout();
            let envelope = self.envelope(now, known);
            let ahead = envelope.ahead + BEYOND;
            let turnouts = self.watchdog.driver().turnouts();
            let (path, at) = Path::around(layout, turnouts, limit, &known.occupied, Length::ZERO, ahead);
            let taken = path.reservation(layout, at, at + ahead);
            let others =
                self.trains.values().filter(|other| other.id != train && other.reservation.meets(&taken));
            Some(others.map(|other| other.id).collect())
        };
        found().unwrap_or_default()
    }
}
