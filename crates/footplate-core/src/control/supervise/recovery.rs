//! The recovery of one train: it is stopped, located at a creep, and measured again.

use alloc::vec::Vec;

use crate::control::drive::{Order, OrderId, Refusal};
use crate::event::{Event, EventKind, Report};
use crate::ids::{NodeId, SpeedStep, TrainId};
use crate::model::MotionFit;
use crate::model::{MeasuredRatio, MotionModel, Rescaling, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::PassedContact;
use crate::units::Length;

use super::alarm::Alarm;
use super::trials::{SpeedTrial, Steps};
use super::watchdog::Watchdog;
use crate::control::{Notice, Outcome};

/// How far a train may be from its model in speed and stops until it has been measured again, as ln: engines differ by up to
/// a half at middle speeds, but at the step where one barely creeps another runs three times as fast.
pub(super) const DOUBTED: f64 = 0.8;
/// The uncertainty of a train that was located, after an unforeseen stop.
const ABOUT: Length = Length::from_mm(150.0);
/// A creep that meets no sensor goes a step up after this: the longest known hop, 1.5 m, at 110 mm/s.
const PUSH_AFTER: TimeSpan = TimeSpan::from_s(14.0);
/// Limits of the phases, after which a person is needed: coming to rest, ...
pub(super) const STANDS_WITHIN: TimeSpan = TimeSpan::from_s(30.0);
/// ... being located, which may take two hops at a creep and three steps up, ...
const FOUND_WITHIN: TimeSpan = TimeSpan::from_s(75.0);
/// ... and one speed, or one stop.
pub(super) const MEASURED_WITHIN: TimeSpan = TimeSpan::from_s(45.0);
/// A recovery reverses a train once to locate it, and once more where its track ends while it is measured.
const MOST_REVERSALS: u8 = 2;
/// A train that is lost this often while it is being found needs a person.
const MOST_LOST: u8 = 3;
/// Any train is at rest this long after its stop command (the longest published stop).
const SURELY_STANDS: TimeSpan = TimeSpan::from_s(5.0);

/// A train in danger.
#[derive(Debug, Clone)]
pub(super) struct Recovery {
    pub(super) why: Alarm,
    pub(super) interrupted: Option<(OrderId, Order)>,
    pub(super) phase: Phase,
    began: Timestamp,
    pub(super) by: Timestamp,
    /// As it was known before.
    pub(super) base: MotionModel,
    pub(super) steps: Steps,
    fit: MotionFit,
    pub(super) ratios: Vec<MeasuredRatio>,
    pub(super) change: Rescaling,
    pub(super) lesson: usize,
    /// How often it has reversed the train.
    reversals: u8,
    lost: u8,
}

/// The phase of a recovery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Phase {
    /// It comes to rest.
    Stopping,
    /// It is at rest and waits for its turn, for power, for the station, and for clearance to creep.
    Waiting { asked: bool },
    /// It creeps; `seen` is the sensor that it has passed.
    Crawling { step: SpeedStep, pushed: Timestamp, seen: Option<NodeId> },
    /// It reverses, to creep the other way; the sensor that reported it last, as it comes to it then.
    Turning { step: SpeedStep, seen: Option<NodeId> },
    /// It runs at a speed that is measured.
    Measuring { trial: SpeedTrial, from: SpeedStep },
    /// It stops short of a sensor by the new model.
    StoppingShort { order: OrderId, way: Length },
    /// It creeps to that sensor.
    Creeping { way: Length },
    /// It runs at a speed from which it is to stop, ...
    LearningSpeed { trial: SpeedTrial, from: SpeedStep },
    /// ... comes to rest from that ...
    LearningStop { until: Timestamp },
    /// ... and creeps to a sensor that shows where that was.
    LearningRest,
    /// The recovery is complete, and it comes to rest.
    Ending { outcome: Outcome },
    /// A person is needed.
    GivenUp,
}

impl Recovery {
    pub(super) fn new(
        now: Timestamp,
        base: MotionModel,
        why: Alarm,
        interrupted: Option<(OrderId, Order)>,
    ) -> Self {
        Self {
            why,
            interrupted,
            phase: Phase::Stopping,
            began: now,
            by: now + STANDS_WITHIN,
            steps: Steps::of(&base),
            fit: MotionFit::new(base.train(), base.highest()),
            base,
            ratios: Vec::new(),
            change: Rescaling::of(Vec::new()),
            lesson: 0,
            reversals: 0,
            lost: 0,
        }
    }

    /// The train as it was known before.
    pub(super) const fn base(&self) -> &MotionModel {
        &self.base
    }

    /// Whether it moves, or may, on commands of its recovery.
    pub(super) const fn is_active(&self) -> bool {
        !matches!(self.phase, Phase::Stopping | Phase::Waiting { .. } | Phase::GivenUp)
    }

    /// When its phase has to be examined, at the latest when it is over.
    pub(super) fn next_timeout(&self) -> Option<Timestamp> {
        match self.phase {
            Phase::Waiting { .. } | Phase::GivenUp => None,
            Phase::Crawling { pushed, .. } => Some(self.by.min(pushed + PUSH_AFTER)),
            Phase::LearningStop { until } => Some(self.by.min(until)),
            _ => Some(self.by),
        }
    }

    /// The speeds from which stops are learnt.
    pub(super) const fn lessons(&self) -> [SpeedStep; 4] {
        let Steps { middle, high, low, .. } = self.steps;
        [middle, high, low, middle]
    }
}

impl Watchdog {
    /// Takes the next step of every recovery that can go on.
    pub(super) fn go_on_recovering(&mut self, now: Timestamp) {
        let trains: Vec<TrainId> = self.dangers.keys().copied().collect();
        for train in trains {
            let Some(recovery) = self.dangers.get(&train) else { continue };
            match recovery.phase {
                Phase::Stopping
                    if !self.is_powered() || self.stops.stands(train).is_some_and(|stands| stands <= now) =>
                {
                    self.set_phase(train, Phase::Waiting { asked: false }, now);
                    self.wait(now, train, false);
                }
                Phase::Waiting { asked } => self.wait(now, train, asked),
                Phase::Crawling { step, pushed, seen } if now - pushed >= PUSH_AFTER && now < recovery.by => {
                    let next =
                        Some(recovery.base.next_knot(step)).filter(|next| *next <= recovery.steps.middle);
                    self.crawl(now, train, next.unwrap_or(step), seen);
                }
                Phase::LearningStop { until } if until <= now => {
                    let low = recovery.steps.low;
                    self.set_phase(train, Phase::LearningRest, now + MEASURED_WITHIN);
                    self.issue(now, Order::Speed { train, step: low });
                }
                Phase::Ending { outcome } if self.stops.stands(train).is_some_and(|stands| stands <= now) => {
                    self.recovered(now, train, outcome);
                }
                Phase::Measuring { trial, .. } if recovery.by <= now => self.skip(now, train, trial.step),
                Phase::GivenUp => {}
                _ if recovery.by <= now => self.need_person(now, train),
                _ => {}
            }
        }
    }

    pub(super) fn set_phase(&mut self, train: TrainId, phase: Phase, by: Timestamp) {
        if let Some(recovery) = self.dangers.get_mut(&train) {
            recovery.phase = phase;
            recovery.by = by;
        }
    }

    /// It is at rest: goes on when it is its turn and everything allows it.
    fn wait(&mut self, now: Timestamp, train: TrainId, asked: bool) {
        let is_free = self.is_powered() && !self.is_silent() && !self.stops.waits(train);
        let is_first = self.dangers.values().all(|other| !other.is_active());
        if !is_free || !is_first {
            return;
        }
        if !self.permits_all && !self.permitted.remove(&train) {
            if !asked {
                self.set_phase(train, Phase::Waiting { asked: true }, now);
                self.say(Notice::AsksToCreep { train });
            }
            return;
        }
        let Some(recovery) = self.dangers.get(&train) else { return };
        let is_about = matches!(recovery.why, Alarm::Drift(_) | Alarm::Misses | Alarm::Distrusted);
        match self.driver.locate(train, now).filter(|_| is_about) {
            Some(located) => self.driver.place(now, train, located.at, ABOUT.max(located.uncertainty)),
            None => {
                self.driver.lose(now, train);
                // Other trains are near, and the track may end ahead. What is behind the train it ran over.
                if !self.permits_all {
                    let seen = self.behind.get(&train).map(|node| node.reverse());
                    return match seen {
                        Some(_) => self.creep_back(now, train, seen),
                        None if self.is_clear_ahead(now, train) => self.creep_ahead(now, train),
                        None => self.need_person(now, train),
                    };
                }
            }
        }
        self.creep_ahead(now, train);
    }

    /// Creeps to the next sensor as the train faces.
    fn creep_ahead(&mut self, now: Timestamp, train: TrainId) {
        let Some(crawl) = self.dangers.get(&train).map(|recovery| recovery.steps.crawl) else { return };
        self.keep_clear(now, train);
        self.say(Notice::Creeps { train, step: crawl });
        if let Some(recovery) = self.dangers.get_mut(&train) {
            recovery.by = now + FOUND_WITHIN;
        }
        self.crawl(now, train, crawl, None);
    }

    /// Reverses and creeps back to the sensor that reported the train last.
    fn creep_back(&mut self, now: Timestamp, train: TrainId, seen: Option<NodeId>) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        let step = recovery.steps.crawl;
        recovery.reversals += 1;
        recovery.phase = Phase::Turning { step, seen };
        recovery.by = now + STANDS_WITHIN;
        // Behind it is where it came from.
        self.driver.set_end_of_authority(now, train, None);
        self.say(Notice::Creeps { train, step });
        self.issue(now, Order::Reverse { train, then: step });
    }

    fn crawl(&mut self, now: Timestamp, train: TrainId, step: SpeedStep, seen: Option<NodeId>) {
        if let Some(recovery) = self.dangers.get_mut(&train) {
            recovery.phase = Phase::Crawling { step, pushed: now, seen };
        }
        self.issue(now, Order::Speed { train, step });
    }

    /// A command to a train in recovery has left.
    pub(super) fn recovering_told(&mut self, now: Timestamp, event: &Event) {
        let (EventKind::Speed { train, .. } | EventKind::Reverse { train }) = event.kind else { return };
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        recovery.fit.take(self.driver.layout(), self.driver.turnouts(), event);
        if let (EventKind::Reverse { .. }, Phase::Turning { step, seen }) = (event.kind, recovery.phase) {
            recovery.phase = Phase::Crawling { step, pushed: now, seen };
            recovery.by = now + FOUND_WITHIN;
            self.keep_clear(now, train);
        } else if let EventKind::Speed { step, .. } = event.kind
            && let Phase::Measuring { trial, from } | Phase::LearningSpeed { trial, from } =
                &mut recovery.phase
            && trial.step == step
        {
            trial.commanded(&recovery.base, *from, event.time);
        }
    }

    /// A train in recovery has passed a sensor.
    pub(super) fn recovering_passed(&mut self, now: Timestamp, train: TrainId, passed: &PassedContact) {
        let Some(node) = self.driver.node_passed(passed) else { return };
        if !self.dangers.get(&train).is_some_and(|danger| matches!(danger.phase, Phase::Turning { .. })) {
            self.keep_clear(now, train);
        }
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        if passed.late.is_none() {
            recovery.fit.interrupt();
        }
        let report = Report { sensor: passed.sensor, poll_interval: Some(passed.window.width()) };
        let event = Event { time: passed.window.until, kind: EventKind::Sensor(report) };
        recovery.fit.take(self.driver.layout(), self.driver.turnouts(), &event);
        let commanded = self.driver.commanded(train);
        match recovery.phase {
            Phase::Crawling { step, seen: Some(seen), .. } => {
                recovery.fit.note_use(step, StepUse::Moves);
                // Two sensors that follow each other say which way it runs, and so does one from both sides.
                if node == seen || self.driver.hop_length(train, seen, node).is_some() {
                    self.say(Notice::Located { train });
                    self.measure(now, train);
                } else {
                    self.crawl(now, train, step, Some(node));
                }
            }
            Phase::Crawling { step, seen: None, .. } => {
                recovery.phase = Phase::Crawling { step, pushed: now, seen: Some(node) };
            }
            Phase::Measuring { mut trial, from } => {
                let hop = trial.last().and_then(|last| self.driver.hop_length(train, last, node));
                trial.pass(node, passed.window, hop);
                recovery.phase = Phase::Measuring { trial, from };
                if trial.is_over() {
                    recovery.fit.note_use(trial.step, StepUse::Moves);
                    let ratio = trial.ratio(&recovery.base);
                    recovery.ratios.extend(ratio);
                    if let Some(MeasuredRatio { step, ratio, deviation }) = ratio {
                        self.say(Notice::SpeedMeasured { train, step, ratio, deviation });
                    }
                    self.measure(now, train);
                }
            }
            Phase::Creeping { way } => self.check_stop(now, train, way, passed),
            Phase::LearningSpeed { mut trial, from } => {
                trial.pass(node, passed.window, None);
                recovery.phase = Phase::LearningSpeed { trial, from };
                if trial.last().is_some() && commanded == trial.step {
                    let until = now + SURELY_STANDS + SURELY_STANDS;
                    self.set_phase(train, Phase::LearningStop { until }, until + MEASURED_WITHIN);
                    self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
                }
            }
            Phase::LearningRest => self.next_lesson(now, train),
            _ => {}
        }
    }

    /// An order of a recovery has been carried out, or not.
    pub(super) fn recovering_done(
        &mut self,
        now: Timestamp,
        train: TrainId,
        done: OrderId,
        why: Option<&Refusal>,
    ) {
        let Some(recovery) = self.dangers.get(&train) else { return };
        let Phase::StoppingShort { order, way } = recovery.phase else { return };
        if order != done {
            return;
        }
        let crawl = recovery.steps.crawl;
        if why.is_none() {
            self.set_phase(train, Phase::Creeping { way }, now + MEASURED_WITHIN);
            self.issue(now, Order::Speed { train, step: crawl });
        } else {
            self.end_rescaled(now, train);
        }
    }

    /// The track ahead of a train in recovery ends, or another train is there.
    pub(super) fn recovering_blocked(&mut self, now: Timestamp, train: TrainId) {
        match self.dangers.get(&train).map(|recovery| recovery.phase) {
            Some(Phase::Crawling { .. } | Phase::Measuring { .. }) => self.turn_or_decide(now, train),
            Some(Phase::Creeping { .. } | Phase::StoppingShort { .. }) => self.end_rescaled(now, train),
            Some(Phase::LearningSpeed { .. } | Phase::LearningRest) => {
                self.end(now, train, Outcome::LearntAnew);
            }
            _ => {}
        }
    }

    /// Its place was lost again: it is located once more.
    pub(super) fn recovering_lost(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        recovery.lost += 1;
        if recovery.lost >= MOST_LOST {
            return self.need_person(now, train);
        }
        let (crawl, reversals) = (recovery.steps.crawl, recovery.reversals);
        recovery.ratios.clear();
        recovery.by = now + FOUND_WITHIN;
        if self.permits_all {
            return self.crawl(now, train, crawl, None);
        }
        // Ahead the track may end or be reserved for others; the train ran over the track behind it.
        match self.behind.get(&train).map(|node| node.reverse()) {
            seen @ Some(_) if reversals < MOST_REVERSALS => self.creep_back(now, train, seen),
            _ => self.need_person(now, train),
        }
    }

    fn turn_or_decide(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        if recovery.ratios.iter().any(|one| one.deviation.is_finite()) {
            // What has been measured has to do for the rest.
            let Steps { middle, low, high, .. } = recovery.steps;
            for step in [middle, low, high] {
                if recovery.ratios.iter().all(|one| one.step != step) {
                    recovery.ratios.push(MeasuredRatio { step, ratio: 1.0, deviation: f64::INFINITY });
                }
            }
            return self.measure(now, train);
        }
        let seen = match recovery.phase {
            Phase::Crawling { seen, .. } => seen.map(|node| node.reverse()),
            _ => None,
        };
        let most = if matches!(recovery.phase, Phase::Measuring { .. }) { MOST_REVERSALS } else { 1 };
        if recovery.reversals >= most {
            return self.need_person(now, train);
        }
        self.creep_back(now, train, seen);
    }

    /// Everything is known: the train comes to rest.
    pub(super) fn end(&mut self, now: Timestamp, train: TrainId, outcome: Outcome) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        let model = match outcome {
            Outcome::AsBefore => recovery.base.clone(),
            Outcome::Rescaled { .. } => recovery.base.rescaled(&recovery.change),
            Outcome::LearntAnew => {
                self.driver.refit(&mut recovery.fit);
                recovery.fit.model().clone()
            }
        };
        self.driver.set_model(model);
        self.set_phase(train, Phase::Ending { outcome }, now + STANDS_WITHIN);
        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
    }

    /// It is at rest, and known again.
    fn recovered(&mut self, now: Timestamp, train: TrainId, outcome: Outcome) {
        let Some(recovery) = self.dangers.remove(&train) else { return };
        self.driver.set_end_of_authority(now, train, None);
        if let Some(monitor) = self.monitors.get_mut(&train) {
            monitor.place();
        }
        self.say(Notice::Recovered { train, outcome, took: now - recovery.began });
        if self.dangers.is_empty() {
            let held = core::mem::take(&mut self.held);
            let interrupted = held.into_iter().filter_map(|(train, order)| Some((train, order?)));
            let own = recovery.interrupted.map(|order| (train, order));
            for (train, (id, order)) in interrupted.chain(own).collect::<Vec<_>>() {
                self.resume(now, train, id, order);
            }
        } else {
            // It is held until no other train is in danger.
            self.held.insert(train, recovery.interrupted);
        }
    }

    fn resume(&mut self, now: Timestamp, train: TrainId, id: OrderId, order: Order) {
        // How far a move or a reversal had got is unknown.
        let can_go_on = self.resumes() && !matches!(order, Order::Move { .. } | Order::Reverse { .. });
        let resumed = if can_go_on { self.order(now, order).ok() } else { None };
        match resumed {
            Some(order) => self.say(Notice::Resumed { train, interrupted: Some(id), order }),
            None => self.say(Notice::Cancelled { train, order }),
        }
    }

    /// The recovery has failed: a person is needed.
    pub(super) fn need_person(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        let while_it = match recovery.phase {
            Phase::Stopping | Phase::Waiting { .. } | Phase::Ending { .. } => {
                "while it was being \
                                                                               stopped"
            }
            Phase::Crawling { .. } | Phase::Turning { .. } => "while it crept to a sensor",
            Phase::GivenUp => return,
            _ => "while it was measured again",
        };
        recovery.phase = Phase::GivenUp;
        let order = recovery.interrupted.take();
        self.say(Notice::NeedsOperator { train, while_it });
        if let Some((_, order)) = order {
            self.say(Notice::Cancelled { train, order });
        }
        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
    }
}
