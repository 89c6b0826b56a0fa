//! The recovery of a train: stop it, creep to locate it, measure it again.

use alloc::vec::Vec;

use crate::control::dispatch::Reservation;
use crate::control::drive::{Order, OrderId, Refusal};
use crate::event::{Event, EventKind, Report};
use crate::ids::{EdgeId, NodeId, SensorId, SpeedStep, TrainId};
use crate::model::MotionFit;
use crate::model::{MeasuredRatio, MotionModel, Rescaling, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::PassedSensor;
use crate::units::Length;

use super::alarm::Alarm;
use super::facing::was_turned;
use super::recovery_phase::RecoveryPhase;
use super::trials::Steps;
use super::watchdog::Watchdog;
use crate::control::{Notice, Outcome};

/// One standard deviation of ln of a train's speeds and stops over its model's until it has been measured again:
/// locomotives differ by up to a half at medium speeds, but at a step at which one barely creeps another is three
/// times as fast.
pub(super) const UNKNOWN_RATIO: f64 = 0.8;
/// The uncertainty of a located train after an unplanned stop.
const ABOUT: Length = Length::from_mm(150.0);
/// The creeping step is raised after this time without a detection: the longest known hop, 1.5 m, at 110 mm/s.
const PUSH_AFTER: TimeSpan = TimeSpan::from_s(14.0);
/// Time limits of the phases, after which an operator is needed: coming to rest, ...
pub(super) const STOPPED_WITHIN: TimeSpan = TimeSpan::from_s(30.0);
/// ... being located, which may take two hops at creeping speed and three raised steps, ...
const LOCATED_WITHIN: TimeSpan = TimeSpan::from_s(75.0);
/// ... and measuring one speed or one stop.
pub(super) const MEASURED_WITHIN: TimeSpan = TimeSpan::from_s(45.0);
/// A recovery reverses a train once to locate it, and once more if its track ends while it is measured.
const MAX_REVERSALS: u8 = 2;
/// A train that is lost this often during its recovery needs an operator.
const MAX_LOST: u8 = 3;
/// Any train is at rest this long after its stop command (the longest published stop).
const LONGEST_STOP: TimeSpan = TimeSpan::from_s(5.0);

/// A train in danger.
#[derive(Debug, Clone)]
pub(super) struct Recovery {
    pub(super) why: Alarm,
    pub(super) interrupted: Option<(OrderId, Order)>,
    /// The edge along which it faced.
    faced: Option<EdgeId>,
    pub(super) phase: RecoveryPhase,
    began: Timestamp,
    pub(super) by: Timestamp,
    /// The model from before the alarm.
    pub(super) base: MotionModel,
    pub(super) steps: Steps,
    pub(super) fit: MotionFit,
    pub(super) ratios: Vec<MeasuredRatio>,
    pub(super) change: Rescaling,
    pub(super) lessons_taken: usize,
    /// How often the train has reversed.
    reversals: u8,
    lost: u8,
    /// The track that a dispatcher has reserved for others.
    pub(super) closed: Option<Reservation>,
}

impl Recovery {
    pub(super) fn new(
        now: Timestamp,
        base: MotionModel,
        why: Alarm,
        interrupted: Option<(OrderId, Order)>,
        faced: Option<EdgeId>,
    ) -> Self {
        Self {
            why,
            interrupted,
            faced,
            phase: RecoveryPhase::Stopping,
            began: now,
            by: now + STOPPED_WITHIN,
            steps: Steps::of(&base),
            fit: MotionFit::new(base.train(), base.highest()),
            base,
            ratios: Vec::new(),
            change: Rescaling::of(Vec::new()),
            lessons_taken: 0,
            reversals: 0,
            lost: 0,
            closed: None,
        }
    }

    /// The model from before the alarm.
    pub(super) const fn base(&self) -> &MotionModel {
        &self.base
    }

    /// Whether the train may move on commands of its recovery.
    pub(super) const fn is_active(&self) -> bool {
        !matches!(
            self.phase,
            RecoveryPhase::Stopping | RecoveryPhase::Waiting { .. } | RecoveryPhase::GivenUp
        )
    }

    /// Whether the train was located and runs, or is about to, so that its speeds and stops are measured.
    pub(super) const fn is_measuring(&self) -> bool {
        let is_done = matches!(self.phase, RecoveryPhase::Ending { .. } | RecoveryPhase::Turning { .. });
        self.is_active() && !self.is_searched() && !is_done
    }

    /// Begins again once the train is at rest; it was commanded to stop.
    pub(super) fn begin_again(&mut self, now: Timestamp) {
        self.phase = RecoveryPhase::Stopping;
        self.by = now + STOPPED_WITHIN;
    }

    /// Whether its position was about right when the alarm came: its speed was not.
    const fn is_roughly_located(&self) -> bool {
        matches!(self.why, Alarm::Drift(_) | Alarm::Misses | Alarm::Distrusted)
    }

    /// Whether it was begun by a report that turns out to be no train's, and nothing else has been done yet than to stop the train.
    pub(super) fn is_refuted_by(&self, sensor: SensorId, time: Timestamp) -> bool {
        self.why == Alarm::Untimely(sensor) && time <= self.began && self.phase == RecoveryPhase::Stopping
    }

    /// Whether it is searched, or will be once it is at rest.
    pub(super) const fn is_searched(&self) -> bool {
        match self.phase {
            RecoveryPhase::Locating { .. } | RecoveryPhase::Reversing { .. } => true,
            RecoveryPhase::Stopping | RecoveryPhase::Waiting { .. } => !self.is_roughly_located(),
            _ => false,
        }
    }

    /// An operator is needed; returns the order that it had interrupted.
    pub(super) const fn give_up(&mut self) -> Option<(OrderId, Order)> {
        self.phase = RecoveryPhase::GivenUp;
        self.interrupted.take()
    }

    /// Whether it creeps to be located.
    pub(super) const fn creeps(&self) -> bool {
        matches!(self.phase, RecoveryPhase::Locating { .. })
    }

    /// When its phase has to be checked.
    pub(super) fn next_timeout(&self) -> Option<Timestamp> {
        match self.phase {
            RecoveryPhase::Waiting { .. } | RecoveryPhase::GivenUp => None,
            RecoveryPhase::Locating { pushed, .. } => Some(self.by.min(pushed + PUSH_AFTER)),
            RecoveryPhase::LearningStop { until } => Some(self.by.min(until)),
            _ => Some(self.by),
        }
    }

    /// The steps from which stops are learnt.
    pub(super) const fn lessons(&self) -> [SpeedStep; 4] {
        let Steps { middle, high, low, .. } = self.steps;
        [middle, high, low, middle]
    }
}

impl Watchdog {
    /// Advances every recovery that can continue.
    pub(super) fn advance_recoveries(&mut self, now: Timestamp) {
        let trains: Vec<TrainId> = self.dangers.keys().copied().collect();
        for train in trains {
            let Some(recovery) = self.dangers.get(&train) else { continue };
            match recovery.phase {
                RecoveryPhase::Stopping
                    if !self.is_powered()
                        || self.stops.at_rest(train).is_some_and(|at_rest| at_rest <= now) =>
                {
                    self.set_phase(train, RecoveryPhase::Waiting { has_asked: false }, now);
                    self.wait(now, train, false);
                }
                RecoveryPhase::Waiting { has_asked } => self.wait(now, train, has_asked),
                RecoveryPhase::Locating { step, pushed, seen }
                    if now - pushed >= PUSH_AFTER && now < recovery.by =>
                {
                    let next =
                        Some(recovery.base.next_knot(step)).filter(|next| *next <= recovery.steps.middle);
                    self.creep(now, train, next.unwrap_or(step), seen);
                }
                RecoveryPhase::LearningStop { until } if until <= now => {
                    let low = recovery.steps.low;
                    self.set_phase(train, RecoveryPhase::LearningRest, now + MEASURED_WITHIN);
                    self.issue(now, Order::Speed { train, step: low });
                }
                RecoveryPhase::Ending { outcome }
                    if self.stops.at_rest(train).is_some_and(|at_rest| at_rest <= now) =>
                {
                    let turns = !recovery.reversals.is_multiple_of(2)
                        && self.driver.stays_located_reversed(train, now)
                        && !self.has_pushed_over_points(now, train);
                    if turns {
                        self.set_phase(train, RecoveryPhase::Turning { outcome }, now + STOPPED_WITHIN);
                        self.issue(now, Order::Reverse { train, then: SpeedStep::STAND });
                    } else {
                        self.recovered(now, train, outcome);
                    }
                }
                RecoveryPhase::Measuring { trial, .. } if recovery.by <= now => {
                    self.skip(now, train, trial.step);
                }
                RecoveryPhase::GivenUp => {}
                _ if recovery.by <= now => self.need_operator(now, train),
                _ => {}
            }
        }
    }

    pub(super) fn set_phase(&mut self, train: TrainId, phase: RecoveryPhase, by: Timestamp) {
        if let Some(recovery) = self.dangers.get_mut(&train) {
            recovery.phase = phase;
            recovery.by = by;
        }
    }

    /// Starts the recovery of a train at rest when it is its turn and all conditions are met.
    fn wait(&mut self, now: Timestamp, train: TrainId, has_asked: bool) {
        let is_free = self.is_powered() && !self.is_silent() && !self.stops.is_pending(train);
        let is_first = self.dangers.values().all(|other| !other.is_active());
        if !is_free || !is_first {
            return;
        }
        let closed = self.permitted.remove(&train);
        if !self.permits_all && closed.is_none() {
            if !has_asked {
                self.set_phase(train, RecoveryPhase::Waiting { has_asked: true }, now);
                self.notify(Notice::AsksToCreep { train });
            }
            return;
        }
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        recovery.closed = closed;
        let is_roughly_located = recovery.is_roughly_located();
        match self.driver.locate(train, now).filter(|_| is_roughly_located) {
            Some(located) => self.driver.place(now, train, located.at, ABOUT.max(located.uncertainty)),
            None => {
                self.driver.lose(now, train);
                return self.search(now, train);
            }
        }
        self.creep_ahead(now, train);
    }

    /// Creeps to locate a lost train. Other trains may be near, and the track may end ahead; behind the train is track that it ran
    /// over. Without a dispatcher, a train that was not detected elsewhere creeps ahead even where nothing shows that this is safe.
    fn search(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get(&train) else { return };
        let may_reverse = recovery.reversals < MAX_REVERSALS;
        let was_moved = matches!(recovery.why, Alarm::Elsewhere(_));
        let is_clear_ahead = self.is_clear_ahead(now, train);
        match self.sensor_behind(now, train) {
            _ if self.permits_all && is_clear_ahead => self.creep_ahead(now, train),
            seen @ Some(_) if may_reverse => self.creep_back(now, train, seen),
            _ if is_clear_ahead || self.permits_all && !was_moved => self.creep_ahead(now, train),
            _ => self.need_operator(now, train),
        }
    }

    /// Creeps ahead to the next sensor.
    fn creep_ahead(&mut self, now: Timestamp, train: TrainId) {
        let Some(creep) = self.dangers.get(&train).map(|recovery| recovery.steps.creep) else { return };
        self.keep_clear(now, train);
        self.notify(Notice::Creeps { train, step: creep });
        if let Some(recovery) = self.dangers.get_mut(&train) {
            recovery.by = now + LOCATED_WITHIN;
        }
        self.creep(now, train, creep, None);
    }

    /// Reverses and creeps back to the sensor that reported the train last.
    fn creep_back(&mut self, now: Timestamp, train: TrainId, seen: Option<NodeId>) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        let step = recovery.steps.creep;
        recovery.reversals += 1;
        recovery.phase = RecoveryPhase::Reversing { step, seen };
        recovery.by = now + STOPPED_WITHIN;
        self.driver.set_end_of_authority(now, train, None);
        self.notify(Notice::Creeps { train, step });
        self.issue(now, Order::Reverse { train, then: step });
    }

    fn creep(&mut self, now: Timestamp, train: TrainId, step: SpeedStep, seen: Option<NodeId>) {
        if let Some(recovery) = self.dangers.get_mut(&train) {
            recovery.phase = RecoveryPhase::Locating { step, pushed: now, seen };
        }
        self.issue(now, Order::Speed { train, step });
    }

    /// A command to a train in recovery was sent.
    pub(super) fn recovery_command_sent(&mut self, now: Timestamp, event: &Event) {
        let (EventKind::Speed { train, .. } | EventKind::Reverse { train }) = event.kind else { return };
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        recovery.fit.take(self.driver.layout(), self.driver.turnouts(), event);
        if let (EventKind::Reverse { .. }, RecoveryPhase::Reversing { step, seen }) =
            (event.kind, recovery.phase)
        {
            recovery.phase = RecoveryPhase::Locating { step, pushed: now, seen };
            recovery.by = now + LOCATED_WITHIN;
            self.keep_clear(now, train);
        } else if let (EventKind::Reverse { .. }, RecoveryPhase::Turning { outcome }) =
            (event.kind, recovery.phase)
        {
            self.recovered(now, train, outcome);
        } else if let EventKind::Speed { step, .. } = event.kind
            && let RecoveryPhase::Measuring { trial, from } | RecoveryPhase::LearningSpeed { trial, from } =
                &mut recovery.phase
            && trial.step == step
        {
            trial.commanded(&recovery.base, *from, event.time);
        }
    }

    /// A train in recovery has passed a sensor.
    pub(super) fn recovery_passed(&mut self, now: Timestamp, train: TrainId, passed: &PassedSensor) {
        let Some(node) = self.driver.node_passed(passed) else { return };
        if !self
            .dangers
            .get(&train)
            .is_some_and(|danger| matches!(danger.phase, RecoveryPhase::Reversing { .. }))
        {
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
            RecoveryPhase::Locating { step, seen: Some(seen), .. } => {
                recovery.fit.note_use(step, StepUse::Moves);
                // Two consecutive sensors show its direction, and so does one sensor passed in both directions.
                if node == seen || self.driver.hop_length(train, seen, node).is_some() {
                    self.undirected.remove(&train);
                    self.notify(Notice::Located { train });
                    self.measure(now, train);
                } else {
                    self.creep(now, train, step, Some(node));
                }
            }
            RecoveryPhase::Locating { step, seen: None, .. } => {
                recovery.phase = RecoveryPhase::Locating { step, pushed: now, seen: Some(node) };
            }
            RecoveryPhase::Measuring { mut trial, from } => {
                let hop = trial.last().and_then(|last| self.driver.hop_length(train, last, node));
                trial.pass(node, passed.window, hop);
                recovery.phase = RecoveryPhase::Measuring { trial, from };
                if trial.is_over() {
                    recovery.fit.note_use(trial.step, StepUse::Moves);
                    let ratio = trial.ratio(&recovery.base);
                    recovery.ratios.extend(ratio);
                    if let Some(MeasuredRatio { step, ratio, deviation }) = ratio {
                        self.notify(Notice::SpeedMeasured { train, step, ratio, deviation });
                    }
                    self.measure(now, train);
                }
            }
            RecoveryPhase::Creeping { distance } => self.check_stop(now, train, distance, passed),
            RecoveryPhase::LearningSpeed { mut trial, from } => {
                trial.pass(node, passed.window, None);
                recovery.phase = RecoveryPhase::LearningSpeed { trial, from };
                if trial.last().is_some() && commanded == trial.step {
                    let until = now + LONGEST_STOP + LONGEST_STOP;
                    self.set_phase(train, RecoveryPhase::LearningStop { until }, until + MEASURED_WITHIN);
                    self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
                }
            }
            RecoveryPhase::LearningRest => self.learn_next(now, train),
            _ => {}
        }
    }

    /// An order of a recovery was carried out or given up.
    pub(super) fn recovery_order_ended(
        &mut self,
        now: Timestamp,
        train: TrainId,
        done: OrderId,
        why: Option<&Refusal>,
    ) {
        let Some(recovery) = self.dangers.get(&train) else { return };
        let RecoveryPhase::StoppingShort { order, distance } = recovery.phase else { return };
        if order != done {
            return;
        }
        let creep = recovery.steps.creep;
        if why.is_none() {
            self.set_phase(train, RecoveryPhase::Creeping { distance }, now + MEASURED_WITHIN);
            self.issue(now, Order::Speed { train, step: creep });
        } else {
            self.end_rescaled(now, train);
        }
    }

    /// The track ahead of a train in recovery ends, or another train is there.
    pub(super) fn recovery_blocked(&mut self, now: Timestamp, train: TrainId) {
        match self.dangers.get(&train).map(|recovery| recovery.phase) {
            Some(RecoveryPhase::Locating { .. } | RecoveryPhase::Measuring { .. }) => {
                self.reverse_or_conclude(now, train);
            }
            Some(RecoveryPhase::Creeping { .. } | RecoveryPhase::StoppingShort { .. }) => {
                self.end_rescaled(now, train);
            }
            Some(RecoveryPhase::LearningSpeed { .. } | RecoveryPhase::LearningRest) => {
                self.end(now, train, Outcome::LearntAnew);
            }
            _ => {}
        }
    }

    /// The position was lost again: locates the train once more.
    pub(super) fn recovery_lost(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        recovery.lost += 1;
        if recovery.lost >= MAX_LOST {
            return self.need_operator(now, train);
        }
        recovery.ratios.clear();
        self.search(now, train);
    }

    fn reverse_or_conclude(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        if recovery.ratios.iter().any(|one| one.deviation.is_finite()) {
            // The speeds measured so far are used for the others.
            let Steps { middle, low, high, .. } = recovery.steps;
            for step in [middle, low, high] {
                if recovery.ratios.iter().all(|one| one.step != step) {
                    recovery.ratios.push(MeasuredRatio { step, ratio: 1.0, deviation: f64::INFINITY });
                }
            }
            return self.measure(now, train);
        }
        let seen = match recovery.phase {
            RecoveryPhase::Locating { seen, .. } => seen.map(|node| node.reverse()),
            _ => None,
        };
        let most = if matches!(recovery.phase, RecoveryPhase::Measuring { .. }) { MAX_REVERSALS } else { 1 };
        if recovery.reversals >= most || self.has_pushed_over_points(now, train) {
            return self.need_operator(now, train);
        }
        self.creep_back(now, train, seen);
    }

    /// The train is at rest and its recovery complete.
    fn recovered(&mut self, now: Timestamp, train: TrainId, outcome: Outcome) {
        let Some(recovery) = self.dangers.remove(&train) else { return };
        self.driver.set_end_of_authority(now, train, None);
        if let Some(monitor) = self.monitors.get_mut(&train) {
            monitor.place();
        }
        self.notify(Notice::Recovered { train, outcome, took: now - recovery.began });
        self.clear_intruder();
        let faces = self.driver.position(train, now).map(|place| place.edge);
        let is_turned = recovery
            .faced
            .zip(faces)
            .is_some_and(|(before, faces)| was_turned(self.driver.layout(), before, faces));
        if let Some((id, order)) = recovery.interrupted.filter(|_| is_turned) {
            // It was meant for the other direction.
            self.cancel(train, id, order);
        }
        let own = recovery.interrupted.filter(|_| !is_turned);
        if self.dangers.is_empty() {
            let held = core::mem::take(&mut self.held);
            let interrupted = held.into_iter().chain([(train, own)]);
            for (train, (id, order)) in interrupted.filter_map(|(train, order)| Some((train, order?))) {
                self.resume(now, train, id, order);
            }
        } else {
            // Hold it until no other train is in danger.
            self.held.insert(train, own);
        }
    }
}
