//! Trains commanded to stop at a place in time, beside trains that run there at the step with the mean speed.

use anyhow::Context;
use footplate_core::control::{Notice, Order, OrderId, Refusal, StopOrder};
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Length, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::counted::{Counted, cut_short};
use super::hold::{speed, steps, told_the_truth};
use super::tracked::LOOK;
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains};

/// How often each train is asked.
const ASKED_EACH: usize = 6;
/// How far it is (mm), ...
const FAR: [f64; 2] = [1800.0, 6000.0];
/// ... and with which mean speed that would be in time (mm/s), ...
const MEAN: [f64; 2] = [170.0, 320.0];
/// ... beside what a start and a stop take (s).
const START_AND_STOP: f64 = 1.5;
/// Who is asked on the run runs at about this speed (mm/s), for so long (s) before.
const RUNS_AT: f64 = 250.0;
const RUNS_FOR: f64 = 5.0;
/// Who could not be in time is asked again, with the time that was offered and so much more.
const OFFERED: f64 = 1.02;
/// An order that is not carried out so long (s) after its time has failed.
const PATIENCE: f64 = 30.0;
/// A train that has been commanded to stop stands after so long (s), whatever is believed.
const STANDS_WITHIN: f64 = 4.0;

/// Who drove.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum By {
    /// The driver, in time.
    Driver,
    /// The same driver with a model made of the truth: what is left is what no calibration could take away.
    Told,
    /// The driver, which stops there from the step with the mean speed.
    Step,
}

impl By {
    pub(super) const ALL: [Self; 3] = [Self::Driver, Self::Told, Self::Step];

    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Driver => "footplate",
            Self::Told => "footplate, told the train",
            Self::Step => "step of the mean speed",
        }
    }
}

/// What the train does that is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Began {
    /// It stands, far from the place.
    Rest,
    /// It stands less than that before the place, as it comes to those that are a round and a little ahead.
    RestNearBy,
    /// It runs.
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
    /// The time that was asked for (s) and the way (mm).
    pub(super) asked: [f64; 2],
    /// How late it stood (s), and how far beyond (mm).
    pub(super) late_and_beyond: Option<[f64; 2]>,
    /// Whether the time that was asked for first could not be, and another was offered.
    pub(super) refused: bool,
    pub(super) commands: usize,
    pub(super) trouble: Option<String>,
}

/// Everything that one train is asked, by everybody.
pub(super) fn arrive(
    layout: &Layout,
    stage: &PreparedTrains<'_>,
    way: &LongestCircuit,
    train: TrainId,
    choice: &mut Choice,
) -> anyhow::Result<Vec<Arrived>> {
    let start = *choice.of(&way.nodes).context("a way without a contact")?;
    let seed = choice.between(0.0, 1e9) as u64;
    let mut all = Vec::new();
    for by in By::ALL {
        let mut stage = stage.clone();
        stage.put(train, start, Length::from_mm(60.0))?;
        if by == By::Told {
            let told = told_the_truth(layout, &stage, way, train)?;
            stage.models.insert(train, told);
        }
        let mut trip = Trip {
            layout,
            way,
            train,
            by,
            choice: Choice::new(seed),
            counted: Counted::dispatched(stage.line.now(), stage.driver()),
            stage,
        };
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

/// One train on its way from target to target.
struct Trip<'a, 'l> {
    layout: &'l Layout,
    way: &'a LongestCircuit,
    train: TrainId,
    by: By,
    choice: Choice,
    stage: PreparedTrains<'l>,
    counted: Counted,
}

impl Trip<'_, '_> {
    fn now(&self) -> Timestamp {
        self.stage.line.now()
    }

    fn nearest(&self, mm_per_s: f64) -> SpeedStep {
        let model = self.stage.models.get(&self.train);
        let off = |step: &SpeedStep| model.map_or(0.0, |model| (speed(model, *step) - mm_per_s).abs());
        let nearest =
            model.and_then(|model| steps(model).min_by(|one, other| off(one).total_cmp(&off(other))));
        nearest.unwrap_or(SpeedStep::STAND)
    }

    /// A place about so far ahead (mm), and how far exactly it is to where it comes first: further than a round is beyond the
    /// place at which it was a round before.
    fn target(&mut self, far: f64, from_rest: bool) -> Option<(Landmark, f64)> {
        let located = self.counted.driver().locate(self.train, self.now())?;
        let mut at = self.way.nodes.iter().position(|node| *node == located.at.node)?;
        let mut way = -located.at.distance.as_mm();
        loop {
            let node = *self.way.nodes.get(at)?;
            let length = self.layout.open_hops_from(node, &self.stage.turnouts).next()?.length.as_mm();
            if way + length >= far {
                let offset = (far - way).max(0.0);
                let round = self.way.surveyed(self.layout, self.way.edges.len());
                // Who runs cannot stop for what is too near, and takes it the next time.
                let is_first = from_rest && way + offset > round;
                let ahead = if is_first { way + offset - round } else { way + offset };
                return Some((Landmark { node, offset: Length::from_mm(offset) }, ahead));
            }
            way += length;
            at = (at + 1) % self.way.nodes.len();
        }
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
        if !from_rest {
            let run = Order::Speed { train: self.train, step: self.nearest(RUNS_AT) };
            let _ = self.counted.order(self.now(), run);
            let until = self.now() + TimeSpan::from_s(RUNS_FOR);
            while self.counted.drive(&mut self.stage.line, until).is_some() {}
        }
        let far = self.choice.between(FAR[0], FAR[1]);
        let mean = self.choice.between(MEAN[0], MEAN[1]);
        let Some((target, way)) = self.target(far, from_rest) else {
            arrived.trouble = Some("nobody knows where it is".to_owned());
            return arrived;
        };
        if from_rest && way < FAR[0] {
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
        arrived.asked = [within.as_s(), way];
        let (by, incidents) = (self.now() + within, self.stage.world().incidents().len());
        match order {
            Ok(order) => {
                if let Err(trouble) = self.until_done(order, by + TimeSpan::from_s(PATIENCE)) {
                    arrived.trouble = Some(trouble);
                }
            }
            Err(why) => arrived.trouble = Some(why.to_string()),
        }
        let until = self.now() + TimeSpan::from_s(STANDS_WITHIN);
        while self.counted.drive(&mut self.stage.line, until).is_some() {}
        if self.stage.world().incidents().len() > incidents {
            arrived.trouble = Some("it came to grief".to_owned());
        }
        arrived.commands = self.counted.steps(self.train) - before;
        if arrived.trouble.is_none() {
            arrived.late_and_beyond = self.late_and_beyond(target, by);
        }
        arrived
    }

    fn order(&mut self, target: Landmark, within: TimeSpan, mean: f64) -> Result<OrderId, Refusal> {
        let train = self.train;
        let order = match self.by {
            By::Driver | By::Told => Order::Arrive { train, target, within },
            By::Step => {
                let step = Some(self.nearest(mean));
                Order::Stop(StopOrder { step, ..StopOrder::at(train, target) })
            }
        };
        self.counted.order(self.stage.line.now(), order)
    }

    fn until_done(&mut self, order: OrderId, patience: Timestamp) -> Result<(), String> {
        while self.now() < patience {
            let look = patience.min(self.now() + LOOK);
            let notice = self.counted.drive(&mut self.stage.line, look);
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
        let truth = self.stage.world().truth();
        let stood = truth.train(self.train)?.at_rest_since?;
        let past = truth.past(self.train, self.layout.sensor_at(target.node)?)?;
        let beyond = (past - target.offset).as_mm();
        let lap: f64 = self.way.edges.iter().map(|edge| truth.track().length(*edge).as_mm()).sum();
        // A contact that it has not come by yet is a round behind it, and the one behind it a round ahead.
        let beyond = beyond - lap * (beyond / lap).round();
        Some([(stood - by).as_s(), beyond])
    }
}
