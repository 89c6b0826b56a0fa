//! Arriving at a place in time, compared with running there at the step with the mean speed.

use anyhow::Context;
use footplate_core::control::{Notice, Order, OrderId, Refusal, StopOrder, WAIT_LIMIT};
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Length, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::counted::{By, Counted, cut_short, interrupts};
use super::hold::oracle_model;
use super::tracked::LOOK;
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains};

/// Orders for each train.
const ASKED_EACH: usize = 6;
/// The distances of the places (mm), ...
const FAR: [f64; 2] = [1800.0, 6000.0];
/// ... the mean speeds that are needed (mm/s), ...
const MEAN: [f64; 2] = [170.0, 320.0];
/// ... and the additional time for a start and a stop (s).
const START_AND_STOP: f64 = 1.5;
/// The approximate speed (mm/s) of a train that is running when it is ordered, and for how long it has run (s).
const RUNS_AT: f64 = 250.0;
const RUNS_FOR: f64 = 5.0;
/// An order that would be late is repeated with the offered time, and this factor.
const OFFERED: f64 = 1.02;
/// An order fails if it is not carried out this long (s) after its time.
const PATIENCE: f64 = 30.0;
/// A train that was commanded to stop is at rest after this time (s), whatever the estimate says.
const STANDS_WITHIN: f64 = 4.0;

/// The motion of the train when it is ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Began {
    /// At rest, far from the place.
    Rest,
    /// At rest, and nearer to the place: its place is a little more than a lap ahead.
    RestNearBy,
    /// Running.
    Run,
}

impl Began {
    pub(super) const ALL: [Self; 3] = [Self::Rest, Self::RestNearBy, Self::Run];

    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Rest => "at rest",
            Self::RestNearBy => "at rest, near by",
            Self::Run => "on the run",
        }
    }
}

/// One order.
#[derive(Debug, Clone)]
pub(super) struct Arrived {
    pub(super) by: By,
    pub(super) train: TrainId,
    pub(super) from: Began,
    /// The time that was ordered (s), and the distance (mm).
    pub(super) asked: [f64; 2],
    /// How late it was at rest (s), and how far beyond the place (mm).
    pub(super) late_and_beyond: Option<[f64; 2]>,
    /// Whether the first time was refused, and another one offered.
    pub(super) refused: bool,
    pub(super) commands: usize,
    pub(super) trouble: Option<String>,
}

/// Orders one train to several places, with each driver.
pub(super) fn arrive(
    layout: &Layout,
    prepared: &PreparedTrains<'_>,
    circuit: &LongestCircuit,
    train: TrainId,
    choice: &mut Choice,
) -> anyhow::Result<Vec<Arrived>> {
    let start = *choice.of(&circuit.nodes).context("a circuit without a sensor")?;
    let seed = choice.between(0.0, 1e9) as u64;
    let mut all = Vec::new();
    for by in By::ALL {
        let mut prepared = prepared.clone();
        prepared.put(train, start, Length::from_mm(60.0))?;
        if by == By::Oracle {
            let model = oracle_model(layout, &prepared, circuit, train)?;
            prepared.models.insert(train, model);
        }
        let mut counted = Counted::dispatched(prepared.line.now(), prepared.driver());
        if by == By::Footplate {
            let fit = prepared.fits.get(&train).cloned().map(|mut fit| {
                // It was put elsewhere since.
                fit.interrupt();
                fit
            });
            counted = counted.learning(layout, fit.into_iter().collect());
        }
        let mut trip = Trip { layout, circuit, train, by, choice: Choice::new(seed), counted, prepared };
        for nth in 0..ASKED_EACH {
            let arrived = trip.ask(nth % 2 == 0);
            let is_over = arrived.trouble.is_some();
            all.push(arrived);
            if is_over {
                break;
            }
        }
    }
    Ok(all)
}

/// One train that runs from target to target.
struct Trip<'a, 'l> {
    layout: &'l Layout,
    circuit: &'a LongestCircuit,
    train: TrainId,
    by: By,
    choice: Choice,
    prepared: PreparedTrains<'l>,
    counted: Counted,
}

impl Trip<'_, '_> {
    fn now(&self) -> Timestamp {
        self.prepared.line.now()
    }

    /// The place `far` mm ahead, and the distance (mm) after which the train reaches it for the first time: a place more than
    /// a lap ahead of a train at rest is reached a lap earlier.
    fn target(&self, far: f64, from_rest: bool) -> Option<(Landmark, f64)> {
        let located = self.counted.driver().locate(self.train, self.now())?;
        let (target, ahead) = self.circuit.ahead(self.layout, &self.prepared.turnouts, located.at, far)?;
        let lap = self.circuit.surveyed(self.layout, self.circuit.edges.len());
        // A running train cannot stop at a place that is too near, and stops there a lap later.
        Some((target, if from_rest && ahead > lap { ahead - lap } else { ahead }))
    }

    /// One order, from rest or on the run.
    fn ask(&mut self, from_rest: bool) -> Arrived {
        let mut arrived = Arrived {
            by: self.by,
            train: self.train,
            from: if from_rest { Began::Rest } else { Began::Run },
            asked: [0.0; 2],
            late_and_beyond: None,
            refused: false,
            commands: 0,
            trouble: None,
        };
        self.find();
        if !from_rest {
            let run =
                Order::Speed { train: self.train, step: self.prepared.nearest_step(self.train, RUNS_AT) };
            let _ = self.counted.order(self.now(), run);
            let until = self.now() + TimeSpan::from_s(RUNS_FOR);
            while self.counted.drive(&mut self.prepared.line, until).is_some() {}
        }
        let far = self.choice.between(FAR[0], FAR[1]);
        let mean = self.choice.between(MEAN[0], MEAN[1]);
        let Some((target, distance)) = self.target(far, from_rest) else {
            arrived.trouble = Some("its position is unknown".to_owned());
            return arrived;
        };
        if from_rest && distance < FAR[0] {
            arrived.from = Began::RestNearBy;
        }
        let mut within = TimeSpan::from_s(far / mean + if from_rest { START_AND_STOP } else { 0.0 });
        let before = self.counted.steps(self.train);
        let mut order = self.order(target, within, mean);
        if let Err(Refusal::TooSoon { earliest: time, .. } | Refusal::TooSlow { latest: time, .. }) = &order {
            let more = matches!(order, Err(Refusal::TooSoon { .. }));
            within = TimeSpan::from_s(time.as_s() * if more { OFFERED } else { 2.0 - OFFERED });
            arrived.refused = true;
            order = self.order(target, within, mean);
        }
        arrived.asked = [within.as_s(), distance];
        let (by, incidents) = (self.now() + within, self.prepared.world().incidents().len());
        match order {
            Ok(order) => {
                if let Err(trouble) = self.until_done(order, by + TimeSpan::from_s(PATIENCE)) {
                    arrived.trouble = Some(trouble);
                }
            }
            Err(why) => arrived.trouble = Some(why.to_string()),
        }
        let until = self.now() + TimeSpan::from_s(STANDS_WITHIN);
        while self.counted.drive(&mut self.prepared.line, until).is_some() {}
        arrived.trouble = self.prepared.grief_since(incidents).or_else(|| arrived.trouble.take());
        arrived.commands = self.counted.steps(self.train) - before;
        if arrived.trouble.is_none() {
            arrived.late_and_beyond = self.late_and_beyond(target, by);
        }
        arrived
    }

    /// Runs a train that a sensor should have reported and did not to the next one, as a session does before such an order.
    fn find(&mut self) {
        let is_found = |trip: &Self| trip.counted.driver().is_found(trip.train, trip.now());
        if is_found(self) {
            return;
        }
        let patience = self.now() + WAIT_LIMIT;
        for step in [self.counted.driver().finding_step(self.train), SpeedStep::STAND] {
            let _ = self.counted.order(self.now(), Order::Speed { train: self.train, step });
            while step > SpeedStep::STAND && self.now() < patience && !is_found(self) {
                let look = self.now() + LOOK;
                while self.counted.drive(&mut self.prepared.line, look).is_some() {}
            }
        }
        let until = self.now() + TimeSpan::from_s(STANDS_WITHIN);
        while self.counted.drive(&mut self.prepared.line, until).is_some() {}
    }

    fn order(&mut self, target: Landmark, within: TimeSpan, mean: f64) -> Result<OrderId, Refusal> {
        let train = self.train;
        let order = match self.by {
            By::Footplate | By::Oracle => Order::Arrive { train, target, within },
            By::Step => {
                let step = Some(self.prepared.nearest_step(self.train, mean));
                Order::Stop(StopOrder { step, ..StopOrder::at(train, target) })
            }
        };
        self.counted.order(self.prepared.line.now(), order)
    }

    fn until_done(&mut self, mut order: OrderId, mut patience: Timestamp) -> Result<(), String> {
        while self.now() < patience {
            let look = patience.min(self.now() + LOOK);
            let notice = self.counted.drive(&mut self.prepared.line, look);
            if notice.as_ref().is_some_and(|notice| interrupts(notice, self.train)) {
                patience = self.now() + WAIT_LIMIT;
            }
            if let Some(Notice::Resumed { interrupted: Some(before), order: now, .. }) = notice
                && before == order
            {
                order = now;
            }
            if let Some((_, ended, why)) = notice.as_ref().and_then(cut_short)
                && ended.is_none_or(|ended| ended == order)
            {
                return Err(why);
            }
            if let Some(Notice::Done(done)) = notice
                && done.order == order
            {
                return Ok(());
            }
        }
        Err("it did not arrive".to_owned())
    }

    fn late_and_beyond(&self, target: Landmark, by: Timestamp) -> Option<[f64; 2]> {
        let truth = self.prepared.world().truth();
        let stood = truth.train(self.train)?.at_rest_since?;
        let past = truth.past(self.train, self.layout.sensor_at(target.node)?)?;
        let beyond = (past - target.offset).as_mm();
        let lap: f64 = self.circuit.edges.iter().map(|edge| truth.track().length(*edge).as_mm()).sum();
        // A sensor that it has not passed yet is a lap behind it, and one that it has passed may be a lap ahead.
        let beyond = beyond - lap * (beyond / lap).round();
        Some([(stood - by).as_s(), beyond])
    }
}
