//! One train that repeats one kind of order on a layout with zones.

use anyhow::Context;
use footplate_core::control::{Driver, Gap, Notice, Order, OrderId, Refusal, StopOrder};
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Length, Speed, SpeedStep, TimeSpan, TrainId};

use super::passage::{Passage, Watched};
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains, nearest_step, steps};

/// The interval of samples of the truth: a train at 400 mm/s runs 8 mm meanwhile.
const LOOK: TimeSpan = TimeSpan::from_ms(20);
/// How long each ride lasts (s).
const RIDES_FOR: f64 = 120.0;
/// Speeds that are ordered (mm/s), mean speeds of arrivals and of leaders, and distances of places (mm).
const SPEEDS: [f64; 2] = [300.0, 450.0];
const MEANS: [f64; 2] = [170.0, 320.0];
const FAR: [f64; 2] = [1800.0, 6000.0];
/// A follower's gap (s).
const GAP: f64 = 4.0;
/// Sensors between the two trains at the start.
const APART: usize = 3;
/// A ride ends if its follower falls behind until the leader, a lap ahead, is this close behind it (mm): nothing slows a
/// leader.
const ROUND: f64 = 500.0;
/// Between one order and the next (s).
const PAUSE: f64 = 2.0;
/// The factor on an offered time or gap with which the order is repeated.
const OFFERED: f64 = 1.02;
/// The longest distance to the front and the rear of any train from the leading end of its shoe (mm).
const REACH: [f64; 2] = [25.0, 145.0];

/// The kind of order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Task {
    /// Run at a step, on a layout without zones.
    Unheeding,
    Speed,
    Stop,
    Hold,
    Arrive,
    Follow,
}

impl Task {
    pub(super) const ALL: [Self; 6] =
        [Self::Unheeding, Self::Speed, Self::Stop, Self::Hold, Self::Arrive, Self::Follow];

    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Unheeding => "speed, without zones",
            Self::Speed => "speed",
            Self::Stop => "stop at",
            Self::Hold => "hold",
            Self::Arrive => "arrive",
            Self::Follow => "follow",
        }
    }
}

/// The result of a ride.
#[derive(Debug, Clone)]
pub(super) struct Ridden {
    pub(super) task: Task,
    pub(super) train: TrainId,
    pub(super) passages: Vec<Passage>,
    /// The distance it ran (mm), in this time (s).
    pub(super) distance: f64,
    pub(super) seconds: f64,
    /// Orders that were carried out.
    pub(super) done: usize,
    /// Why it failed, if it did.
    pub(super) trouble: Option<String>,
}

/// One ride of a train, or of two of which the first follows the second; returns the result of the first.
pub(super) fn ride<'l>(
    [plain, restricted]: [&'l Layout; 2],
    prepared: &PreparedTrains<'l>,
    circuit: &LongestCircuit,
    [train, leader]: [TrainId; 2],
    task: Task,
    seed: u64,
) -> anyhow::Result<Ridden> {
    // All rides of one train begin alike.
    let mut choice = Choice::new(seed);
    let start = choice.between(0.0, circuit.nodes.len() as f64) as usize;
    let speed = choice.between(SPEEDS[0], SPEEDS[1]);
    let at = |further: usize| circuit.nodes.get((start + further) % circuit.nodes.len()).copied();
    let mut prepared = prepared.clone();
    prepared.put(train, at(0).context("a circuit without a sensor")?, Length::from_mm(60.0))?;
    if task == Task::Follow {
        prepared.put(leader, at(APART).context("a circuit without a sensor")?, Length::from_mm(60.0))?;
    }
    let drives_on = if task == Task::Unheeding { plain } else { restricted };
    let mut driver = prepared.driver_on(drives_on);
    for train in [train, leader] {
        driver.set_reach(train, Length::from_mm(REACH[0]), Length::from_mm(REACH[1]));
    }
    let model = prepared.models.get(&train).context("a train that was not calibrated")?.clone();
    let mut ride = Ride { layout: plain, circuit, train, leader, task, driver, prepared, model, speed };
    Ok(ride.run(restricted, &mut choice))
}

struct Ride<'a, 'l> {
    layout: &'l Layout,
    circuit: &'a LongestCircuit,
    train: TrainId,
    leader: TrainId,
    task: Task,
    driver: Driver,
    prepared: PreparedTrains<'l>,
    model: MotionModel,
    speed: f64,
}

impl Ride<'_, '_> {
    fn run(&mut self, restricted: &Layout, choice: &mut Choice) -> Ridden {
        let mut watched = Watched::new(restricted, self.train);
        let began = self.prepared.line.now();
        let until = began + TimeSpan::from_s(RIDES_FOR);
        let odometer = self.odometer();
        let incidents = self.prepared.world().incidents().len();
        let (mut done, mut trouble) = (0, None);
        let mut busy = None;
        let mut next = Some(began);
        while self.prepared.line.now() < until && trouble.is_none() {
            if next.is_some_and(|at| at <= self.prepared.line.now()) {
                next = None;
                match self.order(choice) {
                    Ok(order) => busy = Some(order),
                    Err(why) => trouble = Some(why.to_string()),
                }
            }
            let look = self.prepared.line.now() + LOOK;
            while let Some(notice) = self.prepared.line.drive(&mut self.driver, look) {
                match notice {
                    Notice::Done(finished) if Some(finished.order) == busy => {
                        done += 1;
                        let again = matches!(self.task, Task::Stop | Task::Arrive);
                        next = again.then(|| self.prepared.line.now() + TimeSpan::from_s(PAUSE));
                    }
                    Notice::GivenUp { order, why, .. } if Some(order) == busy => {
                        trouble = Some(why.to_string());
                    }
                    _ => {}
                }
            }
            if self.task == Task::Follow && self.leader_comes_round() {
                trouble = Some("it was left behind so far that its leader came round to it".to_owned());
            }
            watched.look(self.prepared.world().truth(), self.prepared.line.now());
        }
        let trouble = self.prepared.grief_since(incidents).or(trouble);
        Ridden {
            task: self.task,
            train: self.train,
            passages: watched.passages,
            distance: self.odometer() - odometer,
            seconds: (self.prepared.line.now() - began).as_s(),
            done,
            trouble,
        }
    }

    /// Whether the leader is close behind its follower.
    fn leader_comes_round(&self) -> bool {
        let (layout, edges) = (self.driver.layout(), &self.circuit.edges);
        let round = self.circuit.surveyed(layout, edges.len());
        let place = |train| {
            let at = self.driver.position(train, self.prepared.line.now())?;
            let nth = edges.iter().position(|edge| *edge == at.edge)?;
            Some(self.circuit.surveyed(layout, nth) + at.offset.as_mm())
        };
        let behind = |(train, leader): (f64, f64)| (train - leader).rem_euclid(round);
        place(self.train).zip(place(self.leader)).map(behind).is_some_and(|behind| behind < ROUND)
    }

    /// The odometer of the train (mm).
    fn odometer(&self) -> f64 {
        let truth = self.prepared.world().truth().train(self.train);
        truth.map_or(0.0, |train| train.odometer.as_mm())
    }

    /// Gives the next order.
    fn order(&mut self, choice: &mut Choice) -> Result<OrderId, Refusal> {
        let (train, now) = (self.train, self.prepared.line.now());
        match self.task {
            Task::Unheeding | Task::Speed => {
                let step = nearest(&self.model, self.speed);
                self.driver.order(now, Order::Speed { train, step })
            }
            Task::Hold => {
                // A slower train holds its highest speed.
                let hold = |speed| Order::Hold { train, speed };
                let asked = self.driver.order(now, hold(Speed::from_mm_per_s(self.speed)));
                match asked {
                    Err(Refusal::SpeedOutOfRange { highest, .. }) => {
                        self.driver.order(now, hold(highest * 0.95))
                    }
                    asked => asked,
                }
            }
            Task::Stop => {
                let target = self.target(choice).ok_or(Refusal::Lost { train })?;
                self.driver.order(now, Order::Stop(StopOrder::at(train, target)))
            }
            Task::Arrive => {
                let far = choice.between(FAR[0], FAR[1]);
                let mean = choice.between(MEANS[0], MEANS[1]);
                let target = self.target_at(far).ok_or(Refusal::Lost { train })?;
                let arrive = |within| Order::Arrive { train, target, within };
                let asked = self.driver.order(now, arrive(TimeSpan::from_s(far / mean)));
                match asked {
                    Err(Refusal::TooSoon { earliest, .. }) => {
                        self.driver.order(now, arrive(TimeSpan::from_s(earliest.as_s() * OFFERED)))
                    }
                    Err(Refusal::TooSlow { latest, .. }) => {
                        self.driver.order(now, arrive(TimeSpan::from_s(latest.as_s() / OFFERED)))
                    }
                    asked => asked,
                }
            }
            Task::Follow => {
                let leader = self.leader;
                let leads_at = choice.between(MEANS[0], MEANS[1]);
                let leading =
                    self.prepared.models.get(&leader).ok_or(Refusal::UnknownTrain { train: leader })?;
                let step = nearest(leading, leads_at);
                self.driver.order(now, Order::Speed { train: leader, step })?;
                let follow = |gap| Order::Follow { train, leader, gap };
                match self.driver.order(now, follow(Gap::Time(TimeSpan::from_s(GAP)))) {
                    Err(Refusal::GapTooShort { shortest: Gap::Time(shortest), .. }) => {
                        let gap = Gap::Time(TimeSpan::from_s(shortest.as_s() * OFFERED));
                        self.driver.order(now, follow(gap))
                    }
                    asked => asked,
                }
            }
        }
    }

    fn target(&self, choice: &mut Choice) -> Option<Landmark> {
        self.target_at(choice.between(FAR[0], FAR[1]))
    }

    /// The place `far` mm ahead on the circuit.
    fn target_at(&self, far: f64) -> Option<Landmark> {
        let located = self.driver.locate(self.train, self.prepared.line.now())?;
        let ahead = self.circuit.ahead(self.layout, &self.prepared.turnouts, located.at, far);
        ahead.map(|(target, _)| target)
    }
}

/// The step nearest to a speed (mm/s) at which a train moves.
fn nearest(model: &MotionModel, mm_per_s: f64) -> SpeedStep {
    nearest_step(model, steps(model).filter(|step| model.uses(*step) == StepUse::Moves), mm_per_s)
}
