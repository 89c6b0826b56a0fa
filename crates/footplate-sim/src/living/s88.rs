//! Sensors as the modules of an S88 bus see them: closed, or remembered from when they were.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use footplate_core::track::Layout;
use footplate_core::{SensorId, TimeSpan, Timestamp, TrainId};
use footplate_wire::marklin_serial::{INPUTS_PER_MODULE, ModuleState};

use crate::draws::Draws;
use crate::living::detectors::Detectors;
use crate::living::past_truth::PassTruth;
use crate::sensors::{Cause, Faults};

/// A sensor closes or opens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Change {
    at: Timestamp,
    /// Of changes at one time the one that was first caused.
    nth: u64,
    sensor: SensorId,
    what: Turn,
}

/// What changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Turn {
    Opens,
    Closes,
    /// Dirty wheels interrupt the current that a detector senses, ...
    Darkens,
    /// ... and it flows again.
    Lightens,
}

/// A sensor has become occupied, or free again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Edge {
    pub(crate) at: Timestamp,
    pub(crate) sensor: SensorId,
    pub(crate) is_occupied: bool,
}

/// All sensors, and what is remembered of them.
#[derive(Debug, Clone)]
pub(crate) struct S88 {
    faults: Faults,
    draws: Draws,
    /// The sensors, from which spurious detections are drawn.
    sensors: Vec<SensorId>,
    detectors: Detectors,
    /// The numbers of sensors that report both directions under one, by direction.
    inputs: BTreeMap<SensorId, SensorId>,
    /// Detectors whose current is interrupted, and how often.
    dark: BTreeMap<SensorId, u8>,
    /// By the sensor's number: how many hold it closed, and whether it closed since the last reading.
    states: Vec<(u8, bool)>,
    changes: BinaryHeap<Reverse<Change>>,
    /// What has changed since a board looked last, if one does.
    edges: Option<Vec<Edge>>,
    caused: u64,
    next_spurious: Timestamp,
    /// For scorers: every passage of a sensor by a train, and every spurious detection.
    pub(crate) passes: Vec<PassTruth>,
}

impl S88 {
    /// All open; a few are remembered from before, if that is asked for.
    pub(crate) fn new(layout: &Layout, faults: &Faults, stale: bool, mut draws: Draws) -> Self {
        let detectors = Detectors::draw(layout, &mut draws);
        let both = |(sensor, _)| layout.both_directions(sensor).map(|[number, _]| (sensor, number));
        let inputs: BTreeMap<SensorId, SensorId> = layout.sensors().filter_map(both).collect();
        let mut sensors = detectors.inputs(layout);
        sensors.retain(|sensor| !layout.is_never_reported(*sensor));
        let count = sensors.iter().map(|sensor| usize::from(sensor.0) + 1).max().unwrap_or(0);
        let mut states = vec![(0, false); count];
        if stale {
            // The trains of the session before passed some of them (chosen: one in five).
            for sensor in &sensors {
                states[usize::from(sensor.0)].1 = draws.chance(0.2);
            }
        }
        let first = Timestamp::ZERO + TimeSpan::from_s(draws.waiting(faults.spurious_per_s()).min(FOREVER_S));
        Self {
            faults: faults.clone(),
            draws,
            sensors,
            detectors,
            inputs,
            dark: BTreeMap::new(),
            states,
            changes: BinaryHeap::new(),
            edges: None,
            caused: 0,
            next_spurious: first,
            passes: Vec::new(),
        }
    }

    /// A shoe reaches a sensor, or the front of a train a block. Returns whether the shoe closes a sensor.
    pub(crate) fn close(
        &mut self,
        sensor: SensorId,
        at: Timestamp,
        train: TrainId,
        odometer_mm: f64,
    ) -> bool {
        let cause = Cause::Train;
        if let Some(detector) = self.detectors.at(sensor) {
            self.passes.push(PassTruth { sensor, at, train: Some(train), cause, closed: true, odometer_mm });
            self.occupy(detector, at);
            return false;
        }
        let closes = !self.faults.misses(sensor, &mut self.draws);
        self.passes.push(PassTruth { sensor, at, train: Some(train), cause, closed: closes, odometer_mm });
        if closes {
            self.change(self.input(sensor), at, Turn::Closes);
        }
        closes
    }

    /// A train is in a block that it was not in.
    pub(crate) fn occupy(&mut self, detector: SensorId, at: Timestamp) {
        let at = at + self.detectors.pickup(detector);
        self.change(detector, at, Turn::Closes);
        let chance = self.faults.flicker.as_parts();
        if let Some([from, until]) = self.detectors.flicker(detector, chance) {
            self.change(detector, at + from, Turn::Darkens);
            self.change(detector, at + until, Turn::Lightens);
        }
    }

    /// The rear of a train has left a block.
    pub(crate) fn vacate(&mut self, detector: SensorId, at: Timestamp) {
        let at = at + self.detectors.release(detector);
        self.change(detector, at, Turn::Opens);
    }

    /// The usual release delay of a detector.
    pub(crate) fn release_delay(&self, detector: SensorId) -> Option<TimeSpan> {
        self.detectors.usual_release(detector)
    }

    /// A shoe leaves a sensor that it closed.
    pub(crate) fn leave(&mut self, sensor: SensorId, at: Timestamp) {
        let sticks = TimeSpan::from_s(self.faults.sticks_for_s(&mut self.draws));
        self.change(self.input(sensor), at + sticks, Turn::Opens);
    }

    fn input(&self, sensor: SensorId) -> SensorId {
        self.inputs.get(&sensor).copied().unwrap_or(sensor)
    }

    /// The state of a module at a time, not before that of the last call; `forget` clears what is only remembered.
    /// Without latches nothing is remembered.
    pub(crate) fn read(&mut self, module: u8, at: Timestamp, forget: bool, latches: bool) -> ModuleState {
        self.settle(at);
        let first = u16::from(module.saturating_sub(1)) * INPUTS_PER_MODULE;
        let numbers = first..first + INPUTS_PER_MODULE;
        let closed = numbers.filter_map(|number| {
            let is_held = self.is_closed(SensorId(number));
            let (_, remembered) = self.states.get_mut(usize::from(number))?;
            let is_closed = is_held || *remembered && latches;
            if forget {
                *remembered = false;
            }
            is_closed.then_some(SensorId(number))
        });
        ModuleState::with_closed(module, closed)
    }

    /// What has changed by a time since this was asked last; from the first time on, and in order.
    pub(crate) fn take_edges(&mut self, by: Timestamp) -> Vec<Edge> {
        self.settle(by);
        self.edges.replace(Vec::new()).unwrap_or_default()
    }

    /// Whether a sensor is occupied, as far as was looked; `None` if there is no such sensor.
    pub(crate) fn is_occupied(&self, sensor: SensorId) -> Option<bool> {
        self.sensors.contains(&sensor).then(|| self.is_closed(sensor))
    }

    fn is_closed(&self, sensor: SensorId) -> bool {
        let is_dark = self.dark.get(&sensor).is_some_and(|times| *times > 0);
        !is_dark && self.states.get(usize::from(sensor.0)).is_some_and(|(held, _)| *held > 0)
    }

    /// The sensors of the layout.
    pub(crate) fn sensors(&self) -> &[SensorId] {
        &self.sensors
    }

    fn change(&mut self, sensor: SensorId, at: Timestamp, what: Turn) {
        self.caused += 1;
        self.changes.push(Reverse(Change { at, nth: self.caused, sensor, what }));
    }

    /// Takes in everything that happened by a time.
    fn settle(&mut self, by: Timestamp) {
        while self.next_spurious <= by {
            let at = self.next_spurious;
            let waiting = self.draws.waiting(self.faults.spurious_per_s()).min(FOREVER_S);
            self.next_spurious = at + TimeSpan::from_s(waiting);
            if let Some(&sensor) = self.sensors.get(self.draws.below(self.sensors.len())) {
                self.change(sensor, at, Turn::Closes);
                self.change(sensor, at + Faults::SPURIOUS, Turn::Opens);
                let (train, cause) = (None, Cause::Spurious);
                self.passes.push(PassTruth { sensor, at, train, cause, closed: true, odometer_mm: 0.0 });
            }
        }
        while let Some(Reverse(change)) = self.changes.peek().copied().filter(|next| next.0.at <= by) {
            self.changes.pop();
            let was_occupied = self.is_closed(change.sensor);
            let Some((held, remembered)) = self.states.get_mut(usize::from(change.sensor.0)) else {
                continue;
            };
            match change.what {
                Turn::Closes => (*held, *remembered) = (held.saturating_add(1), true),
                Turn::Opens => *held = held.saturating_sub(1),
                Turn::Darkens => *self.dark.entry(change.sensor).or_default() += 1,
                Turn::Lightens => *self.dark.entry(change.sensor).or_default() -= 1,
            }
            let is_occupied = self.is_closed(change.sensor);
            if let Some(edges) = self.edges.as_mut().filter(|_| is_occupied != was_occupied) {
                edges.push(Edge { at: change.at, sensor: change.sensor, is_occupied });
            }
        }
    }
}

/// Never, as far as any run is concerned: a century.
const FOREVER_S: f64 = 3e9;
