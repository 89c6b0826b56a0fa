//! For the tests of this folder: one train with speeds and accelerations set by the test, and the loop around a
//! calibrator. It shares no formula with the model that is learnt: it adds up millimetres every millisecond.

use std::collections::VecDeque;
use std::vec::Vec;

use super::calibrator::Calibrator;
use super::notice::CalibrationNotice;
use crate::control::{Machine, Output};
use crate::event::{Command, Event, EventKind, Report};
use crate::ids::{EdgeId, NodeId, SensorId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, Leg, OutgoingEdges, TurnoutStates};

const TICK_MS: i64 = 1;
const POLL_MS: i64 = 62;
const COMMAND_MS: i64 = 9;

/// A train with constant acceleration and braking.
pub(super) struct ScriptedTrain<'l> {
    pub(super) layout: &'l Layout,
    pub(super) now: Timestamp,
    pub(super) legs: TurnoutStates,
    edge: EdgeId,
    offset_mm: f64,
    speed: f64,
    step: u8,
    /// Steady speed in mm/s of a step.
    pub(super) speed_of: fn(u8) -> f64,
    /// mm/s².
    pub(super) acceleration: f64,
    /// It does not move at this step and below.
    pub(super) stuck_below: u8,
    /// The train is lifted off the track.
    pub(super) is_lifted: bool,
    /// Sensors that never report.
    pub(super) dead: Vec<SensorId>,
    /// Turnouts that do not move.
    pub(super) jammed: Vec<TurnoutId>,
    hit: Vec<SensorId>,
    line: VecDeque<(Timestamp, Command)>,
    last_poll: Timestamp,
    /// It ran into the end of the track.
    pub(super) overran: bool,
    pub(super) notices: Vec<(Timestamp, CalibrationNotice)>,
    pub(super) commands: Vec<(Timestamp, Command)>,
}

impl<'l> ScriptedTrain<'l> {
    pub(super) fn new(layout: &'l Layout, from: &str, to: &str, offset_mm: f64) -> Self {
        let node = |name| layout.node_named(name).unwrap();
        let legs = layout.turnouts().map(|(turnout, _)| (turnout, Leg::Straight)).collect();
        Self {
            layout,
            now: Timestamp::ZERO,
            legs,
            edge: layout.edge_between(node(from), node(to)).unwrap(),
            offset_mm,
            speed: 0.0,
            step: 0,
            speed_of: |step| 40.0 * f64::from(step),
            acceleration: 200.0,
            stuck_below: 0,
            is_lifted: false,
            dead: Vec::new(),
            jammed: Vec::new(),
            hit: Vec::new(),
            line: VecDeque::new(),
            last_poll: Timestamp::ZERO,
            overran: false,
            notices: Vec::new(),
            commands: Vec::new(),
        }
    }

    /// Puts the train down elsewhere.
    pub(super) fn put(&mut self, from: &str, to: &str, offset_mm: f64) {
        let node = |name| self.layout.node_named(name).unwrap();
        self.edge = self.layout.edge_between(node(from), node(to)).unwrap();
        self.offset_mm = offset_mm;
    }

    pub(super) fn has_notified(&self, what: impl Fn(&CalibrationNotice) -> bool) -> bool {
        self.notices.iter().any(|(_, notice)| what(notice))
    }

    pub(super) fn is_at_rest(&self) -> bool {
        self.speed == 0.0
    }

    /// Lets the calibrator drive until it ends or this much time is over.
    pub(super) fn run(&mut self, machine: &mut Calibrator<'_>, seconds: f64) {
        let until = self.now + TimeSpan::from_s(seconds);
        machine.handle_timeout(self.now);
        self.take_outputs(machine);
        while self.now < until && machine.ending().is_none() {
            self.now += TimeSpan::from_ms(TICK_MS);
            self.roll();
            while let Some((leaves, command)) = self.line.front().copied().filter(|(at, _)| *at <= self.now) {
                self.line.pop_front();
                let kind = self.obey(command);
                if let Some(kind) = kind {
                    machine.handle_event(self.now, &Event { time: leaves, kind });
                    self.take_outputs(machine);
                }
            }
            if self.now - self.last_poll >= TimeSpan::from_ms(POLL_MS) {
                let interval = self.now - self.last_poll;
                self.last_poll = self.now;
                for sensor in core::mem::take(&mut self.hit) {
                    let kind = EventKind::Sensor(Report { sensor, poll_interval: Some(interval) });
                    machine.handle_event(self.now, &Event { time: self.now, kind });
                    self.take_outputs(machine);
                }
            }
            if machine.next_timeout().is_some_and(|at| at <= self.now) {
                machine.handle_timeout(self.now);
                self.take_outputs(machine);
            }
        }
    }

    fn take_outputs(&mut self, machine: &mut Calibrator<'_>) {
        while let Some(output) = machine.poll_output() {
            match output {
                Output::Command(command) => {
                    self.commands.push((self.now, command));
                    self.line.push_back((self.now + TimeSpan::from_ms(COMMAND_MS), command));
                }
                Output::Notice(notice) => self.notices.push((self.now, notice)),
                Output::HoldLine(_) | Output::Watch(_) => {}
            }
        }
    }

    fn obey(&mut self, command: Command) -> Option<EventKind> {
        match command {
            Command::Speed { train, step } => {
                self.step = step.get();
                Some(EventKind::Speed { train, step })
            }
            Command::Reverse { train } => {
                self.speed = 0.0;
                self.step = 0;
                let length = self.layout.edge(self.edge).unwrap().length.as_mm();
                self.edge = self.edge.twin();
                self.offset_mm = length - self.offset_mm;
                Some(EventKind::Reverse { train })
            }
            Command::Turnout { turnout, curved } => {
                if !self.jammed.contains(&turnout) {
                    self.legs.set(turnout, Leg::from_curved(curved));
                }
                Some(EventKind::Turnout { turnout, curved })
            }
            Command::Function { .. } | Command::PowerOff | Command::PowerOn => None,
        }
    }

    fn roll(&mut self) {
        let wanted = if self.step <= self.stuck_below { 0.0 } else { (self.speed_of)(self.step) };
        let change = self.acceleration * 0.001 * TICK_MS as f64;
        self.speed += (wanted - self.speed).clamp(-change, change);
        if self.is_lifted || self.overran {
            self.speed = 0.0;
            return;
        }
        self.offset_mm += self.speed * 0.001 * TICK_MS as f64;
        loop {
            let edge = *self.layout.edge(self.edge).unwrap();
            let length = edge.length.as_mm();
            if self.offset_mm < length {
                return;
            }
            let Some(next) = self.next_edge(edge.to) else {
                self.offset_mm = length;
                self.overran = true;
                return;
            };
            self.offset_mm -= length;
            self.edge = next;
            let sensor = self.layout.sensor_at(edge.to).filter(|sensor| !self.dead.contains(sensor));
            self.hit.extend(sensor);
        }
    }

    fn next_edge(&self, node: NodeId) -> Option<EdgeId> {
        match self.layout.outgoing(node) {
            OutgoingEdges::Ahead(edge) => Some(edge),
            OutgoingEdges::Ended => None,
            OutgoingEdges::Legs { straight, curved } => {
                let turnout = self.layout.turnouts().find(|(_, branch)| *branch == node)?.0;
                Some(if self.legs.get(turnout) == Some(Leg::Curved) { curved } else { straight })
            }
        }
    }
}
