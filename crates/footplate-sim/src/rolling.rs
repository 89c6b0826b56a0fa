//! A train in motion: the motor's speed, the effect of the rails, and the sensors that its shoe closes.

use footplate_core::SpeedStep;

use crate::draws::Draws;
use crate::load::{DIRTY_MM, Load};
use crate::motor::{Motor, STEP_S};
use crate::path::{Path, Point};
use crate::sensors::Sensors;
use crate::train::Train;

/// A train in motion on a path. Its distance is that of the leading end of its shoe.
#[derive(Debug)]
pub(crate) struct Rolling<'w> {
    path: &'w Path,
    train: &'w Train,
    motor: Motor<&'w Train>,
    load: Load<&'w Train>,
    draws: Draws,
    distance_mm: f64,
    speed_mm_per_s: f64,
    rested_at: Option<f64>,
    /// Commands that the decoder has not received yet, with their times of arrival.
    commands: Vec<(f64, SpeedStep)>,
    passed: Passed,
}

/// How many of the points of the path have been passed.
#[derive(Debug, Default)]
struct Passed {
    edges: usize,
    closed: usize,
    left: usize,
    dirty: usize,
    gates: usize,
}

impl<'w> Rolling<'w> {
    /// A train at the start of its path.
    pub(crate) fn new(
        path: &'w Path,
        train: &'w Train,
        motor: Motor<&'w Train>,
        warmth: f64,
        mut draws: Draws,
    ) -> Self {
        let shoe_mm = train.shoe.as_mm();
        let passed = Passed {
            edges: path.edges.partition_point(|point| point.at_mm <= 0.0),
            closed: path.sensors.partition_point(|point| point.at_mm <= 0.0),
            left: path.sensors.partition_point(|point| point.at_mm <= -shoe_mm),
            dirty: path.dirty.partition_point(|point| point.at_mm <= 0.0),
            gates: path.gates.partition_point(|point| point.at_mm <= 0.0),
        };
        let load = Load::new(train, warmth, path.factor(passed.edges), draws.split());
        let speed_mm_per_s = motor.wheel_speed() * load.factor();
        let (distance_mm, rested_at, commands) = (0.0, None, Vec::new());
        Self { path, train, motor, load, draws, distance_mm, speed_mm_per_s, rested_at, commands, passed }
    }

    /// Distance in mm and speed in mm/s.
    pub(crate) const fn state(&self) -> [f64; 2] {
        [self.distance_mm, self.speed_mm_per_s]
    }

    /// When the train came to rest, in s; `None` while it moves or before it ever did.
    pub(crate) const fn rested_at(&self) -> Option<f64> {
        self.rested_at
    }

    /// Whether no command will set the train in motion.
    pub(crate) fn stays_at_rest(&self) -> bool {
        self.motor.stays_at_rest() && self.commands.is_empty()
    }

    /// The motor.
    pub(crate) const fn motor(&self) -> &Motor<&'w Train> {
        &self.motor
    }

    /// The influences on the speed.
    pub(crate) const fn load(&self) -> &Load<&'w Train> {
        &self.load
    }

    /// A command was sent at a time in s; returns when the decoder receives it.
    pub(crate) fn command(&mut self, step: SpeedStep, sent: f64) -> f64 {
        let delay = self.draws.normal(self.train.command_delay.as_s(), self.train.command_jitter.as_s());
        // Commands arrive in the order of sending.
        let last = self.commands.last().map_or(sent, |(heard, _)| *heard);
        let heard = (sent + delay.max(0.0)).max(last);
        self.commands.push((heard, step));
        heard
    }

    /// One integration step from `now`: closes and opens sensors, and calls `at_gate` for light gates passed.
    pub(crate) fn advance(&mut self, now: f64, sensors: &mut Sensors<'_>, mut at_gate: impl FnMut(u8, f64)) {
        if let Some(&(_, step)) = self.commands.first().filter(|(heard, _)| *heard <= now) {
            self.commands.remove(0);
            self.motor.command(step, &mut self.draws);
        }
        let was_moving = !self.motor.is_at_rest();
        let wheel = self.motor.advance();
        let here = self.distance_mm;
        let dirt_mm = self.passed.dirty.checked_sub(1).and_then(|last| self.path.dirty.get(last));
        let is_dirty = dirt_mm.is_some_and(|dirt| here < dirt.at_mm + DIRTY_MM);
        let rail = self.path.factor(self.passed.edges);
        let speed = wheel * self.load.advance(rail, is_dirty, wheel > 0.0);
        let there = here + 0.5 * (self.speed_mm_per_s + speed) * STEP_S;
        self.distance_mm = there;
        self.speed_mm_per_s = speed;
        if wheel > 0.0 {
            self.rested_at = None;
        } else if was_moving {
            self.rested_at = Some(now + STEP_S);
        }

        // Within a millisecond the speed is practically constant.
        let when = |at_mm: f64| now + STEP_S * ((at_mm - here) / (there - here)).clamp(0.0, 1.0);
        for point in passed(&self.path.sensors, &mut self.passed.closed, there) {
            sensors.close(point.what, when(point.at_mm));
        }
        let shoe_mm = self.train.shoe.as_mm();
        for point in passed(&self.path.sensors, &mut self.passed.left, there - shoe_mm) {
            sensors.leave(point.what, when(point.at_mm + shoe_mm));
        }
        for point in passed(&self.path.gates, &mut self.passed.gates, there) {
            at_gate(point.what, when(point.at_mm));
        }
        passed(&self.path.edges, &mut self.passed.edges, there);
        if !passed(&self.path.dirty, &mut self.passed.dirty, there).is_empty() && self.load.stalls(wheel) {
            self.motor.stall();
        }
    }
}

/// The points newly passed by a train at `to_mm`; `behind` counts all that have been passed.
fn passed<'path, T>(points: &'path [Point<T>], behind: &mut usize, to_mm: f64) -> &'path [Point<T>] {
    let ahead = points.get(*behind..).unwrap_or_default();
    let count = ahead.iter().take_while(|point| point.at_mm <= to_mm).count();
    *behind += count;
    &ahead[..count]
}
