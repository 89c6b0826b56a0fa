//! Danger: which trains are stopped and held, and when the power goes off.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;

use crate::control::drive::Order;
use crate::event::{Approach, Command};
use crate::ids::{EdgeId, SpeedStep, TrainId};
use crate::model::Rescaling;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Position;
use crate::units::Length;

use super::alarm::Alarm;
use super::meeting::{rails, rails_within};
use super::recovery::{DOUBTED, Recovery};
use super::watchdog::{Power, Watchdog};
use crate::control::Notice;

/// Trains are at rest this long after the power went off; they need a third of a second from top speed.
const DEAD_AFTER: TimeSpan = TimeSpan::from_s(2.0);
/// The median stopping distance without power (no decoder follows a law then, and worm gears do not roll).
const DEAD_WAY: Length = Length::from_mm(40.0);
/// See [`DEAD_WAY`]: one standard deviation.
const DEAD_DOUBT: Length = Length::from_mm(40.0);
/// A train in danger may be this far from its estimated place, beyond the uncertainty of that, in either direction: a hop.
const DANGER_REACH: Length = Length::from_mm(700.0);
/// A lost train may be this far from where it was seen last: two sensors stayed silent.
const LOST_REACH: Length = Length::from_mm(4_000.0);
/// Sensors that have to come ahead of where a lost train was seen last: two may have stayed silent, and the third reports it.
const SENSORS_AHEAD: usize = 3;
/// A train reaches this far to either side of its pickup: a long locomotive of the gauge.
const BODY: Length = Length::from_mm(250.0);
/// The gap between trains.
const CLEAR: Length = Length::from_mm(150.0);
/// Places are certain to this many standard deviations.
const CERTAIN: f64 = 3.0;
/// The longest stop of a train in danger, as a multiple of its model.
const LONGER_STOP: f64 = 1.5;

impl Watchdog {
    /// A train does not run as it should: it is stopped, with all that could meet it.
    pub(super) fn raise(&mut self, now: Timestamp, train: TrainId, why: Alarm) {
        if self.dangers.contains_key(&train) || !self.is_watching() {
            return;
        }
        let Some(model) = self.driver.model(train).cloned() else { return };
        let interrupted = self.held.remove(&train).flatten().or_else(|| self.standing.remove(&train));
        // Its speeds and stops are uncertain until it has been measured.
        self.driver.set_model(model.rescaled(&Rescaling::doubt(DOUBTED)));
        self.dangers.insert(train, Recovery::new(now, model, why, interrupted));
        let stopped = self.hold_what_could_meet(now);
        let interrupted = interrupted.map(|(_, order)| order);
        self.say(Notice::Danger { train, why, stopped, interrupted });
        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
    }

    /// Stops every moving train that could meet one in danger; returns which.
    pub(super) fn hold_what_could_meet(&mut self, now: Timestamp) -> Vec<TrainId> {
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

    /// A train is stopped and held until the danger is over.
    pub(super) fn hold(&mut self, now: Timestamp, train: TrainId) {
        let order = self.standing.remove(&train);
        self.held.insert(train, order);
        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
    }

    /// Whether a train could meet one in danger, wherever that may be.
    pub(super) fn could_meet(&self, now: Timestamp, train: TrainId) -> bool {
        let Some(own) = self.own_reach(now, train) else { return !self.dangers.is_empty() };
        let mut dangers = self.dangers.keys().filter(|danger| **danger != train);
        dangers.any(|danger| match self.danger_reach(now, *danger) {
            Some(rails) => !rails.is_disjoint(&own),
            None => true,
        })
    }

    /// The rails that a train runs over before it is at rest, if commanded to stop now.
    fn own_reach(&self, now: Timestamp, train: TrainId) -> Option<BTreeSet<EdgeId>> {
        let located = self.driver.locate(train, now)?;
        let place = self.driver.position(train, now)?;
        let step = self.driver.commanded(train).max(located.step);
        let stop = self.driver.model(train)?.stop(step, Approach::Below);
        let doubt = located.uncertainty * CERTAIN + BODY + CLEAR;
        let ahead = stop.distance * LONGER_STOP + doubt;
        Some(rails_within(self.driver.layout(), place, ahead, doubt))
    }

    /// The rails on which a train in danger may be before it is at rest; `None` for everywhere.
    fn danger_reach(&self, now: Timestamp, train: TrainId) -> Option<BTreeSet<EdgeId>> {
        let layout = self.driver.layout();
        let Some((located, place)) = self.driver.locate(train, now).zip(self.driver.position(train, now))
        else {
            let place: Position = *self.seen.get(&train)?;
            return Some(rails_within(layout, place, LOST_REACH, LOST_REACH));
        };
        let step = self.driver.commanded(train).max(located.step);
        let stop = self.driver.model(train)?.stop(step, Approach::Below);
        let doubt = located.uncertainty * CERTAIN + BODY + CLEAR + DANGER_REACH;
        Some(rails_within(layout, place, stop.distance * LONGER_STOP + doubt, doubt))
    }

    /// Keeps a train that creeps or is measured clear of all trains at rest. The caller lets no other run meanwhile.
    pub(super) fn keep_clear(&mut self, now: Timestamp, train: TrainId) {
        let layout = self.driver.layout();
        let others = self.driver.trains().filter(|other| *other != train);
        let taken: BTreeSet<EdgeId> = others
            .filter_map(|other| {
                let located = self.driver.locate(other, now)?;
                let reach = BODY + located.uncertainty * CERTAIN;
                Some(rails_within(layout, self.driver.position(other, now)?, reach, reach))
            })
            .flatten()
            .collect();
        let limit = self.driver.locate(train, now).and_then(|located| {
            let context = self.driver.context();
            let hops = context.hops_ahead(located.at.node).take(layout.nodes().len());
            let edges = hops.flat_map(|hop| hop.edges.iter().copied());
            let blocked = edges.into_iter().find(|edge| taken.contains(&rails(*edge)))?;
            let begin = Position { edge: blocked, offset: Length::ZERO };
            let mut at = self.driver.way_point(train, located.at.node, begin)?;
            at.way += -(BODY + CLEAR);
            Some(at)
        });
        self.driver.set_end_of_authority(now, train, limit);
    }

    /// Whether a train whose place is unknown may creep ahead: from where it was seen last, as the turnouts lie,
    /// [`SENSORS_AHEAD`] sensors come before the end of the track and before any other train.
    pub(super) fn is_clear_ahead(&self, now: Timestamp, train: TrainId) -> bool {
        let layout = self.driver.layout();
        let mut taken = BTreeSet::new();
        for other in self.driver.trains().filter(|other| *other != train) {
            let Some(place) = self.driver.position(other, now) else { return false };
            taken.extend(rails_within(layout, place, BODY, BODY));
        }
        let Some(seen) = self.seen.get(&train) else { return false };
        let Some(edge) = layout.edge(seen.edge).filter(|_| !taken.contains(&rails(seen.edge))) else {
            return false;
        };
        let mut sensors = usize::from(layout.sensor_at(edge.to).is_some());
        for hop in self.driver.context().hops_ahead(edge.to).take(layout.nodes().len()) {
            if hop.sensor.is_none() || hop.edges.iter().any(|edge| taken.contains(&rails(*edge))) {
                return false;
            }
            sensors += 1;
            if sensors >= SENSORS_AHEAD {
                return true;
            }
        }
        false
    }

    /// Switches the track power off: the last means to stop a train.
    pub(super) fn power_off(&mut self, now: Timestamp, for_train: TrainId) {
        if self.power == Power::On {
            self.say(Notice::PowerOff { train: for_train });
            self.cut_power(now);
        }
    }

    /// Switches the power off, for whatever reason.
    pub(super) fn cut_power(&mut self, now: Timestamp) {
        self.power = Power::Off { since: now };
        self.command(Command::PowerOff);
        // Decoders forget without power: what is commanded now is what they receive when it is back.
        let trains: Vec<TrainId> = self.driver.trains().collect();
        for train in trains {
            let moved = !self.driver.is_at_rest(train, now);
            let located = self.driver.locate(train, now);
            if moved && !self.dangers.contains_key(&train) && !self.held.contains_key(&train) {
                let order = self.standing.remove(&train);
                self.held.insert(train, order);
            }
            self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
            if let Some(located) = located.filter(|_| moved) {
                let at = crate::tracking::WayPoint { way: located.at.way + DEAD_WAY, ..located.at };
                let doubt = Length::from_m(libm::hypot(located.uncertainty.as_m(), DEAD_DOUBT.as_m()));
                self.driver.place(now, train, at, doubt);
            }
        }
    }

    /// Switches the power on again once all trains are at rest and commanded to be.
    pub(super) fn power_on_again(&mut self, now: Timestamp) {
        let Power::Off { since } = self.power else { return };
        let commanded = self.driver.trains().all(|train| !self.stops.waits(train));
        if now - since >= DEAD_AFTER && commanded && !self.is_silent() && !self.is_switched_off {
            self.power = Power::On;
            self.command(Command::PowerOn);
            self.say(Notice::PowerOn);
        }
    }

    /// When the power may come back.
    pub(super) fn power_due(&self) -> Option<Timestamp> {
        match self.power {
            Power::Off { since } if !self.is_switched_off => Some(since + DEAD_AFTER),
            Power::Off { .. } | Power::On => None,
        }
    }

    /// Records the place of a train that was seen.
    pub(super) fn note_place(&mut self, now: Timestamp, train: TrainId) {
        if let Some(place) = self.driver.position(train, now) {
            self.seen.insert(train, place);
        }
    }
}
