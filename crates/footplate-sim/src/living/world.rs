//! Several trains on a whole layout, a millisecond at a time.

use footplate_core::track::{Layout, Leg};
use footplate_core::{SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use crate::circuit::Circuit;
use crate::draws::{Draws, Purpose};
use crate::living::incident::{Incident, IncidentKind};
use crate::living::live_train::{Around, LiveTrain, Order, STEP, Stepped};
use crate::living::past_truth::RestTruth;
use crate::living::points::Points;
use crate::living::rails::Rails;
use crate::living::s88::S88;
use crate::living::switches::LivingSwitches;
use crate::living::truth::Truth;
use crate::physics_range::PhysicsRange;
use crate::track::TrueTrack;
use crate::train::Train;

/// Trains on a layout, with their collisions, and what sensors see of them. Its time is an argument.
#[derive(Debug, Clone)]
pub struct LivingLayout<'l> {
    pub(crate) rails: Rails<'l>,
    pub(crate) points: Points,
    pub(crate) s88: S88,
    pub(crate) trains: Vec<LiveTrain>,
    /// For each train the step that the station repeats.
    commanded: Vec<SpeedStep>,
    /// Trains that may touch each other, by their places in the list.
    near: Vec<(usize, usize)>,
    is_powered: bool,
    /// Everything has happened up to here; a whole number of steps.
    now: Timestamp,
    draws: Draws,
    incidents: Vec<Incident>,
    pub(crate) rests: Vec<RestTruth>,
    pub(crate) homes: Vec<(TrainId, Circuit)>,
    /// Whether sensors scatter from passage to passage.
    pub(crate) scatters: bool,
}

impl<'l> LivingLayout<'l> {
    /// A layout without trains, under power, with rails and turnouts from the seed.
    pub fn without_trains(layout: &'l Layout, seed: u64, switches: &LivingSwitches) -> Self {
        let track =
            if switches.true_rails { TrueTrack::draw(layout, seed) } else { TrueTrack::as_surveyed(layout) };
        let mut draws = Draws::new(seed, Purpose::Living);
        let points = Points::draw(layout, switches.turnout_failure, draws.split());
        let faults = Draws::new(seed, Purpose::Faults);
        Self {
            rails: Rails::new(layout, track, switches.physics, seed),
            points,
            s88: S88::new(layout, &switches.faults, switches.stale_detections, faults),
            trains: Vec::new(),
            commanded: Vec::new(),
            near: Vec::new(),
            is_powered: true,
            now: Timestamp::ZERO,
            draws,
            incidents: Vec::new(),
            rests: Vec::new(),
            homes: Vec::new(),
            scatters: switches.physics.includes(PhysicsRange::AsymmetricSensors),
        }
    }

    /// One more train, not yet on the rails: see [`place`](Self::place). A train of the same address is replaced.
    pub fn add(&mut self, id: TrainId, train: Train, warmth: f64) {
        let draws = self.draws.split();
        let added = LiveTrain::new(id, train, warmth.clamp(0.0, 1.0), draws);
        match self.trains.iter_mut().position(|found| found.id == id) {
            Some(place) => self.trains[place] = added,
            None => {
                self.trains.push(added);
                self.commanded.push(SpeedStep::STAND);
            }
        }
        self.find_near();
    }

    /// The layout as its owner knows it.
    pub const fn layout(&self) -> &'l Layout {
        self.rails.layout
    }

    /// The time up to which the world has advanced: the next whole millisecond after the time asked for.
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// All incidents so far, in order.
    pub fn incidents(&self) -> &[Incident] {
        &self.incidents
    }

    /// Whether the rails are under power.
    pub const fn is_powered(&self) -> bool {
        self.is_powered
    }

    /// The true position of a turnout.
    pub fn lies(&self, turnout: TurnoutId) -> Option<Leg> {
        self.points.lies(turnout)
    }

    /// Begins another session after a pause: trains at rest have cooled down, and voltage, cleanness and load are
    /// drawn anew for each train from what its [`Traits`](crate::Traits) say.
    pub fn begin_session(&mut self, pause: TimeSpan) {
        self.trains.iter_mut().for_each(|train| train.begin_session(pause));
    }

    /// The next start from rest of a train comes earlier by a time, or later if negative: for tests of what one surprise
    /// does to a model.
    pub fn advance_next_start(&mut self, train: TrainId, by: TimeSpan) {
        if let Some(found) = self.trains.iter_mut().find(|found| found.id == train) {
            found.advance_next_start(by);
        }
    }

    /// The truth: for scorers only.
    pub const fn truth(&self) -> Truth<'_, 'l> {
        Truth { world: self }
    }

    /// Advances to a time.
    pub fn advance(&mut self, until: Timestamp) {
        while self.now < until {
            if self.points.next().is_none() && self.trains.iter().all(|train| train.sleeps) {
                // Nothing happens on a layout where nothing moves.
                let steps = (until - self.now).as_ns().div_euclid(STEP.as_ns());
                let whole = TimeSpan::from_ns(steps * STEP.as_ns());
                self.now = if self.now + whole < until { self.now + whole + STEP } else { self.now + whole };
                break;
            }
            self.step();
        }
    }

    /// The station commands a train to run at a step.
    pub(crate) fn command(&mut self, train: TrainId, step: SpeedStep, sent: Timestamp) {
        if let Some(place) = self.trains.iter().position(|found| found.id == train) {
            self.commanded[place] = step;
            self.send(place, Order::Step(step), sent);
        }
    }

    /// The station commands a train to reverse, once, which sets its step to 0.
    pub(crate) fn reverse(&mut self, train: TrainId, sent: Timestamp) {
        self.turn(train, Order::Turn, sent);
    }

    /// The station commands a direction, and goes on sending it: a decoder without power hears it when it has power again.
    pub(crate) fn face(&mut self, train: TrainId, forward: bool, sent: Timestamp) {
        if self.runs_forward(train) == Some(!forward) {
            self.turn(train, Order::Face, sent);
        }
    }

    fn turn(&mut self, train: TrainId, order: Order, sent: Timestamp) {
        if let Some(place) = self.trains.iter().position(|found| found.id == train) {
            self.commanded[place] = SpeedStep::STAND;
            self.send(place, order, sent);
        }
    }

    /// The station commands a train to stop at once.
    pub(crate) fn halt(&mut self, train: TrainId, sent: Timestamp) {
        if let Some(place) = self.trains.iter().position(|found| found.id == train) {
            self.commanded[place] = SpeedStep::STAND;
            self.send(place, Order::Halt, sent);
        }
    }

    /// Whether the front end of a train will lead once it has received all commands that were sent.
    pub(crate) fn runs_forward(&self, train: TrainId) -> Option<bool> {
        self.trains.iter().find(|found| found.id == train).map(LiveTrain::runs_forward)
    }

    /// The trains.
    pub(crate) fn train_ids(&self) -> impl Iterator<Item = TrainId> {
        self.trains.iter().map(|train| train.id)
    }

    fn send(&mut self, place: usize, order: Order, sent: Timestamp) {
        let train = &mut self.trains[place];
        let is_heard = self.is_powered || matches!(order, Order::Face);
        if is_heard && train.body.is_some() && !train.is_wrecked {
            train.send(order, sent);
        }
    }

    /// The station repeats its last command to a train, for a decoder that forgot it.
    pub(crate) fn repeat_command(&mut self, place: usize, now: Timestamp) {
        let step = self.commanded[place];
        if step != SpeedStep::STAND {
            self.send(place, Order::Step(step), now);
        }
    }

    /// The station forgets its commands to trains.
    pub(crate) fn forget_commands(&mut self) {
        self.commanded.fill(SpeedStep::STAND);
    }

    /// The station gives power to the rails, or takes it.
    pub(crate) fn power(&mut self, on: bool, now: Timestamp) {
        if on == self.is_powered {
            return;
        }
        self.is_powered = on;
        for place in 0..self.trains.len() {
            if on {
                self.repeat_command(place, now);
            } else {
                self.trains[place].lose_power();
            }
        }
    }

    /// A solenoid burns.
    pub(crate) fn burn(&mut self, turnout: TurnoutId, at: Timestamp) {
        self.points.burn(turnout);
        self.incidents.push(Incident { at, train: None, kind: IncidentKind::CoilBurnt { turnout } });
    }

    fn step(&mut self) {
        let Self { rails, points, s88, trains, rests, .. } = self;
        let (now, lies) = (self.now, |turnout| points.lies(turnout));
        let mut other_edges = false;
        let mut wrecked = None;
        for (place, train) in trains.iter_mut().enumerate() {
            if train.sleeps {
                continue;
            }
            let Stepped { other_edges: others, incident } =
                train.advance(now, &mut Around { rails, lies: &lies, s88, rests });
            other_edges |= others;
            if let Some(kind) = incident {
                wrecked = wrecked.or(Some((place, kind)));
            }
        }
        self.now = now + STEP;
        if let Some((place, kind)) = wrecked {
            self.wreck(place, kind);
        }
        if other_edges {
            self.find_near();
        }
        if !self.near.is_empty() {
            self.collide();
        }
        if self.points.next().is_some_and(|next| next <= self.now) {
            self.throw();
        }
    }

    /// Throws turnouts whose time has come; trains on their blades derail.
    fn throw(&mut self) {
        while let Some(turnout) = self.points.moved(self.now) {
            for place in 0..self.trains.len() {
                let train = &self.trains[place];
                let derails = train.body.as_ref().is_some_and(|body| body.is_on_blades(&self.rails, turnout));
                if derails && !train.is_wrecked {
                    self.wreck(place, IncidentKind::Derailment { turnout });
                }
            }
        }
    }

    fn collide(&mut self) {
        for at in 0..self.near.len() {
            let (one, other) = self.near[at];
            let (first, second) = (&self.trains[one], &self.trains[other]);
            let (Some(body), Some(beside)) = (&first.body, &second.body) else { continue };
            let was_so = first.is_wrecked && second.is_wrecked;
            if was_so || !body.touches(&self.rails, beside) {
                continue;
            }
            let ids = (first.id, second.id);
            self.wreck(one, IncidentKind::Collision { with: ids.1 });
            self.wreck(other, IncidentKind::Collision { with: ids.0 });
        }
    }

    fn wreck(&mut self, place: usize, kind: IncidentKind) {
        let train = &mut self.trains[place];
        train.stand(self.now, &mut self.rests);
        train.is_wrecked = true;
        self.incidents.push(Incident { at: self.now, train: Some(train.id), kind });
    }

    /// Finds the trains that may touch each other; needed whenever one is on other edges.
    pub(crate) fn find_near(&mut self) {
        self.near.clear();
        for (one, first) in self.trains.iter().enumerate() {
            for (other, second) in self.trains.iter().enumerate().skip(one + 1) {
                if let (Some(body), Some(beside)) = (&first.body, &second.body)
                    && body.is_near(&self.rails, beside)
                {
                    self.near.push((one, other));
                }
            }
        }
    }
}
