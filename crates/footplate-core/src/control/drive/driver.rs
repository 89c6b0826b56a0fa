//! The driver: carries out orders, one report at a time.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use crate::control::{Machine, Notice, Output};
use crate::event::{Command, Event, EventKind, Report};
use crate::ids::{SensorId, SpeedStep, TrainId, TurnoutId};
use crate::link::{DetectionWindow, TimeModel};
use crate::model::{MotionModel, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Landmark, Layout, Leg, TurnoutStates};
use crate::tracking::{Located, Locator, PathPoint, landmark_of};
use crate::units::Length;

use super::ambiguity::Branch;
use super::data_association::{Association, DataAssociation, Resolution};
use super::driven_train::DrivenTrain;
use super::hypotheses::{Detection, Explanation, Hypothesis};
use super::order::{Aim, Order, OrderId, StopOrder};
use super::outputs::Outputs;
use super::path::KnownTrack;
use super::refusal::Refusal;
use super::task::TaskPhase;
use super::turnout_guard::train_on;

/// A sensor that reports again within this time was occupied all along: wheels bounce, and no second train follows so
/// soon.
const BOUNCE_TIME: TimeSpan = TimeSpan::from_ms(300);
/// The line polls one sensor more often only this long before its report decides a stop.
const WATCH_AHEAD: TimeSpan = TimeSpan::from_s(6.0);
/// The range of probabilities of stopping beyond the target that an order may ask for: above it is no limit, below it
/// no stop can comply.
const AIM_PROBABILITIES: [f64; 2] = [1e-6, 0.5];
/// The longest move accepted: 100 m, longer than any layout.
const LONGEST_MOVE: Length = Length::from_m(100.0);

/// Locates trains and sends their commands at the right times.
#[derive(Debug, Clone)]
pub struct Driver {
    pub(super) track: KnownTrack,
    pub(super) trains: BTreeMap<TrainId, DrivenTrain>,
    pub(super) outputs: Outputs,
    /// The last detection of each sensor.
    last_detections: BTreeMap<SensorId, Timestamp>,
    /// The detectors of blocks that are occupied. They do not report a second train.
    pub(super) occupied: BTreeSet<SensorId>,
    /// Turnout commands that have not been sent yet, with their orders.
    pending_turnouts: Vec<(TurnoutId, OrderId)>,
    /// When each turnout was last commanded to another leg than it had.
    turnouts_changed: BTreeMap<TurnoutId, Timestamp>,
    pub(super) association: DataAssociation,
    pub(super) orders: u32,
    /// When the sensor to be polled more often changes.
    pub(super) watch_changes: Option<Timestamp>,
    link: TimeModel,
}

impl Driver {
    /// A driver without trains, for a layout with known turnout positions.
    pub fn new(layout: Layout, turnouts: TurnoutStates) -> Self {
        Self {
            track: KnownTrack::new(layout, turnouts),
            trains: BTreeMap::new(),
            outputs: Outputs::default(),
            last_detections: BTreeMap::new(),
            occupied: BTreeSet::new(),
            pending_turnouts: Vec::new(),
            turnouts_changed: BTreeMap::new(),
            association: DataAssociation::default(),
            orders: 0,
            watch_changes: None,
            link: TimeModel::default(),
        }
    }

    /// Sets the timing of the link to the station. Until then the driver assumes the slowest link.
    pub fn set_link(&mut self, link: TimeModel) {
        self.link = link;
        self.trains.values_mut().for_each(|train| train.link = link);
    }

    /// Adds a train whose position is unknown. Replaces a train of the same number and all that was known of it.
    pub fn add_train(&mut self, model: MotionModel) {
        let locator = Locator::new(model.train());
        self.add_located(model, locator);
    }

    /// Adds a train together with its position.
    pub fn add_located(&mut self, model: MotionModel, locator: Locator) {
        self.association.forget(model.train());
        self.trains.insert(model.train(), DrivenTrain::new(model, locator, self.link));
    }

    /// The motion model of a train.
    pub fn model(&self, train: TrainId) -> Option<&MotionModel> {
        self.trains.get(&train).map(|train| &train.model)
    }

    /// Replaces the motion model of a train.
    pub fn set_model(&mut self, model: MotionModel) {
        if let Some(train) = self.trains.get_mut(&model.train()) {
            train.set_model(model);
        }
    }

    /// The trains that are driven, by number.
    pub fn trains(&self) -> impl Iterator<Item = TrainId> {
        self.trains.keys().copied()
    }

    /// The layout.
    pub const fn layout(&self) -> &Layout {
        &self.track.layout
    }

    /// The turnout positions.
    pub const fn turnouts(&self) -> &TurnoutStates {
        &self.track.turnouts
    }

    /// Whether the reports of a sensor are ignored, because it reported repeatedly where no train can be.
    pub fn ignores(&self, sensor: SensorId) -> bool {
        self.association.ignores(sensor)
    }

    /// Where a train is at a time not before the last event; `None` if its position is unknown.
    pub fn locate(&self, train: TrainId, now: Timestamp) -> Option<Located> {
        self.trains.get(&train)?.located(self.track.context(), now)
    }

    /// A point of a train's path as a landmark and an offset.
    pub fn landmark(&self, train: TrainId, at: PathPoint) -> Option<Landmark> {
        Some(landmark_of(self.track.context(), &self.trains.get(&train)?.model, at))
    }

    /// Whether a train is estimated to be at rest.
    pub fn is_at_rest(&self, train: TrainId, now: Timestamp) -> bool {
        self.trains.get(&train).is_some_and(|train| train.is_at_rest(self.track.context(), now))
    }

    /// The step that a train was last commanded, sent or not; 0 for a train that is not part of this session.
    pub fn commanded(&self, train: TrainId) -> SpeedStep {
        self.trains.get(&train).map_or(SpeedStep::STAND, |train| train.commanded)
    }

    /// The step at which a train of unknown position creeps to a sensor; 0 for a train that is not part of this
    /// session.
    pub fn finding_step(&self, train: TrainId) -> SpeedStep {
        self.trains.get(&train).map_or(SpeedStep::STAND, DrivenTrain::finding_step)
    }

    /// The order that a train is carrying out.
    pub fn busy(&self, train: TrainId) -> Option<OrderId> {
        Some(self.trains.get(&train)?.task?.order)
    }

    /// Sets the position of a train, as an operator entered it.
    pub fn place(&mut self, now: Timestamp, train: TrainId, at: PathPoint, uncertainty: Length) {
        self.association.forget(train);
        if let Some(train) = self.trains.get_mut(&train) {
            train.place(self.track.context(), now, at, uncertainty);
        }
    }

    /// Starts an order. It replaces the train's present order.
    ///
    /// # Errors
    /// Why the order cannot be carried out; nothing has changed then.
    pub fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        self.check(&order)?;
        let id = OrderId(self.orders);
        let context = self.track.context();
        let out = &mut self.outputs;
        if let Order::Follow { train, leader, gap } = order {
            // A follower reads the states of the other trains.
            if let Some(mut follower) = self.trains.remove(&train) {
                let taken = follower.follow(context, now, id, (leader, gap), &self.trains, out);
                self.trains.insert(train, follower);
                taken?;
            }
        }
        let train = order.train().and_then(|train| self.trains.get_mut(&train));
        match (order, train) {
            (Order::Speed { step, .. }, Some(train)) => train.run(context, now, id, step, out),
            (Order::Reverse { then, .. }, Some(train)) => train.reverse(context, now, id, then, out),
            (Order::Stop(stop), Some(train)) => train.stop_at(context, now, id, &stop, out)?,
            (Order::Move { distance, .. }, Some(train)) => {
                train.start_move(context, now, id, distance, out)?;
            }
            (Order::Hold { speed, .. }, Some(train)) => train.hold(context, now, id, speed, out)?,
            (Order::Arrive { target, within, .. }, Some(train)) => {
                train.arrive(context, now, id, target, within, out)?;
            }
            (Order::Turnout { turnout, curved }, _) => self.throw(now, id, turnout, curved)?,
            _ => {}
        }
        self.orders = self.orders.wrapping_add(1);
        self.update(now);
        Ok(id)
    }

    /// Checks the values of an order, whatever the state of the railway.
    pub(in crate::control) fn check(&self, order: &Order) -> Result<(), Refusal> {
        let Some(id) = order.train() else { return Ok(()) };
        let train = self.trains.get(&id).ok_or(Refusal::UnknownTrain { train: id })?;
        let highest = train.model.highest();
        let is_step = |step: SpeedStep| {
            if step > highest { Err(Refusal::StepTooHigh { step, highest }) } else { Ok(()) }
        };
        match *order {
            Order::Speed { step, .. } | Order::Reverse { then: step, .. } => is_step(step),
            Order::Stop(StopOrder { step, aim, .. }) => {
                if let Aim::NotBeyond(found) = aim
                    && !(AIM_PROBABILITIES[0]..=AIM_PROBABILITIES[1]).contains(&found.as_parts())
                {
                    return Err(Refusal::IllegalProbability { found });
                }
                let Some(step) = step else { return Ok(()) };
                is_step(step)?;
                if step == SpeedStep::STAND || train.model.uses(step) == StepUse::Unreliable {
                    return Err(Refusal::StepDoesNotMove { step });
                }
                Ok(())
            }
            Order::Move { distance, .. } if !(distance > Length::ZERO && distance <= LONGEST_MOVE) => {
                Err(Refusal::IllegalDistance { found: distance })
            }
            Order::Move { .. }
            | Order::Turnout { .. }
            | Order::Hold { .. }
            | Order::Arrive { .. }
            | Order::Follow { .. } => Ok(()),
        }
    }

    /// Commands a turnout, unless a train is on it. If it shares its place with another turnout, that one is set
    /// straight first.
    fn throw(
        &mut self,
        now: Timestamp,
        order: OrderId,
        turnout: TurnoutId,
        curved: bool,
    ) -> Result<(), Refusal> {
        let context = self.track.context();
        if context.layout.branch(turnout).is_none() {
            return Err(Refusal::UnknownTurnout { turnout });
        }
        let is_set = context.turnouts.get(turnout) == Some(Leg::from_curved(curved));
        let on_it = train_on(&self.trains, context, now, turnout);
        if let Some(train) = on_it.filter(|_| !is_set) {
            return Err(Refusal::TurnoutOccupied { turnout, train });
        }
        let partner = context
            .layout
            .never_curved_with(turnout)
            .filter(|partner| curved && context.turnouts.get(*partner) != Some(Leg::Straight));
        if let Some(partner) = partner {
            if let Some(train) = train_on(&self.trains, context, now, partner) {
                return Err(Refusal::PartnerOccupied { turnout, partner, train });
            }
            self.outputs.command(Command::Turnout { turnout: partner, curved: false });
        }
        self.pending_turnouts.push((turnout, order));
        self.outputs.command(Command::Turnout { turnout, curved });
        Ok(())
    }

    fn turnout_sent(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) {
        let leg = Leg::from_curved(curved);
        if self.track.turnouts.get(turnout) != Some(leg) {
            self.turnouts_changed.insert(turnout, now);
        }
        self.track.turnouts.set(turnout, leg);
        self.association.turnout_thrown(turnout);
        let out = &mut self.outputs;
        let mut is_ordered = false;
        // Answers every order for this turnout: the line may send two equal commands as one.
        self.pending_turnouts.retain(|(commanded_turnout, order)| {
            if *commanded_turnout == turnout {
                is_ordered = true;
                out.notify(Notice::TurnoutThrown { order: Some(*order), turnout, curved });
            }
            *commanded_turnout != turnout
        });
        if !is_ordered {
            out.notify(Notice::TurnoutThrown { order: None, turnout, curved });
        }
        self.all_turnouts_changed(now);
    }

    /// The station may not have received commands since a time, and reports may be noise: turnouts that were to move, or seem to have
    /// moved, lie in either position.
    pub(in crate::control) fn forget_turnouts_changed(&mut self, now: Timestamp, since: Timestamp) {
        let turnouts = &mut self.track.turnouts;
        self.turnouts_changed.iter().filter(|(_, at)| **at >= since).for_each(|(id, _)| turnouts.forget(*id));
        self.all_turnouts_changed(now);
    }

    fn all_turnouts_changed(&mut self, now: Timestamp) {
        let context = self.track.context();
        for train in self.trains.values_mut() {
            train.turnouts_changed(context, now, &mut self.outputs);
        }
    }

    /// A report, and the window of its time.
    pub(super) fn detection(&self, time: Timestamp, report: Report) -> Detection {
        let interval = report.poll_interval.unwrap_or(self.link.report_window).abs();
        Detection { sensor: report.sensor, window: DetectionWindow { after: time - interval, until: time } }
    }

    fn report(&mut self, now: Timestamp, time: Timestamp, report: Report) {
        let sensor = report.sensor;
        let detection = self.detection(time, report);
        let interval = detection.window.width();
        let before = self.last_detections.insert(sensor, time);
        if before.is_some_and(|before| time - before <= BOUNCE_TIME.max(interval)) {
            return;
        }
        while let Some(sensor) = self.association.next_restored(now) {
            self.outputs.notify(Notice::SensorRestored { sensor });
        }
        if self.is_found_occupied(&detection) {
            return;
        }
        let detection = self.likeliest_entry(now, detection);
        let sensor = detection.sensor;
        match self.association.resolve(&self.trains, self.track.context(), now, detection) {
            Some(Resolution::Revised(branch)) => self.revise(now, *branch),
            Some(Resolution::Spurious(detection)) => {
                let time = detection.window.until;
                self.outputs.notify(Notice::Unexplained { sensor: detection.sensor, time });
            }
            None => {}
        }
        match self.association.associate(&self.trains, self.track.context(), now, detection) {
            Association::Explained(Hypothesis { explanation, sensor, .. }) => {
                self.passed(now, Detection { sensor, ..detection }, explanation);
            }
            Association::EitherDirection(train) => {
                self.outputs.notify(Notice::EitherDirection { train, sensor, time });
            }
            Association::Ambiguous { likeliest, or } => {
                self.outputs.notify(Notice::Ambiguous { sensor, time, likeliest, or });
            }
            Association::Unexplained => self.outputs.notify(Notice::Unexplained { sensor, time }),
            Association::Stuck => self.outputs.notify(Notice::SensorStuck { sensor }),
            Association::Ignored => {}
        }
    }

    /// Updates a train that caused a detection.
    fn passed(&mut self, now: Timestamp, detection: Detection, explanation: Explanation) {
        if let Explanation::Turnout { train, turnout, leg } = explanation {
            self.adopt_leg(now, train, turnout, leg);
        } else if let Explanation::Train(train) = explanation {
            self.prove_turnouts(now, train, detection.sensor);
        }
        let context = self.track.context();
        if let (Some(train), Some(node)) =
            (self.trains.get_mut(&explanation.train()), context.node_of(detection.sensor))
        {
            if matches!(explanation, Explanation::Strayed(_)) {
                train.locator.lose();
                train.passages.forget();
            }
            train.learn_length(context, detection.sensor, detection.window);
            let passed = train.locator.pass(context, &train.model, detection.sensor, detection.window);
            train.passed(context, now, node, passed, &mut self.outputs);
        }
        if matches!(explanation, Explanation::Turnout { .. }) {
            self.all_turnouts_changed(now);
        }
    }

    /// Corrects a train after later detections have shown that it caused an earlier one, or that it did not.
    pub(super) fn revise(&mut self, now: Timestamp, branch: Branch) {
        let Branch { detection, caused, train, passes, legs, locator, missed_sensor, ends, .. } = branch;
        if !caused {
            let Detection { sensor, window } = detection;
            self.outputs.notify(Notice::Unexplained { sensor, time: window.until });
        }
        legs.iter().for_each(|(turnout, leg)| self.adopt_leg(now, train, *turnout, *leg));
        let context = self.track.context();
        let Some(train) = self.trains.get_mut(&train) else { return };
        train.locator = locator;
        train.expected.missed_sensor = missed_sensor;
        train.passages.forget_from(detection.window.after - BOUNCE_TIME);
        train.restore_ends(ends);
        for pass in &passes {
            if let Some(node) = context.node_of(pass.detection.sensor) {
                train.passed(context, now, node, pass.passed, &mut self.outputs);
            }
        }
        if passes.is_empty() {
            train.turnouts_changed(context, now, &mut self.outputs);
        }
        if !legs.is_empty() {
            self.all_turnouts_changed(now);
        }
    }

    /// Adopts a turnout position that a train has shown by the leg it took, or a report that noise on the line has made.
    fn adopt_leg(&mut self, now: Timestamp, train: TrainId, turnout: TurnoutId, leg: Leg) {
        self.turnouts_changed.insert(turnout, now);
        self.track.turnouts.set(turnout, leg);
        let curved = leg.is_curved();
        self.outputs.notify(Notice::TurnoutMismatch { turnout, curved, train });
    }

    /// Does what follows from new estimates.
    pub(super) fn update(&mut self, now: Timestamp) {
        self.supervise_speed(now);
        self.pace(now);
        self.update_line_requests(now);
    }

    /// Requests a free line for the next planned command and frequent polls of the sensor that decides it.
    pub(super) fn update_line_requests(&mut self, now: Timestamp) {
        let plans = || {
            self.trains.values().filter_map(|train| match train.task?.phase {
                TaskPhase::Running { plan } => plan,
                _ => None,
            })
        };
        let next = plans().min_by_key(|plan| plan.leaves);
        let due = self.trains.values().filter_map(DrivenTrain::due);
        let triggers = || plans().flat_map(|plan| plan.triggers).flatten();
        let watched = due
            .filter(|(_, time)| next.is_some_and(|plan| plan.leaves - *time <= WATCH_AHEAD))
            .map(|(sensor, _)| sensor)
            .find(|sensor| triggers().any(|trigger| trigger == *sensor));
        let guard = self.trains.values().filter_map(DrivenTrain::latest_safe_stop);
        let hold = next.map(|plan| plan.leaves - self.link.command).into_iter().chain(guard).min();
        // Called even if the plans have a sensor: it also sets when the watched sensor changes next. A stale time
        // would never let the driver sleep.
        let paced = self.next_paced_sensor(now);
        let watched = watched.or(paced);
        self.outputs.hold_line(hold);
        self.outputs.watch(watched);
    }
}

impl Machine for Driver {
    type Notice = Notice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        let context = self.track.context();
        match event.kind {
            EventKind::Sensor(report) => self.report(now, event.time, report),
            EventKind::Speed { train, .. } | EventKind::Reverse { train } => {
                self.association.command_sent(&self.trains, context, event);
                if let Some(train) = self.trains.get_mut(&train) {
                    train.command_sent(context, now, event, &mut self.outputs);
                }
            }
            EventKind::Turnout { turnout, curved } => self.turnout_sent(now, turnout, curved),
            EventKind::Freed(report) => self.freed(event.time, report),
            EventKind::Stopped { .. } => {}
        }
        self.update(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.expect_beyond_occupied_blocks(now);
        let context = self.track.context();
        for train in self.trains.values_mut() {
            train.handle_timeout(context, now, &mut self.outputs);
        }
        self.update(now);
    }

    fn poll_output(&mut self) -> Option<Output<Notice>> {
        self.outputs.next()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        let trains = self.trains.values().filter_map(DrivenTrain::next_timeout);
        trains.chain(self.watch_changes).min()
    }
}
