//! One train from nothing known to stops and moves, each beside the truth.

use footplate_core::control::{Aim, Driver, Notice, Order, OrderId, StopOrder};
use footplate_core::track::{Landmark, Layout, TurnoutStates};
use footplate_core::{Approach, Length, NodeId, Ratio, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::{LawFamily, LivingSwitches, TrainTruth, VirtualStation};

use crate::choice::Choice;
use crate::rehearsal::{Calibrated, VirtualLine};

/// The train's address.
pub const TRAIN: TrainId = TrainId(24);
/// Steps of the decoders that all figures are about.
const HIGHEST: u8 = 14;
/// An order that is not carried out by then has failed.
const ORDER_PATIENCE_S: f64 = 60.0;
/// A train that was commanded to stop stands after this, in s.
const STANDS_WITHIN_S: f64 = 8.0;
/// How often the position is compared with the truth.
const LOOK: TimeSpan = TimeSpan::from_ms(200);
/// Mid steps are those with true speeds from here to there, top steps those that are faster, in mm/s: scatter is said
/// to be 4 mm about 390 and 21 mm about 612 mm/s.
const MID_MM_PER_S: std::ops::Range<f64> = 200.0..450.0;
const TOP_FROM_MM_PER_S: f64 = 500.0;
/// How far short moves are, in mm.
const SHORT_MOVES_MM: std::ops::Range<f64> = 20.0..400.0;
/// No loop has more contacts (chosen: half of those of Track A).
const MOST_CONTACTS: usize = 40;

/// How many of each are tried.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counts {
    pub(super) mid_stops: usize,
    pub(super) top_stops: usize,
    /// With each probability.
    pub(super) not_beyond: usize,
    pub(super) moves: usize,
}

/// What is counted of one train.
#[derive(Debug, Clone, Default)]
pub(super) struct Results {
    /// Errors of stops in mm, beyond the target if positive.
    pub(super) mid: Vec<f64>,
    pub(super) top: Vec<f64>,
    /// How far beyond stops ended that should not be beyond, by the probability allowed.
    pub(super) not_beyond: [Vec<f64>; 2],
    /// Distances ordered and gone, in mm.
    pub(super) moves: Vec<[f64; 2]>,
    /// How often the position was compared with the truth, and lay within the interval.
    pub(super) looks: [u32; 2],
    /// Orders that were refused or not carried out.
    pub(super) failed: u32,
    pub(super) mishaps: usize,
    /// Why orders failed.
    pub(super) failures: Vec<String>,
}

/// The probabilities of [`Results::not_beyond`], in percent.
pub(super) const NOT_BEYOND_PERCENT: [f64; 2] = [5.0, 1.0];

/// A world with one train that nothing is known of.
pub(super) fn world(layout: &Layout, seed: u64, law: LawFamily) -> anyhow::Result<VirtualLine<'_>> {
    let switches = LivingSwitches { law: Some(law), ..LivingSwitches::well_kept() };
    let station = VirtualStation::draw(layout, seed, &[TRAIN], &switches)?;
    Ok(VirtualLine::open(station)?)
}

/// What is asked of a train: the same whoever drives, as long as the train stands at the same places.
pub struct Plan {
    choice: Choice,
    /// Steps by their true speeds: a scorer's choice of what to ask, unknown to the driver.
    pub(super) mid: Vec<SpeedStep>,
    pub(super) top: Vec<SpeedStep>,
}

impl Plan {
    /// What is asked of a train in this world.
    #[must_use]
    pub fn new(line: &VirtualLine<'_>, seed: u64) -> Self {
        let truth = line.station.world().truth();
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

    /// A contact ahead on the way as the turnouts lie, somewhere between it and the next, and one of several steps.
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

    /// How far to move, in mm.
    pub(super) fn distance(&mut self) -> f64 {
        self.choice.between(SHORT_MOVES_MM.start, SHORT_MOVES_MM.end)
    }
}

/// Drives a calibrated train and compares what comes of it with the truth.
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

    /// Everything, in turn, as far as the train remains on the rails.
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
        self.results.mishaps = self.line.station.world().mishaps().len();
    }

    fn truth(&self) -> Option<TrainTruth> {
        self.line.station.world().truth().train(TRAIN)
    }

    /// One stop at a random place ahead, from one of several steps: how far beyond it the train came to rest, in mm.
    fn stop(&mut self, steps: &[SpeedStep], aim: Aim) -> Option<f64> {
        if !self.is_sound() {
            return None;
        }
        let (node, offset, step) = self.plan.stop(self.layout, self.line, self.driver.turnouts(), steps)?;
        let target = Landmark { node, offset };
        let order = StopOrder { train: TRAIN, target, aim, step: Some(step), next_round: true };
        let sensor = self.layout.sensor_at(target.node)?;
        self.carry_out(Order::Stop(order))?;
        let past = self.line.station.world().truth().past(TRAIN, sensor)?;
        Some((past - target.offset).as_mm())
    }

    /// A short move from rest.
    fn short_move(&mut self) {
        if !self.is_sound() {
            return;
        }
        let asked = self.plan.distance();
        let Some(before) = self.truth() else { return };
        let order = Order::Move { train: TRAIN, distance: Length::from_mm(asked) };
        if self.carry_out(order).is_some()
            && let Some(after) = self.truth()
        {
            self.results.moves.push([asked, (after.odometer - before.odometer).as_mm()]);
        }
    }

    fn is_sound(&self) -> bool {
        self.truth().is_some_and(|truth| !truth.is_wrecked)
    }

    /// Gives an order and waits until the train stands; nothing if it was refused or failed.
    fn carry_out(&mut self, order: Order) -> Option<()> {
        let now = self.line.now();
        let id = match self.driver.order(now, order) {
            Ok(id) => id,
            Err(refusal) => {
                self.results.failed += 1;
                self.results.failures.push(format!("{refusal:?}"));
                return None;
            }
        };
        let patience = now + TimeSpan::from_s(ORDER_PATIENCE_S);
        let done = self.until_done(id, patience);
        if done.is_none() {
            self.results.failed += 1;
            self.results.failures.push(format!("not done: {order:?}"));
            self.halt();
        }
        // Until the train really stands, whatever is believed.
        let patience = self.line.now() + TimeSpan::from_s(10.0);
        while self.line.now() < patience && self.truth().is_some_and(|truth| truth.at_rest_since.is_none()) {
            self.look_on(patience.min(self.line.now() + LOOK));
        }
        done
    }

    fn until_done(&mut self, id: OrderId, patience: Timestamp) -> Option<()> {
        while self.line.now() < patience && self.is_sound() {
            match self.look_on(self.line.now() + LOOK) {
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

    /// Drives on, and compares the position whenever nothing is said.
    fn look_on(&mut self, until: Timestamp) -> Option<Notice> {
        let notice = self.line.drive(&mut self.driver, until);
        if notice.is_none() {
            self.look();
        }
        notice
    }

    fn look(&mut self) {
        let now = self.line.now();
        let Some(located) = self.driver.locate(TRAIN, now) else { return };
        // As a person reads it: so many millimetres past a contact.
        let Some(said) = self.driver.landmark(TRAIN, located.at) else { return };
        let Some(sensor) = self.layout.sensor_at(said.node) else { return };
        let Some(past) = self.line.station.world().truth().past(TRAIN, sensor) else { return };
        let off = (past - said.offset).as_mm();
        self.results.looks[0] += 1;
        self.results.looks[1] += u32::from(off.abs() <= 1.96 * located.uncertainty.as_mm());
    }

    /// Finds a train again that was lost, as a person would: lets it run until it has come by a contact, and stops it.
    fn halt(&mut self) {
        let found_by = self.line.now() + TimeSpan::from_s(ORDER_PATIENCE_S);
        if let Some(step) = self.plan.mid.first().copied() {
            let _ = self.driver.order(self.line.now(), Order::Speed { train: TRAIN, step });
        }
        while self.line.now() < found_by && self.driver.locate(TRAIN, self.line.now()).is_none() {
            let until = found_by.min(self.line.now() + LOOK);
            let _ = self.line.drive(&mut self.driver, until);
        }
        let stand = Order::Speed { train: TRAIN, step: SpeedStep::STAND };
        let _ = self.driver.order(self.line.now(), stand);
        let until = self.line.now() + TimeSpan::from_s(STANDS_WITHIN_S);
        while self.line.drive(&mut self.driver, until).is_some() {}
    }
}

/// Contacts of the loop that the train is on, with the surveyed lengths to the next.
pub(super) fn ahead(layout: &Layout, line: &VirtualLine<'_>, turnouts: &TurnoutStates) -> Vec<(NodeId, f64)> {
    let position = line.station.world().truth().train(TRAIN).and_then(|truth| truth.position);
    let mut found: Vec<(NodeId, f64)> = Vec::new();
    let mut node = position.and_then(|at| layout.edge(at.edge)).map(|edge| edge.to);
    for _ in 0..MOST_CONTACTS {
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
