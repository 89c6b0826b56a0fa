//! The driving method of the published course projects: a constant speed per step, stopping distances by bisection on a
//! sensor, v²/2a between them, and dead reckoning from the last report.
//!
//! The method does not learn from its results, uses arrival times of reports, and uses surveyed lengths. Its
//! measurements may take any amount of simulated time.

use std::collections::{BTreeMap, VecDeque};

use footplate_core::control::{Machine, Output};
use footplate_core::track::{DirectionFinder, Layout, TurnoutStates};
use footplate_core::{Command, Event, EventKind, Length, NodeId, SensorId, SpeedStep, TimeSpan, Timestamp};

use super::trial::{Counts, Plan, Results, TRAIN};
use crate::testbed::{VirtualLine, in_words};

/// The time after a command at which the speed counts as steady, in s (chosen: the slowest trains need five).
const SETTLING_S: f64 = 6.0;
/// The time after a command to stop at which the train is at rest, in s.
const BRAKING_S: f64 = 7.0;
/// Hops over which a mean speed is measured (a lap and a little).
const HOPS_TIMED: usize = 14;
/// Steps of the bisection for the time of the stop command (2 m over 2⁹ are 4 mm).
const HALVINGS: usize = 9;
/// The least distance between the sensor at which a bisection starts and the one that it aims at, in mm (longer than
/// any stop).
const MIN_DISTANCE_MM: f64 = 1900.0;
/// The longest wait for a detection, in s.
const DETECTION_TIMEOUT_S: f64 = 60.0;
/// Reports of one sensor within this time are the same passage, in s.
const SAME_PASSAGE_S: f64 = 0.5;

/// Collects detections, and sends commands.
#[derive(Default)]
struct DetectionListener {
    outputs: VecDeque<Output<(SensorId, Timestamp)>>,
    last_reports: BTreeMap<SensorId, Timestamp>,
}

impl Machine for DetectionListener {
    type Notice = (SensorId, Timestamp);

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        if let EventKind::Sensor(report) = event.kind {
            let before = self.last_reports.insert(report.sensor, now);
            if before.is_none_or(|before| (now - before).as_s() > SAME_PASSAGE_S) {
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

/// The method, its train, and its measurements.
pub(super) struct CourseProject<'a, 'l> {
    layout: &'l Layout,
    line: &'a mut VirtualLine<'l>,
    turnouts: TurnoutStates,
    listener: DetectionListener,
    /// It never reverses: the order of sensors shows the direction where they do not report it.
    directions: DirectionFinder,
    /// Speed in mm/s by step.
    speeds: BTreeMap<SpeedStep, f64>,
    /// Pairs of speed (mm/s) and stopping distance (mm), in order of speed.
    stops: Vec<(f64, f64)>,
}

impl<'a, 'l> CourseProject<'a, 'l> {
    pub(super) fn new(layout: &'l Layout, line: &'a mut VirtualLine<'l>, turnouts: TurnoutStates) -> Self {
        let (speeds, stops) = (BTreeMap::new(), Vec::new());
        let (listener, directions) = (DetectionListener::default(), DirectionFinder::default());
        Self { layout, line, turnouts, listener, directions, speeds, stops }
    }

    /// Measures the train and carries out the tasks.
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
                let ordered = plan.stop(self.layout, self.line, &self.turnouts, steps);
                match ordered.and_then(|(node, offset, step)| self.stop_at(node, offset, step)) {
                    Some(error) => errors.push(error),
                    None => results.failed += 1,
                }
            }
        }
        let step = mid.get(mid.len() / 2).or(top.first()).copied();
        for _ in 0..counts.moves {
            let ordered = plan.distance();
            let moved = step.and_then(|step| self.short_move(ordered, step));
            results.moves.extend(moved.map(|moved| [ordered, moved]));
        }
        results.incidents = in_words(self.line.station.world.incidents());
        results
    }

    fn command(&mut self, step: SpeedStep) {
        self.listener.outputs.push_back(Output::Command(Command::Speed { train: TRAIN, step }));
    }

    /// The next detection before `until`.
    fn next_detection(&mut self, until: Timestamp) -> Option<(SensorId, Timestamp)> {
        loop {
            let (reported, at) = self.line.drive(&mut self.listener, until)?;
            let passed = self.directions.passed(self.layout, &self.turnouts, reported);
            if let Some(sensor) = passed {
                return Some((sensor, at));
            }
        }
    }

    fn wait(&mut self, seconds: f64) {
        let until = self.line.now() + TimeSpan::from_s(seconds);
        while self.next_detection(until).is_some() {}
    }

    fn deadline(&self) -> Timestamp {
        self.line.now() + TimeSpan::from_s(DETECTION_TIMEOUT_S)
    }

    /// Waits for a detection of this sensor.
    fn wait_for(&mut self, sensor: SensorId) -> Option<Timestamp> {
        let deadline = self.deadline();
        loop {
            let (found, at) = self.next_detection(deadline)?;
            if found == sensor {
                return Some(at);
            }
        }
    }

    /// The sensors ahead of a node in the order of travel, each with its surveyed distance in mm.
    fn ahead(&self, from: NodeId) -> Vec<(SensorId, f64)> {
        let (mut node, mut distance, mut found) = (from, 0.0, Vec::new());
        // Half of all sensors belong to the other direction.
        for _ in 0..HOPS_TIMED {
            let Some(hop) = self.layout.hops_from(node).find(|hop| hop.is_open(&self.turnouts)) else {
                break;
            };
            distance += hop.length.as_mm();
            node = hop.to;
            found.extend(hop.sensor.map(|sensor| (sensor, distance)));
        }
        found
    }

    /// Measures the mean speed at a step: distance over time between many detections.
    fn measure_speed(&mut self, step: SpeedStep) {
        self.command(step);
        self.wait(SETTLING_S);
        let deadline = self.deadline();
        let Some((first, began)) = self.next_detection(deadline) else { return };
        let (mut last, mut distance, mut ended) = (first, 0.0, began);
        for _ in 0..HOPS_TIMED {
            let deadline = self.deadline();
            let Some((sensor, at)) = self.next_detection(deadline) else { break };
            let node = self.layout.sensor_node(last);
            let reached =
                node.and_then(|node| self.ahead(node).into_iter().find(|(ahead, _)| *ahead == sensor));
            let Some((_, further)) = reached else { continue };
            (last, distance, ended) = (sensor, distance + further, at);
        }
        if distance > 0.0 {
            self.speeds.insert(step, distance / (ended - began).as_s());
        }
    }

    /// Measures the stopping distance from a step: by bisection, the time of the stop command at which the train just
    /// reaches a sensor.
    fn measure_stop(&mut self, step: SpeedStep) {
        let Some(speed) = self.speeds.get(&step).copied() else { return };
        self.command(step);
        self.wait(SETTLING_S);
        let deadline = self.deadline();
        let Some((from, _)) = self.next_detection(deadline) else { return };
        let Some(node) = self.layout.sensor_node(from) else { return };
        let Some((to, distance)) =
            self.ahead(node).into_iter().find(|(_, distance)| *distance > MIN_DISTANCE_MM)
        else {
            return;
        };
        let (mut early, mut late) = (0.0, distance / speed);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (early + late);
            self.command(step);
            self.wait(SETTLING_S);
            let Some(passed) = self.wait_for(from) else { return };
            let until = passed + TimeSpan::from_s(middle);
            while self.next_detection(until).is_some() {}
            self.command(SpeedStep::STAND);
            let until = self.line.now() + TimeSpan::from_s(BRAKING_S);
            let mut reaches = false;
            while let Some((sensor, _)) = self.next_detection(until) {
                reaches |= sensor == to;
            }
            if reaches { late = middle } else { early = middle }
        }
        self.stops.push((speed, distance - speed * 0.5 * (early + late)));
    }

    /// The deceleration of stops from a speed in mm/s², interpolated between measured ones.
    fn deceleration(&self, speed: f64) -> Option<f64> {
        let of = |(speed, distance): &(f64, f64)| speed * speed / (2.0 * distance.max(1.0));
        let after = self.stops.partition_point(|(known, _)| *known < speed);
        let (low, high) = (self.stops.get(after.saturating_sub(1))?, self.stops.get(after));
        let high = high.unwrap_or(low);
        let part = if high.0 > low.0 { ((speed - low.0) / (high.0 - low.0)).clamp(0.0, 1.0) } else { 0.0 };
        Some(of(low) + (of(high) - of(low)) * part)
    }

    /// Stops at a place; returns how far beyond it the train came to rest, in mm.
    fn stop_at(&mut self, node: NodeId, offset: Length, step: SpeedStep) -> Option<f64> {
        let target = self.layout.sensor_at(node)?;
        let speed = self.speeds.get(&step).copied()?;
        let stopping = speed * speed / (2.0 * self.deceleration(speed)?);
        self.command(step);
        self.wait(SETTLING_S);
        let deadline = self.deadline();
        loop {
            let (sensor, at) = self.next_detection(deadline)?;
            let here = self.layout.sensor_node(sensor)?;
            let ahead = self.ahead(here);
            // The command is due before the next sensor: otherwise wait for that one.
            let next = ahead.first().map_or(0.0, |(_, distance)| *distance);
            let distance =
                if sensor == target { 0.0 } else { ahead.iter().find(|(ahead, _)| *ahead == target)?.1 };
            let left = distance + offset.as_mm() - stopping;
            if !(0.0..next).contains(&left) {
                continue;
            }
            let until = at + TimeSpan::from_s(left / speed);
            while self.next_detection(until).is_some() {}
            self.command(SpeedStep::STAND);
            self.wait(BRAKING_S);
            let past = self.line.station.world.truth().past(TRAIN, target)?;
            return Some((past - offset).as_mm());
        }
    }

    /// Moves by a distance from rest, with equal acceleration and deceleration; returns the distance moved, in mm.
    fn short_move(&mut self, distance_mm: f64, step: SpeedStep) -> Option<f64> {
        let speed = self.speeds.get(&step).copied()?;
        let rate = self.deceleration(speed)?;
        let for_s = if distance_mm < speed * speed / rate {
            libm::sqrt(distance_mm / rate)
        } else {
            distance_mm / speed
        };
        let moved = |line: &VirtualLine<'_>| Some(line.station.world.truth().train(TRAIN)?.odometer.as_mm());
        let before = moved(self.line)?;
        self.command(step);
        self.wait(for_s);
        self.command(SpeedStep::STAND);
        self.wait(BRAKING_S);
        Some(moved(self.line)? - before)
    }
}
