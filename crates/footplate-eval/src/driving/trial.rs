//! The tasks of one train: stops and short moves, compared with the truth.

use footplate_core::control::{Aim, Driver, Notice, Order, OrderId, Refusal, StopOrder};
use footplate_core::track::{Landmark, Layout, TurnoutStates};
use footplate_core::{Approach, HALF_95, Length, NodeId, Ratio, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::{LawFamily, LivingSwitches, TrainTruth, VirtualStation};

use crate::seeds::Choice;
use crate::testbed::{Calibrated, VirtualLine, in_words};

/// The train's address.
pub const TRAIN: TrainId = TrainId(24);
/// The highest step of the simulated decoders.
const HIGHEST: u8 = 14;
/// The longest time for an order, in s.
const ORDER_TIMEOUT_S: f64 = 60.0;
/// How long an operator waits for a lost train to come to a sensor (chosen: longer than between any two of a circuit).
const FIND_WITHIN: TimeSpan = TimeSpan::from_s(30.0);
/// How long he waits for its stop to end (chosen: longer than the driver gives a train of unknown position).
const STOPPED_WITHIN: TimeSpan = TimeSpan::from_s(20.0);
/// The interval of position checks.
const CHECK_INTERVAL: TimeSpan = TimeSpan::from_ms(200);
/// The true speeds of mid steps; top steps are faster than `TOP_FROM_MM_PER_S`. Published scatter of stops is 4 mm near
/// 390 and 21 mm near 612 mm/s.
const MID_MM_PER_S: std::ops::Range<f64> = 200.0..450.0;
const TOP_FROM_MM_PER_S: f64 = 500.0;
/// The distances of short moves, in mm.
const SHORT_MOVES_MM: std::ops::Range<f64> = 20.0..400.0;
/// The most sensors of a circuit (chosen: half of those of track A).
const MAX_SENSORS: usize = 40;

/// The number of each kind of task.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counts {
    pub(super) mid_stops: usize,
    pub(super) top_stops: usize,
    /// For each probability.
    pub(super) not_beyond: usize,
    pub(super) moves: usize,
}

/// The results of one train.
#[derive(Debug, Clone, Default)]
pub(super) struct Results {
    /// Errors of stops in mm, positive beyond the target.
    pub(super) mid: Vec<f64>,
    pub(super) top: Vec<f64>,
    /// Errors of stops with a limited probability of overrun, by that probability.
    pub(super) not_beyond: [Vec<f64>; 2],
    /// Distances ordered and moved, in mm.
    pub(super) moves: Vec<[f64; 2]>,
    /// Position checks, and those inside the interval.
    pub(super) position_checks: [u32; 2],
    /// Orders that were refused or not carried out.
    pub(super) failed: u32,
    /// What happened in the simulated world, in words.
    pub(super) incidents: Vec<String>,
    /// The reasons of failed orders.
    pub(super) failures: Vec<String>,
}

/// The probabilities of [`Results::not_beyond`], in percent.
pub(super) const NOT_BEYOND_PERCENT: [f64; 2] = [5.0, 1.0];

/// A world with one unknown train.
pub(super) fn world(layout: &Layout, seed: u64, law: LawFamily) -> anyhow::Result<VirtualLine<'_>> {
    let switches = LivingSwitches { law: Some(law), ..LivingSwitches::well_kept() };
    let station = VirtualStation::draw(layout, seed, &[TRAIN], &switches)?;
    Ok(VirtualLine::open(station)?)
}

/// The tasks of a train: the same for all drivers, as long as the train rests at the same places.
pub struct Plan {
    choice: Choice,
    /// Steps by their true speeds: they select the tasks and are unknown to the driver.
    pub(super) mid: Vec<SpeedStep>,
    pub(super) top: Vec<SpeedStep>,
}

impl Plan {
    /// The tasks of a train in this world.
    pub fn new(line: &VirtualLine<'_>, seed: u64) -> Self {
        let truth = line.station.world.truth();
        let steps = |range: std::ops::Range<f64>| {
            let speed = |step: SpeedStep| {
                truth
                    .engine(TRAIN)
                    .map_or(0.0, |engine| engine.speeds.speed(step, Approach::Below).as_mm_per_s())
            };
            let all = (1..=HIGHEST).filter_map(SpeedStep::new);
            all.filter(|step| range.contains(&speed(*step))).collect()
        };
        Self {
            choice: Choice::new(seed),
            mid: steps(MID_MM_PER_S),
            top: steps(TOP_FROM_MM_PER_S..f64::INFINITY),
        }
    }

    /// A random target: a place on the circuit, and one of several steps to stop from.
    pub fn stop(
        &mut self,
        layout: &Layout,
        line: &VirtualLine<'_>,
        turnouts: &TurnoutStates,
        steps: &[SpeedStep],
    ) -> Option<(NodeId, Length, SpeedStep)> {
        let ahead = ahead(layout, line, turnouts);
        let (node, length) = *self.choice.of(&ahead)?;
        let offset = self.choice.between(0.0, length);
        Some((node, Length::from_mm(offset), *self.choice.of(steps)?))
    }

    /// A random distance, in mm.
    pub(super) fn distance(&mut self) -> f64 {
        self.choice.between(SHORT_MOVES_MM.start, SHORT_MOVES_MM.end)
    }
}

/// Carries out the tasks with a calibrated train and compares the results with the truth.
pub(super) struct Trial<'a, 'l> {
    pub(super) layout: &'l Layout,
    pub(super) line: &'a mut VirtualLine<'l>,
    driver: Driver,
    plan: Plan,
    pub(super) results: Results,
}

impl<'a, 'l> Trial<'a, 'l> {
    pub(super) fn new(
        layout: &'l Layout,
        line: &'a mut VirtualLine<'l>,
        calibrated: Calibrated,
        seed: u64,
    ) -> Self {
        let mut driver = Driver::new(layout.clone(), calibrated.turnouts);
        driver.add_located(calibrated.model, calibrated.locator);
        let results = Results::default();
        let plan = Plan::new(line, seed);
        Self { layout, line, driver, plan, results }
    }

    /// Carries out all tasks, until the train is wrecked.
    pub(super) fn run(&mut self, counts: Counts) {
        let (mid, top) = (self.plan.mid.clone(), self.plan.top.clone());
        for _ in 0..counts.mid_stops {
            let error = self.stop(&mid, Aim::Median);
            self.results.mid.extend(error);
        }
        for _ in 0..counts.top_stops {
            let error = self.stop(&top, Aim::Median);
            self.results.top.extend(error);
        }
        let all: Vec<SpeedStep> = mid.iter().chain(&top).copied().collect();
        for (nth, percent) in NOT_BEYOND_PERCENT.into_iter().enumerate() {
            for _ in 0..counts.not_beyond {
                let error = self.stop(&all, Aim::NotBeyond(Ratio::from_percent(percent)));
                self.results.not_beyond[nth].extend(error);
            }
        }
        for _ in 0..counts.moves {
            self.short_move();
        }
        self.results.incidents = in_words(self.line.station.world.incidents());
    }

    fn truth(&self) -> Option<TrainTruth> {
        self.line.station.world.truth().train(TRAIN)
    }

    /// Stops at a random place ahead; returns how far beyond it the train came to rest, in mm.
    fn stop(&mut self, steps: &[SpeedStep], aim: Aim) -> Option<f64> {
        if !self.is_sound() {
            return None;
        }
        let (node, offset, step) = self.plan.stop(self.layout, self.line, self.driver.turnouts(), steps)?;
        let target = Landmark { node, offset };
        let order = StopOrder { train: TRAIN, target, aim, step: Some(step), next_round: true };
        let sensor = self.layout.sensor_at(target.node)?;
        self.carry_out(Order::Stop(order))?;
        let past = self.line.station.world.truth().past(TRAIN, sensor)?;
        Some((past - target.offset).as_mm())
    }

    /// A short move from rest.
    fn short_move(&mut self) {
        if !self.is_sound() {
            return;
        }
        let ordered = self.plan.distance();
        let Some(before) = self.truth() else { return };
        let order = Order::Move { train: TRAIN, distance: Length::from_mm(ordered) };
        if self.carry_out(order).is_some()
            && let Some(after) = self.truth()
        {
            self.results.moves.push([ordered, (after.odometer - before.odometer).as_mm()]);
        }
    }

    fn is_sound(&self) -> bool {
        self.truth().is_some_and(|truth| !truth.is_wrecked)
    }

    /// Gives an order and waits until the train is at rest; `None` if the order was refused or failed.
    fn carry_out(&mut self, order: Order) -> Option<()> {
        let now = self.line.now();
        let id = match self.driver.order(now, order) {
            Ok(id) => id,
            Err(refusal) => {
                self.results.failed += 1;
                self.results.failures.push(format!("{refusal:?}"));
                if matches!(refusal, Refusal::Lost { .. }) {
                    self.halt();
                }
                return None;
            }
        };
        let deadline = now + TimeSpan::from_s(ORDER_TIMEOUT_S);
        let done = self.until_done(id, deadline);
        if done.is_none() {
            self.results.failed += 1;
            self.results.failures.push(format!("not done: {order:?}"));
            self.halt();
        }
        // Wait until the train is truly at rest, whatever the estimate says.
        let deadline = self.line.now() + TimeSpan::from_s(10.0);
        while self.line.now() < deadline && self.truth().is_some_and(|truth| truth.at_rest_since.is_none()) {
            self.drive_and_check(deadline.min(self.line.now() + CHECK_INTERVAL));
        }
        done
    }

    fn until_done(&mut self, id: OrderId, deadline: Timestamp) -> Option<()> {
        while self.line.now() < deadline && self.is_sound() {
            match self.drive_and_check(self.line.now() + CHECK_INTERVAL) {
                Some(Notice::Done(finished)) if finished.order == id => return Some(()),
                Some(Notice::GivenUp { order, why, .. }) if order == id => {
                    self.results.failures.push(format!("failed: {why:?}"));
                    return None;
                }
                _ => {}
            }
        }
        None
    }

    /// Drives until the next notice; without one, checks the position.
    fn drive_and_check(&mut self, until: Timestamp) -> Option<Notice> {
        let notice = self.line.drive(&mut self.driver, until);
        if notice.is_none() {
            self.check_position();
        }
        notice
    }

    fn check_position(&mut self) {
        let now = self.line.now();
        let Some(located) = self.driver.locate(TRAIN, now) else { return };
        // The position as it is shown: millimetres past a sensor.
        let Some(said) = self.driver.landmark(TRAIN, located.at) else { return };
        let Some(sensor) = self.layout.sensor_at(said.node) else { return };
        let Some(past) = self.line.station.world.truth().past(TRAIN, sensor) else { return };
        let off = (past - said.offset).as_mm();
        self.results.position_checks[0] += 1;
        self.results.position_checks[1] += u32::from(off.abs() <= HALF_95 * located.uncertainty.as_mm());
    }

    /// Relocates a lost train as an operator would: runs it to a sensor, faster each time that it does not come to one,
    /// as a train that stalled on a dirty spot needs a higher step; then stops it.
    fn halt(&mut self) {
        for step in self.plan.mid.clone() {
            let _ = self.driver.order(self.line.now(), Order::Speed { train: TRAIN, step });
            let found_by = self.line.now() + FIND_WITHIN;
            while self.line.now() < found_by && !self.driver.is_found(TRAIN, self.line.now()) {
                let until = found_by.min(self.line.now() + CHECK_INTERVAL);
                let _ = self.line.drive(&mut self.driver, until);
            }
            if self.driver.is_found(TRAIN, self.line.now()) {
                break;
            }
        }
        let stop = Order::Speed { train: TRAIN, step: SpeedStep::STAND };
        let _ = self.driver.order(self.line.now(), stop);
        let deadline = self.line.now() + STOPPED_WITHIN;
        while self.line.now() < deadline && self.driver.busy(TRAIN).is_some() {
            let _ = self.line.drive(&mut self.driver, deadline.min(self.line.now() + CHECK_INTERVAL));
        }
    }
}

/// The sensors of the circuit that the train is on, with the surveyed lengths to the next.
pub(super) fn ahead(layout: &Layout, line: &VirtualLine<'_>, turnouts: &TurnoutStates) -> Vec<(NodeId, f64)> {
    let position = line.station.world.truth().train(TRAIN).and_then(|truth| truth.position);
    let mut found: Vec<(NodeId, f64)> = Vec::new();
    let mut node = position.and_then(|at| layout.edge(at.edge)).map(|edge| edge.to);
    for _ in 0..MAX_SENSORS {
        let hop = node.and_then(|node| layout.hops_from(node).find(|hop| hop.is_open(turnouts)));
        let (Some(hop), Some(from)) = (hop, node) else { break };
        let is_known = found.iter().any(|(known, _)| *known == from);
        if layout.sensor_at(from).is_some() && hop.sensor.is_some() && !is_known {
            found.push((from, hop.length.as_mm()));
        }
        node = Some(hop.to);
    }
    found
}
