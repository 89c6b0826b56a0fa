//! One train that is told to do something over and over, on a layout with zones.

use anyhow::Context;
use footplate_core::control::{Driver, Gap, Notice, Order, OrderId, Refusal, StopOrder};
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Approach, Length, NodeId, Speed, SpeedStep, TimeSpan, TrainId};

use super::passage::{Passage, Watched};
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains};

/// How often the truth is looked at: a train of 400 mm/s runs 8 mm meanwhile.
const LOOK: TimeSpan = TimeSpan::from_ms(20);
/// How long each ride lasts (s).
const RIDES_FOR: f64 = 120.0;
/// Speeds that are asked for (mm/s), mean speeds of arrivals and of leaders, and how far ahead places are (mm).
const SPEEDS: [f64; 2] = [300.0, 450.0];
const MEANS: [f64; 2] = [170.0, 320.0];
const FAR: [f64; 2] = [1800.0, 6000.0];
/// A follower's gap (s).
const GAP: f64 = 4.0;
/// Contacts between the two at the beginning.
const APART: usize = 3;
/// Who was left behind so far that its leader comes round to it ends its ride when that is so near (mm): nobody holds back a
/// leader.
const ROUND: f64 = 500.0;
/// Between one order and the next (s).
const PAUSE: f64 = 2.0;
/// A time that was offered, and this part more, is asked for next.
const OFFERED: f64 = 1.02;
/// As far before and behind the shoe's leading end as any of the trains reaches (mm).
const REACH: [f64; 2] = [25.0, 145.0];

/// What it is told to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Told {
    /// Run at a step, on a layout of which nobody said that it is restricted.
    Unheeding,
    Speed,
    Stop,
    Hold,
    Arrive,
    Follow,
}

impl Told {
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

/// What came of it.
#[derive(Debug, Clone)]
pub(super) struct Ridden {
    pub(super) told: Told,
    pub(super) train: TrainId,
    pub(super) passages: Vec<Passage>,
    /// How far it ran (mm), in how long (s).
    pub(super) way: f64,
    pub(super) seconds: f64,
    /// Orders that were carried out.
    pub(super) done: usize,
    /// What went wrong.
    pub(super) trouble: Option<String>,
}

/// Lets a train ride, or two of which the first follows the second: what came of the first.
pub(super) fn ride<'l>(
    [plain, restricted]: [&'l Layout; 2],
    stage: &PreparedTrains<'l>,
    way: &LongestCircuit,
    [train, leader]: [TrainId; 2],
    told: Told,
    seed: u64,
) -> anyhow::Result<Ridden> {
    // All that is asked of one train begins alike.
    let mut choice = Choice::new(seed);
    let start = choice.between(0.0, way.nodes.len() as f64) as usize;
    let speed = choice.between(SPEEDS[0], SPEEDS[1]);
    let at = |further: usize| way.nodes.get((start + further) % way.nodes.len()).copied();
    let mut stage = stage.clone();
    stage.put(train, at(0).context("a way without a contact")?, Length::from_mm(60.0))?;
    if told == Told::Follow {
        stage.put(leader, at(APART).context("a way without a contact")?, Length::from_mm(60.0))?;
    }
    let drives_on = if told == Told::Unheeding { plain } else { restricted };
    let mut driver = stage.driver_on(drives_on);
    for train in [train, leader] {
        driver.set_reach(train, Length::from_mm(REACH[0]), Length::from_mm(REACH[1]));
    }
    let model = stage.models.get(&train).context("a train that was not calibrated")?.clone();
    let mut ride = Ride { layout: plain, way, train, leader, told, driver, stage, model, speed };
    Ok(ride.run(restricted, &mut choice))
}

struct Ride<'a, 'l> {
    layout: &'l Layout,
    way: &'a LongestCircuit,
    train: TrainId,
    leader: TrainId,
    told: Told,
    driver: Driver,
    stage: PreparedTrains<'l>,
    model: MotionModel,
    speed: f64,
}

impl Ride<'_, '_> {
    fn run(&mut self, restricted: &Layout, choice: &mut Choice) -> Ridden {
        let mut watched = Watched::new(restricted, self.train);
        let began = self.stage.line.now();
        let until = began + TimeSpan::from_s(RIDES_FOR);
        let odometer = self.odometer();
        let incidents = self.stage.world().incidents().len();
        let (mut done, mut trouble) = (0, None);
        let mut busy = None;
        let mut next = Some(began);
        while self.stage.line.now() < until && trouble.is_none() {
            if next.is_some_and(|at| at <= self.stage.line.now()) {
                next = None;
                match self.order(choice) {
                    Ok(order) => busy = Some(order),
                    Err(why) => trouble = Some(why.to_string()),
                }
            }
            let look = self.stage.line.now() + LOOK;
            while let Some(notice) = self.stage.line.drive(&mut self.driver, look) {
                match notice {
                    Notice::Done(finished) if Some(finished.order) == busy => {
                        done += 1;
                        let again = matches!(self.told, Told::Stop | Told::Arrive);
                        next = again.then(|| self.stage.line.now() + TimeSpan::from_s(PAUSE));
                    }
                    Notice::GivenUp { order, why, .. } if Some(order) == busy => {
                        trouble = Some(why.to_string());
                    }
                    _ => {}
                }
            }
            if self.told == Told::Follow && self.leader_comes_round() {
                trouble = Some("it was left behind so far that its leader came round to it".to_owned());
            }
            watched.look(self.stage.world().truth(), self.stage.line.now());
        }
        if self.stage.world().incidents().len() > incidents {
            trouble = Some("it came to grief".to_owned());
        }
        Ridden {
            told: self.told,
            train: self.train,
            passages: watched.passages,
            way: self.odometer() - odometer,
            seconds: (self.stage.line.now() - began).as_s(),
            done,
            trouble,
        }
    }

    /// Whether the leader is just behind its follower.
    fn leader_comes_round(&self) -> bool {
        let (layout, edges) = (self.driver.layout(), &self.way.edges);
        let round = self.way.surveyed(layout, edges.len());
        let place = |train| {
            let at = self.driver.position(train, self.stage.line.now())?;
            let nth = edges.iter().position(|edge| *edge == at.edge)?;
            Some(self.way.surveyed(layout, nth) + at.offset.as_mm())
        };
        let behind = |(train, leader): (f64, f64)| (train - leader).rem_euclid(round);
        place(self.train).zip(place(self.leader)).map(behind).is_some_and(|behind| behind < ROUND)
    }

    /// What the train's odometer shows (mm).
    fn odometer(&self) -> f64 {
        let truth = self.stage.world().truth().train(self.train);
        truth.map_or(0.0, |train| train.odometer.as_mm())
    }

    /// The next thing to do.
    fn order(&mut self, choice: &mut Choice) -> Result<OrderId, Refusal> {
        let (train, now) = (self.train, self.stage.line.now());
        match self.told {
            Told::Unheeding | Told::Speed => {
                let step = nearest(&self.model, self.speed);
                self.driver.order(now, Order::Speed { train, step })
            }
            Told::Hold => {
                // A train that cannot be as fast is held at what it can.
                let hold = |speed| Order::Hold { train, speed };
                let asked = self.driver.order(now, hold(Speed::from_mm_per_s(self.speed)));
                match asked {
                    Err(Refusal::SpeedOutOfRange { highest, .. }) => {
                        self.driver.order(now, hold(highest * 0.95))
                    }
                    asked => asked,
                }
            }
            Told::Stop => {
                let target = self.target(choice).ok_or(Refusal::Lost { train })?;
                self.driver.order(now, Order::Stop(StopOrder::at(train, target)))
            }
            Told::Arrive => {
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
            Told::Follow => {
                let leader = self.leader;
                let leads_at = choice.between(MEANS[0], MEANS[1]);
                let leading =
                    self.stage.models.get(&leader).ok_or(Refusal::UnknownTrain { train: leader })?;
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

    /// The place about so far ahead on the way round (mm).
    fn target_at(&self, far: f64) -> Option<Landmark> {
        let located = self.driver.locate(self.train, self.stage.line.now())?;
        let mut at = self.way.nodes.iter().position(|node| *node == located.at.node)?;
        let mut way = -located.at.distance.as_mm();
        loop {
            let node: NodeId = *self.way.nodes.get(at)?;
            let length = self.layout.open_hops_from(node, &self.stage.turnouts).next()?.length.as_mm();
            if way + length >= far {
                return Some(Landmark { node, offset: Length::from_mm((far - way).max(0.0)) });
            }
            way += length;
            at = (at + 1) % self.way.nodes.len();
        }
    }
}

/// The step of a train that is nearest to a speed (mm/s).
fn nearest(model: &MotionModel, mm_per_s: f64) -> SpeedStep {
    let steps = (1..=model.highest().get()).filter_map(SpeedStep::new);
    let moves = steps.filter(|step| model.uses(*step) == StepUse::Moves);
    let off = |step: &SpeedStep| (model.speed(*step, Approach::Below).value.as_mm_per_s() - mm_per_s).abs();
    moves.min_by(|one, other| off(one).total_cmp(&off(other))).unwrap_or(SpeedStep::STAND)
}
