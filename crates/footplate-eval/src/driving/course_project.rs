//! Driving as the published course projects do: a constant speed a step, stopping distances by bisection on a contact,
//! v²/2a in between, and a place counted on from the last report.
//!
//! Nothing is corrected by what came of it, times are those at which an answer arrived, lengths are the survey's. It may
//! take as much track time as it likes to measure what it uses.

use std::collections::{BTreeMap, VecDeque};

use footplate_core::control::{Machine, Output};
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{Command, Event, EventKind, Length, NodeId, SensorId, SpeedStep, TimeSpan, Timestamp};

use super::trial::{Counts, Plan, Results, TRAIN};
use crate::rehearsal::VirtualLine;

/// After a command a train runs steadily from here on, in s (chosen: the slowest trains need five).
const SETTLES_S: f64 = 6.0;
/// A train that was commanded to stop stands, in s.
const STANDS_S: f64 = 7.0;
/// A speed is the way over the time between so many contacts (a lap and a little).
const HOPS_TIMED: usize = 14;
/// Halvings of the time at which a stop is told, until it just reaches the contact (2 m over 2⁹ are 4 mm).
const HALVINGS: usize = 9;
/// A bisection begins at a contact at least so far before the one to be reached (longer than any stop), in mm.
const ROOM_MM: f64 = 1900.0;
/// A contact that does not come within this never will, in s.
const PATIENCE_S: f64 = 60.0;
/// Contacts reported again this soon are the same passage, in s.
const SAME_S: f64 = 0.5;

/// Hears contacts, and says what it is told to say.
#[derive(Default)]
struct Ear {
    outputs: VecDeque<Output<(SensorId, Timestamp)>>,
    heard: BTreeMap<SensorId, Timestamp>,
}

impl Machine for Ear {
    type Notice = (SensorId, Timestamp);

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        if let EventKind::Sensor(report) = event.kind {
            let before = self.heard.insert(report.sensor, now);
            if before.is_none_or(|before| (now - before).as_s() > SAME_S) {
                self.outputs.push_back(Output::Notice((report.sensor, now)));
            }
        }
    }

    fn handle_timeout(&mut self, _: Timestamp) {}

    fn poll_output(&mut self) -> Option<Output<Self::Notice>> {
        self.outputs.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        None
    }
}

/// A project, its train, and what it has measured.
pub(super) struct CourseProject<'a, 'l> {
    layout: &'l Layout,
    line: &'a mut VirtualLine<'l>,
    turnouts: TurnoutStates,
    ear: Ear,
    /// Speeds in mm/s by step.
    speeds: BTreeMap<SpeedStep, f64>,
    /// Speed and stopping distance in mm/s and mm, in order of speed.
    stops: Vec<(f64, f64)>,
}

impl<'a, 'l> CourseProject<'a, 'l> {
    pub(super) fn new(layout: &'l Layout, line: &'a mut VirtualLine<'l>, turnouts: TurnoutStates) -> Self {
        let (speeds, stops) = (BTreeMap::new(), Vec::new());
        Self { layout, line, turnouts, ear: Ear::default(), speeds, stops }
    }

    /// Measures what it needs and does what is planned.
    pub(super) fn run(mut self, mut plan: Plan, counts: Counts) -> Results {
        let mut results = Results::default();
        let used: Vec<SpeedStep> = plan.mid.iter().chain(&plan.top).copied().collect();
        for step in &used {
            self.measure_speed(*step);
        }
        let ends = [used.first(), used.get(used.len() / 2), used.last()];
        for step in ends.into_iter().flatten() {
            self.measure_stop(*step);
        }
        self.stops.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        let (mid, top) = (plan.mid.clone(), plan.top.clone());
        for (steps, count, errors) in
            [(&mid, counts.mid_stops, &mut results.mid), (&top, counts.top_stops, &mut results.top)]
        {
            for _ in 0..count {
                let asked = plan.stop(self.layout, self.line, &self.turnouts, steps);
                match asked.and_then(|(node, offset, step)| self.stop_at(node, offset, step)) {
                    Some(error) => errors.push(error),
                    None => results.failed += 1,
                }
            }
        }
        let step = mid.get(mid.len() / 2).or(top.first()).copied();
        for _ in 0..counts.moves {
            let asked = plan.distance();
            let gone = step.and_then(|step| self.short_move(asked, step));
            results.moves.extend(gone.map(|gone| [asked, gone]));
        }
        results.mishaps = self.line.station.world().mishaps().len();
        results
    }

    fn tell(&mut self, step: SpeedStep) {
        self.ear.outputs.push_back(Output::Command(Command::Speed { train: TRAIN, step }));
    }

    /// The next contact, if one comes in time.
    fn next_contact(&mut self, until: Timestamp) -> Option<(SensorId, Timestamp)> {
        self.line.drive(&mut self.ear, until)
    }

    fn wait(&mut self, seconds: f64) {
        let until = self.line.now() + TimeSpan::from_s(seconds);
        while self.next_contact(until).is_some() {}
    }

    fn patience(&self) -> Timestamp {
        self.line.now() + TimeSpan::from_s(PATIENCE_S)
    }

    /// Waits for the train to come past a contact.
    fn wait_for(&mut self, sensor: SensorId) -> Option<Timestamp> {
        let patience = self.patience();
        loop {
            let (found, at) = self.next_contact(patience)?;
            if found == sensor {
                return Some(at);
            }
        }
    }

    /// The contacts ahead of a node in the order of travel, with the surveyed way to each in mm.
    fn ahead(&self, from: NodeId) -> Vec<(SensorId, f64)> {
        let (mut node, mut way, mut found) = (from, 0.0, Vec::new());
        // Half of all contacts are of the other direction.
        for _ in 0..HOPS_TIMED {
            let Some(hop) = self.layout.hops_from(node).find(|hop| hop.is_open(&self.turnouts)) else {
                break;
            };
            way += hop.length.as_mm();
            node = hop.to;
            found.extend(hop.sensor.map(|sensor| (sensor, way)));
        }
        found
    }

    /// Way over time between many contacts.
    fn measure_speed(&mut self, step: SpeedStep) {
        self.tell(step);
        self.wait(SETTLES_S);
        let patience = self.patience();
        let Some((first, began)) = self.next_contact(patience) else { return };
        let (mut last, mut way, mut ended) = (first, 0.0, began);
        for _ in 0..HOPS_TIMED {
            let patience = self.patience();
            let Some((sensor, at)) = self.next_contact(patience) else { break };
            let node = self.layout.sensor_node(last);
            let reached =
                node.and_then(|node| self.ahead(node).into_iter().find(|(ahead, _)| *ahead == sensor));
            let Some((_, further)) = reached else { continue };
            (last, way, ended) = (sensor, way + further, at);
        }
        if way > 0.0 {
            self.speeds.insert(step, way / (ended - began).as_s());
        }
    }

    /// When to tell it to stop so that it just reaches a contact, by bisection.
    fn measure_stop(&mut self, step: SpeedStep) {
        let Some(speed) = self.speeds.get(&step).copied() else { return };
        self.tell(step);
        self.wait(SETTLES_S);
        let patience = self.patience();
        let Some((from, _)) = self.next_contact(patience) else { return };
        let Some(node) = self.layout.sensor_node(from) else { return };
        let Some((to, way)) = self.ahead(node).into_iter().find(|(_, way)| *way > ROOM_MM) else { return };
        let (mut early, mut late) = (0.0, way / speed);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (early + late);
            self.tell(step);
            self.wait(SETTLES_S);
            let Some(passed) = self.wait_for(from) else { return };
            let until = passed + TimeSpan::from_s(middle);
            while self.next_contact(until).is_some() {}
            self.tell(SpeedStep::STAND);
            let until = self.line.now() + TimeSpan::from_s(STANDS_S);
            let mut reaches = false;
            while let Some((sensor, _)) = self.next_contact(until) {
                reaches |= sensor == to;
            }
            if reaches { late = middle } else { early = middle }
        }
        self.stops.push((speed, way - speed * 0.5 * (early + late)));
    }

    /// The deceleration of stops from a speed in mm/s², between measured ones in proportion.
    fn deceleration(&self, speed: f64) -> Option<f64> {
        let of = |(speed, way): &(f64, f64)| speed * speed / (2.0 * way.max(1.0));
        let after = self.stops.partition_point(|(known, _)| *known < speed);
        let (low, high) = (self.stops.get(after.saturating_sub(1))?, self.stops.get(after));
        let high = high.unwrap_or(low);
        let part = if high.0 > low.0 { ((speed - low.0) / (high.0 - low.0)).clamp(0.0, 1.0) } else { 0.0 };
        Some(of(low) + (of(high) - of(low)) * part)
    }

    /// Stops at a place: how far beyond it the train came to rest, in mm.
    fn stop_at(&mut self, node: NodeId, offset: Length, step: SpeedStep) -> Option<f64> {
        let target = self.layout.sensor_at(node)?;
        let speed = self.speeds.get(&step).copied()?;
        let stopping = speed * speed / (2.0 * self.deceleration(speed)?);
        self.tell(step);
        self.wait(SETTLES_S);
        let patience = self.patience();
        loop {
            let (sensor, at) = self.next_contact(patience)?;
            let here = self.layout.sensor_node(sensor)?;
            let ahead = self.ahead(here);
            // The last contact before the train has to be told.
            let next = ahead.first().map_or(0.0, |(_, way)| *way);
            let way =
                if sensor == target { 0.0 } else { ahead.iter().find(|(ahead, _)| *ahead == target)?.1 };
            let left = way + offset.as_mm() - stopping;
            if !(0.0..next).contains(&left) {
                continue;
            }
            let until = at + TimeSpan::from_s(left / speed);
            while self.next_contact(until).is_some() {}
            self.tell(SpeedStep::STAND);
            self.wait(STANDS_S);
            let past = self.line.station.world().truth().past(TRAIN, target)?;
            return Some((past - offset).as_mm());
        }
    }

    /// Moves on from rest by a distance: speeds up and slows down at one rate. How far the train got, in mm.
    fn short_move(&mut self, distance_mm: f64, step: SpeedStep) -> Option<f64> {
        let speed = self.speeds.get(&step).copied()?;
        let rate = self.deceleration(speed)?;
        let for_s = if distance_mm < speed * speed / rate {
            libm::sqrt(distance_mm / rate)
        } else {
            distance_mm / speed
        };
        let gone = |line: &VirtualLine<'_>| Some(line.station.world().truth().train(TRAIN)?.odometer.as_mm());
        let before = gone(self.line)?;
        self.tell(step);
        self.wait(for_s);
        self.tell(SpeedStep::STAND);
        self.wait(STANDS_S);
        Some(gone(self.line)? - before)
    }
}
