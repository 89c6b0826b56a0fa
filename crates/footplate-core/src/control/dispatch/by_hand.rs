//! Trains driven by plain orders: the track ahead of them is reserved as far as it is free.

use crate::control::drive::Refusal;
use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};
use crate::units::Length;

use super::dispatched_train::State;
use super::dispatcher::Dispatcher;
use super::path::Path;

/// How far ahead of a train driven by hand the track is reserved, at least and at most: the length of a locomotive, and more
/// than any train needs to stop from its highest step (1.2 m) and the next sensor.
const AHEAD: [Length; 2] = [Length::from_mm(300.0), Length::from_mm(2_500.0)];
/// It reserves what it needs to stop on a command after this: in that time it is examined only a few times.
const TOLD_AFTER: TimeSpan = TimeSpan::from_ms(1_000);
/// The steps in which less track is tried.
const EVERY: Length = Length::from_mm(50.0);

impl Dispatcher {
    /// A person gives a train plain orders: its journey ends, and the track ahead of it is reserved.
    pub(super) fn take_over(&mut self, now: Timestamp, id: TrainId) -> Result<(), Refusal> {
        let train = self.trains.get_mut(&id).ok_or(Refusal::UnknownTrain { train: id })?;
        train.asked = None;
        train.course.clear();
        if !matches!(train.state, State::ByHand | State::Lost | State::InDanger) {
            train.kept = train.held.clone();
            train.state = State::ByHand;
        }
        self.drive_by_hand(now, id);
        Ok(())
    }

    /// A train driven by hand gets a journey: it comes to rest first.
    pub(super) fn give_back(&mut self, now: Timestamp, id: TrainId) {
        if self.trains.get(&id).is_some_and(|train| train.state == State::ByHand)
            && !self.rest_by_hand(now, id)
        {
            self.halt(now, id);
        }
    }

    /// A train driven by hand that is at rest without an order reserves no more than the track under it. Returns whether it
    /// does.
    pub(super) fn rest_by_hand(&mut self, now: Timestamp, id: TrainId) -> bool {
        let is_done = self.watchdog.driver().is_at_rest(id, now) && self.watchdog.driver().busy(id).is_none();
        let is_known = self.watchdog.driver().locate(id, now).is_some();
        if is_done && is_known {
            self.halted(now, id, true);
        }
        is_done && is_known
    }

    /// A lost train has passed a sensor while it runs.
    pub(super) fn found_by_hand(&mut self, now: Timestamp, id: TrainId) {
        self.set_state(id, State::ByHand);
        self.drive_by_hand(now, id);
    }

    /// Reserves more of the track ahead, and releases what is behind.
    pub(super) fn drive_by_hand(&mut self, now: Timestamp, id: TrainId) {
        let Some(train) = self.trains.get(&id) else { return };
        let (Some(place), Some(located)) =
            (self.watchdog.driver().position(id, now), self.watchdog.driver().locate(id, now))
        else {
            return;
        };
        let layout = self.watchdog.driver().layout();
        let room = self.room(now, train);
        let ahead = self.watchdog.driver().rest_if_stopped(id, now + TOLD_AFTER).map_or(AHEAD[1], |rest| {
            let runs_on = rest.way - located.at.way + self.overrun(id, located.uncertainty);
            runs_on.max(AHEAD[0]).min(AHEAD[1])
        });
        let (path, at) = Path::around(
            layout,
            self.watchdog.driver().turnouts(),
            place,
            &train.came,
            room.behind,
            ahead + room.ahead,
        );
        // A train that follows another may run over its track, and so on along the row: the driver keeps gaps safe. It reserves
        // none of it, or its leader would be stopped before its own follower.
        let mut row = alloc::vec![id];
        while let Some(leader) = row
            .last()
            .and_then(|last| self.watchdog.driver().leader(*last))
            .filter(|leader| !row.contains(leader))
        {
            row.push(leader);
        }
        let is_free = |end: Length, shared: &[TrainId]| {
            let taken = self.reserved(path.reservation(layout, at - room.behind, end + room.ahead));
            self.trains.values().all(|other| shared.contains(&other.id) || !other.held.meets(&taken))
        };
        let free_until = |from: Length, shared: &[TrainId]| {
            let mut end = from;
            while end > at && !is_free(end, shared) {
                end -= EVERY;
            }
            end.max(at)
        };
        let reach = (path.length() - room.ahead).min(at + ahead);
        let end = free_until(reach, &row);
        if !is_free(end, &row) {
            // Not even the track under it is free: it keeps its reservation, and stays.
            self.watchdog.set_end_of_authority(now, id, Some(located.at));
            return;
        }
        let own_end = free_until(end, &[id]);
        let mut held = self.reserved(path.reservation(layout, at - room.behind, own_end + room.ahead));
        self.take_anchors(now, id, place, &mut held);
        if self.watchdog.driver().is_position_ambiguous(id) {
            held.add(layout, &train.held);
        }
        // Free track up to the horizon is no limit, and neither is a turnout of unknown position: the person who drives sees
        // it.
        let limit = (end < reach).then(|| {
            let limit = path
                .place(end)
                .and_then(|place| self.watchdog.driver().way_point(id, located.at.node, place));
            limit.filter(|limit| limit.way >= located.at.way).unwrap_or(located.at)
        });
        self.watchdog.set_end_of_authority(now, id, limit);
        if let Some(train) = self.trains.get_mut(&id)
            && train.held != held
        {
            train.held = held;
            self.is_stirred = true;
        }
    }
}
