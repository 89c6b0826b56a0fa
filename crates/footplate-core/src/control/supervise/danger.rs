//! Danger: the trains that are stopped and held, and when the power goes off.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;

use crate::control::drive::{Order, OrderId};
use crate::event::{Approach, Command};
use crate::ids::{EdgeId, SensorId, SpeedStep, TrainId};
use crate::model::Rescaling;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, Position};
use crate::units::Length;

use super::alarm::Alarm;
use super::recovery::{Recovery, UNKNOWN_RATIO};
use super::recovery_phase::RecoveryPhase;
use super::watchdog::{Power, Watchdog};
use crate::control::{Notice, Outcome};

/// Trains are at rest this long after the power went off; they take a third of a second from top speed.
const AT_REST_WITHOUT_POWER: TimeSpan = TimeSpan::from_s(2.0);
/// From the command to when the points of a turnout lie (solenoids are powered for 0.2 s).
const POINTS_MOVE_WITHIN: TimeSpan = TimeSpan::from_ms(500);
/// The median stopping distance without power (decoders do not control it, and worm gears do not roll).
const STOP_WITHOUT_POWER: Length = Length::from_mm(40.0);
/// See [`STOP_WITHOUT_POWER`]: one standard deviation.
const STOP_WITHOUT_POWER_DEVIATION: Length = Length::from_mm(40.0);
/// A train in danger may be this far from its estimated position, in addition to its uncertainty, in either
/// direction: one hop.
const DANGER_REACH: Length = Length::from_mm(700.0);
/// A lost train may be this far from its last detection: two sensors stayed silent.
pub(super) const LOST_REACH: Length = Length::from_mm(4_000.0);
/// A train extends this far to either side of its pickup: a long locomotive of the gauge.
pub(super) const BODY: Length = Length::from_mm(250.0);
/// The gap between trains.
pub(super) const CLEAR: Length = Length::from_mm(150.0);
/// Bound on the error of a position, in standard deviations.
pub(super) const CERTAIN: f64 = 3.0;
/// The longest stop of a train in danger, as a multiple of its model.
const LONGER_STOP: f64 = 1.5;

impl Watchdog {
    /// Raises an alarm for a train: stops it and all trains that it could meet.
    pub(super) fn raise(&mut self, now: Timestamp, train: TrainId, why: Alarm) {
        if self.dangers.contains_key(&train) || !self.is_watching() {
            return;
        }
        let Some(model) = self.driver.model(train).cloned() else { return };
        let interrupted = self.held.remove(&train).flatten().or_else(|| self.unfinished.remove(&train));
        // Its speeds and stops are uncertain until it has been measured.
        self.driver.set_model(model.rescaled(&Rescaling::uncertain_by(UNKNOWN_RATIO)));
        let faced = self.driver.position(train, now).or_else(|| self.seen.get(&train).copied());
        let faced = faced.map(|place| place.edge);
        self.dangers.insert(train, Recovery::new(now, model, why, interrupted, faced));
        let stopped = self.hold_endangered(now);
        let interrupted = interrupted.map(|(_, order)| order);
        self.notify(Notice::Danger { train, why, stopped, interrupted });
        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
    }

    /// A report is found to be no train's. A train that it put in danger was where it should be all the time: it goes on as before once
    /// it is at rest. Returns whether there is one.
    pub(super) fn refute(&mut self, now: Timestamp, sensor: SensorId, time: Timestamp) -> bool {
        let refuted = self.dangers.iter().find(|(_, recovery)| recovery.is_refuted_by(sensor, time));
        let train =
            refuted.map(|(train, _)| *train).filter(|train| self.driver.locate(*train, now).is_some());
        train.into_iter().for_each(|train| self.end(now, train, Outcome::AsBefore));
        train.is_some()
    }

    /// Stops every moving train that could meet one in danger, and returns them.
    pub(super) fn hold_endangered(&mut self, now: Timestamp) -> Vec<TrainId> {
        let others: Vec<TrainId> = self.driver.trains().collect();
        let mut stopped = Vec::new();
        for other in others {
            let moves =
                !self.driver.is_at_rest(other, now) || self.driver.commanded(other) > SpeedStep::STAND;
            let is_known = self.dangers.contains_key(&other) || self.held.contains_key(&other);
            if moves && !is_known && self.could_meet(now, other) {
                self.hold(now, other);
                stopped.push(other);
            }
        }
        stopped
    }

    /// Stops a train and holds it until the danger is over.
    pub(super) fn hold(&mut self, now: Timestamp, train: TrainId) {
        let order = self.unfinished.remove(&train);
        self.held.insert(train, order);
        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
    }

    /// Commands the stops of trains in danger and of held ones again.
    pub(super) fn repeat_stops(&mut self, now: Timestamp) {
        let due: Vec<TrainId> = self.stops.repeats_due(now).filter(|train| self.is_held(*train)).collect();
        for train in due {
            self.stops.repeat(train, self.is_silent());
            self.command(Command::Speed { train, step: SpeedStep::STAND });
        }
    }

    /// Whether a train could meet one in danger, whose position may be uncertain.
    pub(super) fn could_meet(&self, now: Timestamp, train: TrainId) -> bool {
        let Some(own) = self.own_reach(now, train) else { return self.has_danger() };
        if self.intruder_reach().is_some_and(|rails| !rails.is_disjoint(&own)) {
            return true;
        }
        let mut dangers = self.dangers.keys().filter(|danger| **danger != train);
        dangers.any(|danger| match self.danger_reach(now, *danger) {
            Some(rails) => !rails.is_disjoint(&own),
            None => true,
        })
    }

    /// The rails that a train may occupy until it is at rest, if it is commanded to stop now.
    fn own_reach(&self, now: Timestamp, train: TrainId) -> Option<BTreeSet<EdgeId>> {
        let located = self.driver.locate(train, now)?;
        let place = self.driver.position(train, now)?;
        let step = self.driver.commanded(train).max(located.step);
        let stop = self.driver.model(train)?.stop(step, Approach::Below);
        let margin = located.uncertainty * CERTAIN + BODY + CLEAR;
        let ahead = stop.distance * LONGER_STOP + margin;
        Some(rails_within(self.driver.layout(), place, ahead, margin))
    }

    /// The rails that a train in danger may occupy until it is at rest; `None` for all.
    fn danger_reach(&self, now: Timestamp, train: TrainId) -> Option<BTreeSet<EdgeId>> {
        let layout = self.driver.layout();
        let Some((located, place)) = self.driver.locate(train, now).zip(self.driver.position(train, now))
        else {
            let place: Position = *self.seen.get(&train)?;
            return Some(rails_within(layout, place, LOST_REACH, LOST_REACH));
        };
        let step = self.driver.commanded(train).max(located.step);
        let stop = self.driver.model(train)?.stop(step, Approach::Below);
        let margin = located.uncertainty * CERTAIN + BODY + CLEAR + DANGER_REACH;
        Some(rails_within(layout, place, stop.distance * LONGER_STOP + margin, margin))
    }

    /// Switches the track power off, as the last resort to stop a train.
    pub(super) fn power_off(&mut self, now: Timestamp, for_train: TrainId) {
        if self.power == Power::On {
            self.notify(Notice::PowerOff { train: for_train });
            self.cut_power(now);
        }
    }

    /// Switches the power off, and holds all moving trains.
    pub(super) fn cut_power(&mut self, now: Timestamp) {
        self.forget_powerless_turnouts(now);
        self.power = Power::Off { since: now };
        self.command(Command::PowerOff);
        self.interrupt_recoveries(now);
        // Decoders forget their step without power: they receive these commands when it is back.
        let trains: Vec<TrainId> = self.driver.trains().collect();
        for train in trains {
            let moved = !self.driver.is_at_rest(train, now);
            let located = self.driver.locate(train, now);
            if moved && !self.dangers.contains_key(&train) && !self.held.contains_key(&train) {
                let order = self.unfinished.remove(&train);
                self.held.insert(train, order);
            }
            self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
            if let Some(located) = located.filter(|_| moved) {
                let at = crate::tracking::PathPoint {
                    distance: located.at.distance + STOP_WITHOUT_POWER,
                    ..located.at
                };
                let [estimate, stop] = [located.uncertainty, STOP_WITHOUT_POWER_DEVIATION].map(Length::as_m);
                self.driver.place(now, train, at, Length::from_m(libm::hypot(estimate, stop)));
            }
        }
    }

    /// No turnout moves without power: those that were commanded meanwhile may lie as before.
    fn forget_powerless_turnouts(&mut self, now: Timestamp) {
        if let Power::Off { since } = self.power {
            self.driver.forget_turnouts_changed(now, since - POINTS_MOVE_WITHIN);
        }
    }

    /// Switches the power on again once all trains are at rest and their stop commands were sent.
    pub(super) fn power_on_again(&mut self, now: Timestamp) {
        let Power::Off { since } = self.power else { return };
        let commanded = self.driver.trains().all(|train| !self.stops.is_pending(train));
        if now - since >= AT_REST_WITHOUT_POWER && commanded && !self.is_silent() && !self.is_switched_off {
            self.forget_powerless_turnouts(now);
            self.power = Power::On;
            self.command(Command::PowerOn);
            self.notify(Notice::PowerOn);
            self.release_held();
        }
    }

    /// When the power may be switched on again.
    pub(super) fn power_due(&self) -> Option<Timestamp> {
        match self.power {
            Power::Off { since } if !self.is_switched_off => Some(since + AT_REST_WITHOUT_POWER),
            Power::Off { .. } | Power::On => None,
        }
    }

    /// An operator says where a train is: it is not searched any more, and trusted again if that was all that was wrong. A train
    /// that is measured is stopped, because it counts as at rest at that place; its recovery begins again.
    pub(super) fn end_search(&mut self, now: Timestamp, train: TrainId) {
        if let Some(recovery) = self.dangers.get_mut(&train) {
            if recovery.is_searched() {
                let order = recovery.give_up();
                self.rest_without(now, train, order);
            } else if recovery.is_measuring() {
                recovery.begin_again(now);
                self.rest_without(now, train, None);
            }
        }
        self.trust_again(train);
    }

    /// The recovery has failed: an operator is needed.
    pub(super) fn need_operator(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        let while_it = match recovery.phase {
            RecoveryPhase::Stopping
            | RecoveryPhase::Waiting { .. }
            | RecoveryPhase::Ending { .. }
            | RecoveryPhase::Turning { .. } => "while it was being stopped",
            RecoveryPhase::Locating { .. } | RecoveryPhase::Reversing { .. } => "while it crept to a sensor",
            RecoveryPhase::GivenUp => return,
            _ => "while it was measured again",
        };
        let order = recovery.give_up();
        self.notify(Notice::NeedsOperator { train, while_it });
        self.rest_without(now, train, order);
    }

    /// Cancels the order that a recovery had interrupted, and stops the train.
    fn rest_without(&mut self, now: Timestamp, train: TrainId, interrupted: Option<(OrderId, Order)>) {
        if let Some((id, order)) = interrupted {
            self.cancel(train, id, order);
        }
        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
    }

    /// All trains were commanded to stop: each recovery that moves a train begins again when it is at rest, and is permitted anew.
    pub(super) fn interrupt_recoveries(&mut self, now: Timestamp) {
        self.permitted.clear();
        for recovery in self.dangers.values_mut() {
            if let RecoveryPhase::Waiting { has_asked } = &mut recovery.phase {
                *has_asked = false;
            } else if recovery.is_active() {
                recovery.begin_again(now);
            }
        }
    }

    /// Gives up the position of a train that was found to be wrong. A monitored train is stopped and located again.
    pub fn lose(&mut self, now: Timestamp, train: TrainId) {
        self.driver.lose(now, train);
        self.lost(now, train, Alarm::Lost);
        self.drain(now);
    }

    pub(super) fn lost(&mut self, now: Timestamp, train: TrainId, why: Alarm) {
        self.monitors.entry(train).or_default().lose();
        if self.dangers.get(&train).is_some_and(Recovery::is_active) {
            self.recovery_lost(now, train);
        } else {
            self.raise(now, train, why);
        }
    }

    /// Records the position of a train after a detection.
    pub(super) fn note_place(&mut self, now: Timestamp, train: TrainId) {
        if let Some(place) = self.driver.position(train, now) {
            self.seen.insert(train, place);
        }
    }
}

impl Watchdog {
    /// Raises the alarm if a report that is not explained shows that a train runs backward.
    pub(super) fn note_backward(&mut self, now: Timestamp, sensor: SensorId, time: Timestamp) -> bool {
        let Some(train) = self.driver.runs_backward(now, sensor, time) else { return false };
        self.undirected.insert(train);
        self.raise(now, train, Alarm::Elsewhere(sensor));
        true
    }

    /// A detection that no train explains: the second one at adjacent sensors raises the alarm.
    pub(super) fn note_unexplained(&mut self, now: Timestamp, sensor: SensorId, time: Timestamp) {
        if self.note_backward(now, sensor, time) {
            return;
        }
        self.note_stopping(sensor, time);
        let before = self.intruder.take(self.driver.layout(), sensor, time);
        if self.intruder.near.is_some() {
            self.intruder.near = Some(sensor);
            self.hold_endangered(now);
            return;
        }
        let Some(from) = before.filter(|_| self.dangers.is_empty()) else { return };
        if let Some(train) = self.only_train_elsewhere(now) {
            return self.raise(now, train, Alarm::Elsewhere(sensor));
        }
        self.intruder.near = Some(sensor);
        let stopped = self.hold_endangered(now);
        self.notify(Notice::UnauthorisedMovement { from, to: sensor, stopped });
        // A decoder may have missed its stop: all trains that should be at rest are commanded to stop again.
        let rests = |train: &TrainId| self.driver.commanded(*train) == SpeedStep::STAND;
        let resting: Vec<TrainId> = self.driver.trains().filter(rests).collect();
        for train in resting {
            self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
        }
    }

    /// The train that runs, if it is the only one and a sensor that should have reported it did not, or none has since others
    /// reported what no train explains: what moves elsewhere is this train.
    fn only_train_elsewhere(&self, now: Timestamp) -> Option<TrainId> {
        let mut trains = self.driver.trains();
        let train = trains.next().filter(|_| trains.next().is_none())?;
        let runs = self.driver.commanded(train) > SpeedStep::STAND || !self.driver.is_at_rest(train, now);
        let is_silent = self.intruder.in_a_row > 1 || self.driver.missed_sensor(train, now).is_some();
        (runs && is_silent).then_some(train)
    }

    /// The rails that whatever moves may be on; `None` if nothing does.
    pub(super) fn intruder_reach(&self) -> Option<BTreeSet<EdgeId>> {
        let layout = self.driver.layout();
        let node = layout.sensor_node(self.intruder.near?)?;
        let begins = layout.outgoing(node).edges().chain(layout.outgoing(node.reverse()).edges());
        let reach = |edge| {
            let place = Position { edge, offset: Length::ZERO };
            rails_within(layout, place, LOST_REACH, Length::ZERO)
        };
        Some(begins.flat_map(reach).collect())
    }

    /// The track is clear again: an operator said so, or a train was located that was lost.
    pub(super) fn clear_intruder(&mut self) {
        self.intruder.last = None;
        if self.intruder.near.take().is_some() {
            self.notify(Notice::TrackClear);
        }
    }

    /// Whether something moves that no session drives.
    pub(super) const fn has_intruder(&self) -> bool {
        self.intruder.near.is_some()
    }

    /// Releases held trains once no train is in danger. Their orders are cancelled, so that no train starts by itself
    /// while an operator is at the track.
    pub(super) fn release_held(&mut self) {
        if self.has_danger() {
            return;
        }
        for (train, order) in core::mem::take(&mut self.held) {
            if let Some((id, order)) = order {
                self.cancel(train, id, order);
            }
        }
    }
}

/// The rails within distances ahead of and behind a position, over both legs of every turnout: each as the edge with
/// the lower number.
pub(super) fn rails_within(
    layout: &Layout,
    place: Position,
    ahead: Length,
    behind: Length,
) -> BTreeSet<EdgeId> {
    let back = layout.reversed(place).map(|back| (back.edge, behind + back.offset));
    let within = layout.edges_within([(place.edge, ahead + place.offset)].into_iter().chain(back));
    within.into_keys().map(rails).collect()
}

/// The rails of an edge, the same for both directions.
fn rails(edge: EdgeId) -> EdgeId {
    edge.min(edge.twin())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    #[test]
    fn rails_are_found_over_both_legs_in_both_directions_and_no_further_than_the_distance() {
        let layout = oval();
        let node = |name| layout.node_named(name).unwrap();
        let edge = |from, to| layout.edge_between(node(from), node(to)).unwrap();
        let place = Position { edge: edge("A1", "BR1"), offset: Length::from_mm(50.0) };
        let near = rails_within(&layout, place, Length::from_mm(10.0), Length::from_mm(10.0));
        assert_eq!(near, [rails(place.edge)].into());
        let ahead = rails_within(&layout, place, Length::from_mm(120.0), Length::ZERO);
        assert!(ahead.contains(&rails(edge("BR1", "B1"))) && ahead.contains(&rails(edge("BR1", "C1"))));
        let all = rails_within(&layout, place, Length::from_m(50.0), Length::from_m(50.0));
        assert!(all.len() > ahead.len() && !all.contains(&rails(edge("EN1", "E1"))));
    }
}
