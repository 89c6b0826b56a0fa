//! Drives trains to where they are ordered, report by report.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::control::{Machine, Output};
use crate::event::{Command, Event, EventKind, Report};
use crate::ids::{SensorId, SpeedStep, TrainId, TurnoutId};
use crate::link::ContactWindow;
use crate::link::TimeModel;
use crate::model::{MotionModel, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Landmark, Layout, Leg, TurnoutStates};
use crate::tracking::{Located, Locator, WayPoint, landmark_of};
use crate::units::Length;

use super::attribution::{Attribution, Decided, Verdict};
use super::doubt::Branch;
use super::driven_train::DrivenTrain;
use super::hypotheses::{Closure, Explanation};
use super::known_track::KnownTrack;
use super::order::{Aim, Order, OrderId, StopOrder};
use super::outputs::Outputs;
use super::refusal::Refusal;
use super::task::Phase;
use super::turnout_guard::train_on;
use crate::control::Notice;

/// A contact that is seen closed again within this long was never open: wheels bounce, and no train follows so soon.
const HELD: TimeSpan = TimeSpan::from_ms(300);
/// The line is watched for one contact only this long before its report decides a stop.
const WATCHED: TimeSpan = TimeSpan::from_s(6.0);
/// What an aim may leave beyond the target: more is no promise, less no stop can keep.
const SHARES: [f64; 2] = [1e-6, 0.5];
/// The longest move that is believed to be meant: a hundred metres, as long as no layout is.
const LONGEST_MOVE: Length = Length::from_m(100.0);

/// Knows where the trains are, and tells them when to do what.
#[derive(Debug, Clone)]
pub struct Driver {
    pub(super) track: KnownTrack,
    pub(super) trains: BTreeMap<TrainId, DrivenTrain>,
    pub(super) outputs: Outputs,
    /// When each contact was last seen closed.
    closed: BTreeMap<SensorId, Timestamp>,
    /// Turnouts that were asked for and have not been told yet, by which order.
    throwing: Vec<(TurnoutId, OrderId)>,
    pub(super) attribution: Attribution,
    pub(super) orders: u32,
    /// When the contact to be watched changes.
    pub(super) watch_changes: Option<Timestamp>,
    link: TimeModel,
}

impl Driver {
    /// Nothing to drive yet. How the turnouts lie, as far as is known.
    #[must_use]
    pub fn new(layout: Layout, turnouts: TurnoutStates) -> Self {
        Self {
            track: KnownTrack::new(layout, turnouts),
            trains: BTreeMap::new(),
            outputs: Outputs::default(),
            closed: BTreeMap::new(),
            throwing: Vec::new(),
            attribution: Attribution::default(),
            orders: 0,
            watch_changes: None,
            link: TimeModel::default(),
        }
    }

    /// How long the link to the station takes, from now on; without it the slowest one is supposed.
    pub fn set_link(&mut self, link: TimeModel) {
        self.link = link;
        self.trains.values_mut().for_each(|train| train.link = link);
    }

    /// Drives a train that moves like this, and of which nobody knows where it stands. Replaces what was known of it.
    pub fn add_train(&mut self, model: MotionModel) {
        let locator = Locator::new(model.train());
        self.add_located(model, locator);
    }

    /// Drives a train that somebody else has followed until now.
    pub fn add_located(&mut self, model: MotionModel, locator: Locator) {
        self.attribution.forget(model.train());
        self.trains.insert(model.train(), DrivenTrain::new(model, locator, self.link));
    }

    /// What is known of how a train moves.
    #[must_use]
    pub fn model(&self, train: TrainId) -> Option<&MotionModel> {
        self.trains.get(&train).map(|train| &train.model)
    }

    /// Puts something better in its place.
    pub fn set_model(&mut self, model: MotionModel) {
        if let Some(train) = self.trains.get_mut(&model.train()) {
            train.set_model(model);
        }
    }

    /// The trains that are driven.
    pub fn trains(&self) -> impl Iterator<Item = TrainId> {
        self.trains.keys().copied()
    }

    /// The layout.
    #[must_use]
    pub const fn layout(&self) -> &Layout {
        &self.track.layout
    }

    /// How the turnouts lie.
    #[must_use]
    pub const fn turnouts(&self) -> &TurnoutStates {
        &self.track.turnouts
    }

    /// Where a train is at a time not before the last entry; `None` if nobody knows.
    #[must_use]
    pub fn locate(&self, train: TrainId, now: Timestamp) -> Option<Located> {
        self.trains.get(&train)?.located(self.track.context(), now)
    }

    /// A point of a train's way as people name it.
    #[must_use]
    pub fn landmark(&self, train: TrainId, at: WayPoint) -> Option<Landmark> {
        Some(landmark_of(self.track.context(), &self.trains.get(&train)?.model, at))
    }

    /// Whether a train stands, as far as is known.
    #[must_use]
    pub fn stands(&self, train: TrainId, now: Timestamp) -> bool {
        self.trains.get(&train).is_some_and(|train| train.stands(self.track.context(), now))
    }

    /// The step that a train was commanded last, whether or not that has left yet; 0 for one that is not part of this session.
    #[must_use]
    pub fn commanded(&self, train: TrainId) -> SpeedStep {
        self.trains.get(&train).map_or(SpeedStep::STAND, |train| train.commanded)
    }

    /// The step at which a train that nobody has seen is let run over a contact; 0 for one that is not part of this session.
    #[must_use]
    pub fn finding_step(&self, train: TrainId) -> SpeedStep {
        self.trains.get(&train).map_or(SpeedStep::STAND, DrivenTrain::finding_step)
    }

    /// The order that a train is busy with.
    #[must_use]
    pub fn busy(&self, train: TrainId) -> Option<OrderId> {
        Some(self.trains.get(&train)?.task?.order)
    }

    /// A person put a train there, or read off where it stands.
    pub fn place(&mut self, now: Timestamp, train: TrainId, at: WayPoint, uncertainty: Length) {
        self.attribution.forget(train);
        if let Some(train) = self.trains.get_mut(&train) {
            train.place(self.track.context(), now, at, uncertainty);
        }
    }

    /// Begins to carry out an order. What the train was busy with ends.
    ///
    /// # Errors
    /// Why it cannot be carried out; nothing has changed then.
    pub fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        self.check(&order)?;
        let id = OrderId(self.orders);
        let context = self.track.context();
        let out = &mut self.outputs;
        if let Order::Follow { train, leader, gap } = order {
            // Whoever follows looks at the others.
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
            (Order::Move { distance, .. }, Some(train)) => train.move_on(context, now, id, distance, out)?,
            (Order::Hold { speed, .. }, Some(train)) => train.hold(context, now, id, speed, out)?,
            (Order::Arrive { target, within, .. }, Some(train)) => {
                train.arrive(context, now, id, target, within, out)?;
            }
            (Order::Turnout { turnout, curved }, _) => self.throw(now, id, turnout, curved)?,
            _ => {}
        }
        self.orders = self.orders.wrapping_add(1);
        self.heed_zones(now);
        self.pace(now);
        self.wish(now);
        Ok(id)
    }

    /// Whether an order makes sense at all.
    fn check(&self, order: &Order) -> Result<(), Refusal> {
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
                    && !(SHARES[0]..=SHARES[1]).contains(&found.as_parts())
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

    /// Throws a turnout unless a train is on it; the other one in its place goes straight first.
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
        let lies = context.turnouts.get(turnout) == Some(Leg::from_curved(curved));
        let on_it = train_on(&self.trains, context, now, turnout);
        if let Some(train) = on_it.filter(|_| !lies) {
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
        self.throwing.push((turnout, order));
        self.outputs.command(Command::Turnout { turnout, curved });
        Ok(())
    }

    fn turnout_left(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) {
        self.track.turnouts.set(turnout, Leg::from_curved(curved));
        self.attribution.turnout_thrown(turnout);
        let out = &mut self.outputs;
        let mut is_asked = false;
        // Whoever asked for it is answered; a line may say once what was asked twice.
        self.throwing.retain(|(asked, order)| {
            if *asked == turnout {
                is_asked = true;
                out.say(Notice::TurnoutThrown { order: Some(*order), turnout, curved });
            }
            *asked != turnout
        });
        if !is_asked {
            out.say(Notice::TurnoutThrown { order: None, turnout, curved });
        }
        self.ways_changed(now);
    }

    fn ways_changed(&mut self, now: Timestamp) {
        let context = self.track.context();
        for train in self.trains.values_mut() {
            train.way_changed(context, now, &mut self.outputs);
        }
    }

    fn report(&mut self, now: Timestamp, time: Timestamp, report: Report) {
        let sensor = report.sensor;
        let interval = report.poll_interval.unwrap_or(self.link.report_window).abs();
        let window = ContactWindow { after: time - interval, until: time };
        let before = self.closed.insert(sensor, time);
        if before.is_some_and(|before| time - before <= HELD.max(interval)) {
            return;
        }
        while let Some(sensor) = self.attribution.next_reformed(now) {
            self.outputs.say(Notice::SensorRestored { sensor });
        }
        let closure = Closure { sensor, window };
        match self.attribution.decide(&self.trains, self.track.context(), now, closure) {
            Some(Decided::Otherwise(branch)) => self.take_back(now, *branch),
            Some(Decided::Nothing(closure)) => {
                let time = closure.window.until;
                self.outputs.say(Notice::Unexplained { sensor: closure.sensor, time });
            }
            None => {}
        }
        match self.attribution.judge(&self.trains, self.track.context(), now, closure) {
            Verdict::Explained(explanation) => self.passed(now, closure, explanation),
            Verdict::Ambiguous { likeliest, or } => {
                self.outputs.say(Notice::Ambiguous { sensor, time, likeliest, or });
            }
            Verdict::Unexplained => self.outputs.say(Notice::Unexplained { sensor, time }),
            Verdict::Stuck => self.outputs.say(Notice::SensorStuck { sensor }),
            Verdict::Ignored => {}
        }
    }

    /// A train passed a contact just now.
    fn passed(&mut self, now: Timestamp, closure: Closure, explanation: Explanation) {
        if let Explanation::Turnout { train, turnout, leg } = explanation {
            self.believe(train, turnout, leg);
        }
        let context = self.track.context();
        if let (Some(train), Some(node)) =
            (self.trains.get_mut(&explanation.train()), context.node_of(closure.sensor))
        {
            if matches!(explanation, Explanation::Strayed(_)) {
                train.locator.lose();
                train.passages.forget();
            }
            train.learn_length(context, closure.sensor, closure.window);
            let passed = train.locator.pass(context, &train.model, closure.sensor, closure.window);
            train.passed(context, now, node, passed, &mut self.outputs);
        }
        if matches!(explanation, Explanation::Turnout { .. }) {
            self.ways_changed(now);
        }
    }

    /// A train passed a contact a while ago, or did not, as has turned out.
    fn take_back(&mut self, now: Timestamp, branch: Branch) {
        let Branch { closure, did_it, train, passes, lies, locator, unseen, .. } = branch;
        if !did_it {
            let Closure { sensor, window } = closure;
            self.outputs.say(Notice::Unexplained { sensor, time: window.until });
        }
        lies.iter().for_each(|(turnout, leg)| self.believe(train, *turnout, *leg));
        let context = self.track.context();
        let Some(train) = self.trains.get_mut(&train) else { return };
        train.locator = locator;
        train.expected.unseen = unseen;
        for pass in &passes {
            if let Some(node) = context.node_of(pass.closure.sensor) {
                train.passed(context, now, node, pass.passed, &mut self.outputs);
            }
        }
        if passes.is_empty() {
            train.way_changed(context, now, &mut self.outputs);
        }
        if !lies.is_empty() {
            self.ways_changed(now);
        }
    }

    /// Takes over what a train showed of a turnout.
    fn believe(&mut self, train: TrainId, turnout: TurnoutId, leg: Leg) {
        self.track.turnouts.set(turnout, leg);
        let curved = leg.is_curved();
        self.outputs.say(Notice::TurnoutMismatch { turnout, curved, train });
    }

    /// Says of the line what the plans want of it.
    pub(super) fn wish(&mut self, now: Timestamp) {
        let plans = || {
            self.trains.values().filter_map(|train| match train.task?.phase {
                Phase::Running { plan } => plan,
                _ => None,
            })
        };
        let next = plans().min_by_key(|plan| plan.leaves);
        let due = self.trains.values().filter_map(DrivenTrain::due);
        let triggers = || plans().flat_map(|plan| plan.triggers).flatten();
        let watched = due
            .filter(|(_, time)| next.is_some_and(|plan| plan.leaves - *time <= WATCHED))
            .map(|(sensor, _)| sensor)
            .find(|sensor| triggers().any(|trigger| trigger == *sensor));
        let guard = self.trains.values().filter_map(DrivenTrain::guard);
        let hold = next.map(|plan| plan.leaves - self.link.command).into_iter().chain(guard).min();
        // Asked in any case: it also says when to look again, and a time that stays behind would be waited for for ever.
        let paced = self.due_of_paced(now);
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
                self.attribution.command_left(&self.trains, context, event);
                if let Some(train) = self.trains.get_mut(&train) {
                    train.command_left(context, now, event, &mut self.outputs);
                }
            }
            EventKind::Turnout { turnout, curved } => self.turnout_left(now, turnout, curved),
            EventKind::Stopped { .. } => {}
        }
        self.heed_zones(now);
        self.pace(now);
        self.wish(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        let context = self.track.context();
        for train in self.trains.values_mut() {
            train.handle_timeout(context, now, &mut self.outputs);
        }
        self.heed_zones(now);
        self.pace(now);
        self.wish(now);
    }

    fn poll_output(&mut self) -> Option<Output<Notice>> {
        self.outputs.next()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        let trains = self.trains.values().filter_map(DrivenTrain::next_timeout);
        trains.chain(self.watch_changes).min()
    }
}
