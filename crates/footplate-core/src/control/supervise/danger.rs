//! Doing no further harm: who is stopped, who is held, and when the power goes off.

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

/// Trains stand this long after the power went off; they need a third of a second from top speed.
const DEAD_AFTER: TimeSpan = TimeSpan::from_s(2.0);
/// Without power a train comes to rest within this, from the middle of what it may run on (no decoder holds to a law then,
/// and worm gears do not roll).
const DEAD_WAY: Length = Length::from_mm(40.0);
/// See [`DEAD_WAY`]: one standard deviation.
const DEAD_DOUBT: Length = Length::from_mm(40.0);
/// A train in danger may be this far from where it is believed to be, beside what is known of that, in either direction: a
/// hop.
const DANGER_REACH: Length = Length::from_mm(700.0);
/// A lost train may have got this far from where it was seen last: two contacts stayed silent.
const LOST_REACH: Length = Length::from_mm(4_000.0);
/// A train reaches this far to either side of its pickup: a long locomotive of the gauge.
const BODY: Length = Length::from_mm(250.0);
/// What is left between trains.
const CLEAR: Length = Length::from_mm(150.0);
/// Places are certain to this many standard deviations.
const CERTAIN: f64 = 3.0;
/// Stops in doubt take at most so much of what they should.
const LONGER_STOP: f64 = 1.5;

impl Watchdog {
    /// A train is not as it was: it is stopped, with all that could meet it.
    pub(super) fn raise(&mut self, now: Timestamp, train: TrainId, why: Alarm) {
        if self.dangers.contains_key(&train) || !self.is_watching() {
            return;
        }
        let Some(model) = self.driver.model(train).cloned() else { return };
        let interrupted = self.held.remove(&train).flatten().or_else(|| self.standing.remove(&train));
        // Until it has been measured nobody is sure of its speeds and stops.
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

    /// Whether a train could meet one in danger, wherever that may be by now.
    pub(super) fn could_meet(&self, now: Timestamp, train: TrainId) -> bool {
        let Some(own) = self.own_reach(now, train) else { return !self.dangers.is_empty() };
        let mut dangers = self.dangers.keys().filter(|danger| **danger != train);
        dangers.any(|danger| match self.danger_reach(now, *danger) {
            Some(rails) => !rails.is_disjoint(&own),
            None => true,
        })
    }

    /// The rails that a train runs over before it stands, if it is told to now.
    fn own_reach(&self, now: Timestamp, train: TrainId) -> Option<BTreeSet<EdgeId>> {
        let located = self.driver.locate(train, now)?;
        let place = self.driver.position(train, now)?;
        let step = self.driver.commanded(train).max(located.step);
        let stop = self.driver.model(train)?.stop(step, Approach::Below);
        let doubt = located.uncertainty * CERTAIN + BODY + CLEAR;
        let ahead = stop.distance * LONGER_STOP + doubt;
        Some(rails_within(self.driver.layout(), place, ahead, doubt))
    }

    /// The rails on which a train in danger may be before it stands; `None` for everywhere.
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

    /// A train that crawls or is measured stays clear of all that stand. Who is above lets nobody else run meanwhile.
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

    /// Takes the power from the track: the last thing that stops a train.
    pub(super) fn power_off(&mut self, now: Timestamp, for_train: TrainId) {
        if self.power == Power::On {
            self.say(Notice::PowerOff { train: for_train });
            self.cut_power(now);
        }
    }

    /// The power goes off the track, whoever wants that.
    pub(super) fn cut_power(&mut self, now: Timestamp) {
        self.power = Power::Off { since: now };
        self.command(Command::PowerOff);
        // Everything stops, and decoders forget: what is commanded now is what they hear when they have power again.
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

    /// Gives power again once everything stands and is told to.
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

    /// The layout's rails, on which a place was seen.
    pub(super) fn note_place(&mut self, now: Timestamp, train: TrainId) {
        if let Some(place) = self.driver.position(train, now) {
            self.seen.insert(train, place);
        }
    }
}
