//! The watchdog: monitors the trains of a driver, and recovers those that do not run as modelled.

use alloc::collections::{BTreeMap, BTreeSet, VecDeque};
use alloc::vec::Vec;

use crate::control::dispatch::Reservation;
use crate::control::drive::{Driver, Order, OrderId, Refusal};
use crate::control::{Machine, Output};
use crate::event::{Command, Event, EventKind};
use crate::ids::{SpeedStep, TrainId};
use crate::model::MotionModel;
use crate::time::Timestamp;
use crate::track::Position;
use crate::tracking::PathPoint;
use crate::units::Length;

use super::alarm::{Alarm, ConsistencyMonitor};
use super::intruder::Intruder;
use super::noise::Noise;
use super::recovery::Recovery;
use super::recovery_phase::RecoveryPhase;
use super::stops::Stops;
use super::trials::Remeasured;
use super::unheard::{Behind, Unheard};
use crate::control::Notice;

/// The track power, as commanded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Power {
    On,
    Off { since: Timestamp },
}

/// A driver with monitors. To its caller it is a driver that sometimes rejects an order.
#[derive(Debug, Clone)]
pub struct Watchdog {
    pub(super) driver: Driver,
    queue: VecDeque<Output<Notice>>,
    pub(super) monitors: BTreeMap<TrainId, ConsistencyMonitor>,
    pub(super) stops: Stops,
    pub(super) power: Power,
    /// Since when the station has been silent.
    pub(super) silent: Option<Timestamp>,
    /// Trains in danger: their recoveries.
    pub(super) dangers: BTreeMap<TrainId, Recovery>,
    /// What recoveries found of trains that have changed, until it is taken.
    pub(super) remeasured: BTreeMap<TrainId, Remeasured>,
    /// Trains that are held until the danger is over, with their interrupted orders.
    pub(super) held: BTreeMap<TrainId, Option<(OrderId, Order)>>,
    /// The orders that recoveries interrupted and that a dispatcher gives again.
    pub(super) interrupted: Vec<(TrainId, (OrderId, Order))>,
    /// The last order of each train that has not ended.
    pub(super) unfinished: BTreeMap<TrainId, (OrderId, Order)>,
    /// The position at which each train was last detected or placed, in its direction.
    pub(super) seen: BTreeMap<TrainId, Position>,
    /// What is behind each train that was reported since it reversed or was placed.
    pub(super) behind: BTreeMap<TrainId, Behind>,
    /// Trains that may face in either direction, until they are located.
    pub(super) undirected: BTreeSet<TrainId>,
    /// How far each train may have run since its last detection.
    pub(super) unheard: BTreeMap<TrainId, Unheard>,
    /// The orders of recoveries.
    pub(super) own: BTreeMap<OrderId, TrainId>,
    /// Whether no dispatcher keeps trains apart and repeats orders.
    pub(super) permits_all: bool,
    /// Whether it monitors; otherwise it only passes everything on.
    is_watching: bool,
    /// Whether an operator has switched the power off.
    pub(super) is_switched_off: bool,
    pub(super) intruder: Intruder,
    pub(super) noise: Noise,
    /// Trains that may creep, with the track that is reserved for others.
    pub(super) permitted: BTreeMap<TrainId, Reservation>,
    /// The last time that it acted: timeouts up to then are handled.
    acted: Timestamp,
}

impl Watchdog {
    /// Monitors a driver.
    pub fn new(driver: Driver, now: Timestamp) -> Self {
        let mut watchdog = Self {
            driver,
            queue: VecDeque::new(),
            monitors: BTreeMap::new(),
            stops: Stops::default(),
            power: Power::On,
            silent: None,
            dangers: BTreeMap::new(),
            remeasured: BTreeMap::new(),
            held: BTreeMap::new(),
            interrupted: Vec::new(),
            unfinished: BTreeMap::new(),
            seen: BTreeMap::new(),
            behind: BTreeMap::new(),
            undirected: BTreeSet::new(),
            unheard: BTreeMap::new(),
            own: BTreeMap::new(),
            permits_all: true,
            is_watching: true,
            is_switched_off: false,
            intruder: Intruder::default(),
            noise: Noise::default(),
            permitted: BTreeMap::new(),
            acted: now,
        };
        let trains: Vec<TrainId> = watchdog.driver.trains().collect();
        for train in trains {
            if watchdog.driver.locate(train, now).is_some() {
                watchdog.monitors.entry(train).or_default().place();
                watchdog.note_place(now, train);
            }
        }
        watchdog
    }

    /// A driver without monitoring.
    pub fn unwatched(driver: Driver, now: Timestamp) -> Self {
        Self { is_watching: false, ..Self::new(driver, now) }
    }

    /// The driver, read only: orders pass through the watchdog.
    pub const fn driver(&self) -> &Driver {
        &self.driver
    }

    /// The driver, for settings that the watchdog does not monitor. Orders given there are not monitored.
    pub const fn driver_mut(&mut self) -> &mut Driver {
        &mut self.driver
    }

    /// See [`Driver::add_train`].
    pub fn add_train(&mut self, model: MotionModel) {
        self.forget(model.train());
        self.driver.add_train(model);
    }

    /// See [`Driver::set_model`]. Ignored while a recovery measures the train.
    pub fn set_model(&mut self, model: MotionModel) {
        if !self.dangers.contains_key(&model.train()) {
            self.driver.set_model(model);
        }
    }

    /// What the last recovery of a train found of it, once, if it is no longer as it was.
    pub fn take_remeasured(&mut self, train: TrainId) -> Option<Remeasured> {
        self.remeasured.remove(&train)
    }

    /// See [`Driver::set_end_of_authority`]. A train in danger keeps the limits of its recovery.
    pub fn set_end_of_authority(&mut self, now: Timestamp, train: TrainId, limit: Option<PathPoint>) {
        if !self.dangers.contains_key(&train) {
            self.driver.set_end_of_authority(now, train, limit);
            self.drain(now);
        }
    }

    /// Sets the position of a train, as an operator entered it. A train that creeps to be located is stopped, and like one that
    /// could not be recovered it is trusted again, with its earlier model. One that is measured is stopped, and measured again. If no train is in danger any more, held trains are released and their orders
    /// cancelled.
    pub fn place(&mut self, now: Timestamp, train: TrainId, at: PathPoint, uncertainty: Length) {
        // A recovery that was given up is forgotten, and what the train pushed over is not.
        let over = self.pushed_over(now, train);
        self.end_search(now, train);
        self.driver.place(now, train, at, uncertainty);
        self.monitors.entry(train).or_default().place();
        let place = self.driver.position(train, now);
        let behind = place.zip(over).and_then(|(place, over)| self.behind_placed(place, uncertainty, &over));
        self.note_place(now, train);
        self.note_detection(train, now);
        self.behind.remove(&train);
        self.behind.extend(behind.map(|behind| (train, behind)));
        self.undirected.remove(&train);
        self.clear_intruder();
        self.release_held();
        self.drain(now);
    }

    /// See [`Driver::count_from_behind`].
    pub(in crate::control) fn count_from_behind(&mut self, now: Timestamp, train: TrainId) {
        self.driver.count_from_behind(now, train);
        self.drain(now);
    }

    /// Whether a train is in danger or held because of one.
    pub fn is_held(&self, train: TrainId) -> bool {
        self.dangers.contains_key(&train) || self.held.contains_key(&train)
    }

    /// Whether any train is in danger, or something moves that no session drives.
    pub fn has_danger(&self) -> bool {
        !self.dangers.is_empty() || self.has_intruder()
    }

    /// Whether a train is in danger.
    pub fn is_in_danger(&self, train: TrainId) -> bool {
        self.dangers.contains_key(&train)
    }

    /// Whether a train moves, or is permitted to, to be recovered.
    pub(in crate::control) fn recovers(&self) -> bool {
        !self.permitted.is_empty() || self.dangers.values().any(Recovery::is_active)
    }

    /// Whether orders to a train are rejected for a temporary reason: a recovery or a silent station.
    pub fn is_interrupted(&self, now: Timestamp, train: TrainId) -> bool {
        let may_end = self.dangers.values().any(|danger| danger.phase != RecoveryPhase::GivenUp);
        self.is_silent() || may_end && (self.is_held(train) || self.could_meet(now, train))
    }

    /// For a dispatcher: from now on a train in danger waits for [`permit`](Self::permit) before it creeps, and interrupted orders
    /// are given again by the dispatcher, if at all.
    pub const fn ask_before_creeping(&mut self) {
        self.permits_all = false;
    }

    /// Permits a train that asked to creep and to be measured, outside the track that is
    /// reserved for others.
    pub fn permit(&mut self, now: Timestamp, train: TrainId, closed: Reservation) {
        // It may have been placed, or power may have gone, since it asked.
        if self.is_in_danger(train) {
            self.permitted.insert(train, closed);
        }
        self.act(now);
    }

    /// Raises an alarm for a train that the caller no longer trusts.
    pub fn distrust(&mut self, now: Timestamp, train: TrainId) {
        self.raise(now, train, Alarm::Distrusted);
        self.act(now);
    }

    pub(super) fn notify(&mut self, notice: Notice) {
        self.queue.push_back(Output::Notice(notice));
    }

    pub(super) fn command(&mut self, command: Command) {
        self.queue.push_back(Output::Command(command));
    }

    pub(super) fn forget(&mut self, train: TrainId) {
        self.dangers.remove(&train);
        self.permitted.remove(&train);
        self.held.remove(&train);
        self.unfinished.remove(&train);
        self.stops.forget(train);
        self.monitors.remove(&train);
        self.seen.remove(&train);
        self.behind.remove(&train);
        self.undirected.remove(&train);
    }

    /// Acts on the outputs and timeouts that are due.
    pub(super) fn act(&mut self, now: Timestamp) {
        self.drain(now);
        self.repeat_stops(now);
        if let Some(train) = self.stops.overdue(now).filter(|_| self.is_watching && self.is_powered()) {
            self.raise(now, train, Alarm::StopUnconfirmed);
            self.power_off(now, train);
        }
        self.acted = now;
        self.end_noise(now);
        self.power_on_again(now);
        self.advance_recoveries(now);
        if self.dangers.values().all(|danger| !danger.is_active()) {
            // The end of one recovery may start another.
            self.advance_recoveries(now);
        }
        self.drain(now);
    }

    /// Passes on the outputs of the driver, and monitors them.
    pub(super) fn drain(&mut self, now: Timestamp) {
        while let Some(output) = self.driver.poll_output() {
            match output {
                Output::Command(command) => {
                    if let Command::Speed { train, step } = command {
                        if step == SpeedStep::STAND {
                            self.stops.command(train, now);
                        } else {
                            self.stops.forget(train);
                        }
                    }
                    self.command(command);
                }
                Output::Notice(notice) => self.handle_notice(now, notice),
                for_the_line => self.queue.push_back(for_the_line),
            }
        }
    }

    fn handle_notice(&mut self, now: Timestamp, notice: Notice) {
        match &notice {
            Notice::Passed { train, passed, .. } => self.passed(now, *train, &passed.clone()),
            Notice::Lost { train } => {
                let train = *train;
                self.notify(notice);
                return self.lost(now, train, Alarm::Lost);
            }
            Notice::Unexplained { sensor, time } if self.refute(now, *sensor, *time) => {}
            Notice::Unexplained { sensor, .. } if self.is_watching && self.is_noise(now, *sensor) => {}
            Notice::Unexplained { sensor, time } if self.is_watching => {
                let is_meant = |ahead| self.driver.layout().may_mean(*sensor, ahead);
                let stray = |train: &TrainId| {
                    self.stops.should_be_at_rest(*train, now)
                        && self.driver.sensor_ahead(*train, now).is_some_and(is_meant)
                };
                let stray = self.driver.trains().find(stray);
                if let Some(train) = stray {
                    self.raise(now, train, Alarm::DoesNotStop(*sensor));
                    self.power_off(now, train);
                } else {
                    let (sensor, time) = (*sensor, *time);
                    self.notify(notice);
                    return self.note_unexplained(now, sensor, time);
                }
            }
            Notice::Overdue { train, sensor, .. } if self.is_watching => {
                let (train, silent) = (*train, *sensor);
                self.notify(notice);
                return self.compare_with_unexplained(now, train, silent);
            }
            Notice::EitherDirection { train, sensor, .. } => {
                let (train, sensor) = (*train, *sensor);
                self.notify(notice);
                return self.direction_unknown(now, train, sensor);
            }
            Notice::Ambiguous { sensor, time, likeliest, or } => {
                let (train, is_spurious) = (*likeliest, or.is_none());
                if !self.noise.is_on()
                    && !self.note_backward(now, *sensor, *time)
                    && let Some(strayed) = self.driver.probably_strayed()
                {
                    self.raise_elsewhere(now, strayed, *sensor, *time);
                }
                // A train that creeps to be located has only so many sensors ahead before the track ends.
                if is_spurious && !self.permits_all && self.dangers.get(&train).is_some_and(Recovery::creeps)
                {
                    self.need_operator(now, train);
                }
            }
            Notice::Done(finished) => {
                if self.own.remove(&finished.order).is_some() {
                    return self.recovery_order_ended(now, finished.train, finished.order, None);
                }
                // These orders last until another replaces them.
                let ends = |(id, order): &(OrderId, Order)| {
                    use Order::{Follow, Hold, Reverse, Speed};
                    let lasts = matches!(order, Speed { .. } | Hold { .. } | Follow { .. } | Reverse { .. });
                    *id == finished.order && !lasts
                };
                if self.unfinished.get(&finished.train).is_some_and(ends) {
                    self.unfinished.remove(&finished.train);
                }
            }
            Notice::GivenUp { order, train, why } => {
                if self.own.remove(order).is_some() {
                    return self.recovery_order_ended(now, *train, *order, Some(why));
                }
                // Its order resumes once the train is located.
                if matches!(why, Refusal::Lost { .. }) && self.will_resume(*train, *order) {
                    return;
                }
                self.unfinished.remove(train);
            }
            Notice::Replaced { order, train }
                if self.own.contains_key(order) || self.will_resume(*train, *order) =>
            {
                self.own.remove(order);
                return;
            }
            Notice::Planned(planned) if self.own.contains_key(&planned.order) => return,
            Notice::TrackEnds { train, .. } | Notice::AuthorityEnds { train } => {
                let train = *train;
                self.unfinished.remove(&train);
                self.recovery_blocked(now, train);
            }
            _ => {}
        }
        self.notify(notice);
    }

    fn passed(&mut self, now: Timestamp, train: TrainId, passed: &crate::tracking::PassedSensor) {
        let missed = self.driver.missed_share(train, passed.at);
        let alarm = self.monitors.entry(train).or_default().pass(passed, missed);
        self.note_place(now, train);
        self.note_detection(train, passed.window.until);
        if let Some(node) = self.driver.node_passed(passed) {
            self.note_behind(train, node);
        }
        if self.is_watching && !self.noise.is_on() && self.stops.should_be_at_rest(train, now) {
            self.raise(now, train, Alarm::DoesNotStop(passed.sensor));
            self.power_off(now, train);
        } else if self.dangers.contains_key(&train) {
            self.recovery_passed(now, train, passed);
        } else if let Some(why) = alarm {
            self.raise(now, train, why);
        }
        if self.has_danger() {
            let stopped = self.hold_endangered(now);
            debug_assert!(stopped.iter().all(|train| self.is_held(*train)));
        }
    }

    /// Whether it monitors and recovers trains.
    pub(in crate::control) const fn is_watching(&self) -> bool {
        self.is_watching
    }
}

impl Machine for Watchdog {
    type Notice = Notice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        if let EventKind::Speed { train, step } = event.kind {
            self.note_command(train, event.time, step);
            if step == SpeedStep::STAND {
                let at_rest = self.at_rest_by(train, event.time);
                self.stops.sent(train, event.time, at_rest);
                self.monitors.entry(train).or_default().stop();
            } else if !self.stops.is_pending(train) {
                // A stop that waits was commanded after it.
                self.stops.forget(train);
            }
        }
        if let EventKind::Reverse { train } = event.kind {
            self.note_command(train, event.time, SpeedStep::STAND);
            self.behind.remove(&train);
            if let Some(place) = self.seen.get_mut(&train) {
                *place = self.driver.layout().reversed(*place).unwrap_or(*place);
            }
        }
        self.driver.handle_event(now, event);
        self.recovery_command_sent(now, event);
        self.act(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.driver.handle_timeout(now);
        self.act(now);
    }

    fn poll_output(&mut self) -> Option<Output<Notice>> {
        self.queue.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        let waits = self.dangers.keys().filter_map(|train| self.stops.at_rest(*train));
        let recovering = self.dangers.values().filter_map(Recovery::next_timeout);
        let repeats = self.stops.next_repeat(|train| self.is_held(train));
        let own = recovering
            .chain(waits)
            .chain(self.noise.next())
            .chain(self.stops.next())
            .chain(repeats)
            .chain(self.power_due());
        own.filter(|at| *at > self.acted).chain(self.driver.next_timeout()).min()
    }
}
