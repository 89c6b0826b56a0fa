//! How the dispatcher reacts to notices of the driver.

use alloc::vec::Vec;

use crate::control::Notice;
use crate::control::drive::Refusal;
use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};
use crate::units::Length;

use super::dispatched_train::State;
use super::dispatcher::Dispatcher;
use super::path::Path;

/// A train that was stopped at its end of authority gets this many times the room at its next stop, up to `MOST_CAUTION`.
const MORE_CAUTION: f64 = 1.5;
const MOST_CAUTION: f64 = 4.0;
/// Added to the predicted stop of a train that is on the wrong track.
const MORE: Length = Length::from_mm(60.0);

impl Dispatcher {
    /// Reacts to a notice of the driver or its watchdog.
    pub(super) fn hear(&mut self, now: Timestamp, notice: &Notice) {
        match notice {
            Notice::TurnoutThrown { turnout, curved, .. } => self.turnout_told(now, *turnout, *curved),
            Notice::TurnoutMismatch { turnout, curved, train } => {
                self.turnout_shown(now, *turnout, *curved);
                if !self.watchdog.is_in_danger(*train) {
                    self.diverged(now, *train);
                }
            }
            Notice::Passed { train, passed, .. } => {
                if let Some(train) = self.trains.get_mut(train) {
                    train.seen_since_turn = true;
                    train.seen_since_start = true;
                    train.has_looked_ahead = false;
                }
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
                    State::Turning { order } if order == finished.order => self.run(now, finished.train),
                    _ => {}
                }
            }
            Notice::GivenUp { order, train, why } => {
                let Some(known) = self.trains.get(train) else { return };
                match known.state {
                    State::Running { order: running, .. } if running == *order => {
                        self.stopped_on_the_way(now, *train, why);
                    }
                    State::Turning { order: turning } if turning == *order => self.gives_up(*train),
                    _ => {}
                }
            }
            // The watchdog has cut the power, or stopped the train for another reason.
            Notice::Replaced { order, train } => match self.trains.get(train).map(|known| known.state) {
                Some(State::Running { order: running, .. } | State::Turning { order: running })
                    if running == *order =>
                {
                    self.gives_up(*train);
                }
                _ => {}
            },
            Notice::Lost { train } => {
                self.gives_up(*train);
                self.set_state(*train, State::Lost);
                self.say(Notice::ReservedAsUnknown { train: *train });
            }
            other => self.hear_of_danger(now, other),
        }
    }

    /// The driver gave up a run. Near the destination the train has arrived, once it is at rest.
    fn stopped_on_the_way(&mut self, now: Timestamp, id: TrainId, why: &Refusal) {
        let is_last = self.trains.get(&id).is_some_and(|train| train.course.len() == 1);
        if is_last && matches!(why, Refusal::AtLimit { .. }) {
            self.ends_near(now, id);
        }
        if let Some(train) = self.trains.get_mut(&id).filter(|_| matches!(why, Refusal::AtLimit { .. })) {
            train.caution = (train.caution * MORE_CAUTION).min(MOST_CAUTION);
        }
        self.gives_up(id);
    }

    /// Remembers the last run: whether the train comes to rest near its destination shows once it is at rest.
    fn ends_near(&mut self, now: Timestamp, id: TrainId) {
        // It may not even have left.
        if self.watchdog.driver().missed_sensor(id, now).is_none()
            && let Some(train) = self.trains.get_mut(&id)
        {
            train.last_run = train.course.front().cloned();
        }
    }

    /// A train cannot come to its destination: ends the journey.
    pub(super) fn cannot_go(&mut self, now: Timestamp, id: TrainId, why: Refusal) {
        self.give_up_journey(id, why.clone());
        self.withdraw(now, id, Some(why));
    }

    /// A train is not on its reserved track: it is stopped, and so is every train that it could meet before it is at rest.
    fn diverged(&mut self, now: Timestamp, id: TrainId) {
        self.halt(now, id);
        let Some(train) = self.trains.get(&id) else { return };
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let room = self.room(now, train);
        let layout = self.watchdog.driver().layout();
        let rest = self.watchdog.driver().rest_if_stopped(id, now + TimeSpan::from_ms(100));
        let located = self.watchdog.driver().locate(id, now);
        let runs_on = rest.zip(located).map_or(Length::ZERO, |(rest, located)| rest.way - located.at.way);
        let ahead = room.ahead + runs_on.max(Length::ZERO) + MORE;
        let (path, at) =
            Path::around(layout, self.watchdog.driver().turnouts(), place, &train.came, room.behind, ahead);
        let taken = self.reserved(path.reservation(layout, at - room.behind, at + ahead));
        let others = self.trains.values().filter(|other| other.id != id && other.held.meets(&taken));
        let meets: Vec<TrainId> = others.map(|other| other.id).collect();
        let mut held = taken;
        self.take_anchors(now, id, place, &mut held);
        if let Some(train) = self.trains.get_mut(&id) {
            train.held = held.clone();
            train.kept = held;
            train.state = State::Halting { confirmed: true, strayed: true };
        }
        let mut stopped = Vec::new();
        for other in meets {
            match self.trains.get(&other).map(|train| train.state) {
                Some(State::Running { .. } | State::ByHand | State::Turning { .. }) => {
                    self.halt(now, other);
                    stopped.push(other);
                }
                Some(State::Setting { .. }) => self.withdraw(now, other, None),
                _ => {}
            }
        }
        self.say(Notice::Diverged { train: id, stopped });
    }
}
