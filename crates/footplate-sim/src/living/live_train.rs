//! One train of a living layout: its commands, what drives it, and where it is.

use std::collections::VecDeque;
use std::sync::Arc;

use footplate_core::track::Leg;
use footplate_core::{SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use crate::draws::Draws;
use crate::electric::Surroundings;
use crate::living::body::{Body, Coming, Met};
use crate::living::drive::Drive;
use crate::living::incident::IncidentKind;
use crate::living::past_truth::RestTruth;
use crate::living::rails::Rails;
use crate::living::s88::S88;
use crate::load::Load;
use crate::motor::STEP_S;
use crate::train::Train;
use crate::traits::Session;

/// The step of the integration as a span of time.
pub(crate) const STEP: TimeSpan = TimeSpan::from_ms(1);
/// How a train slows down whose motor is turned around while it runs, in mm/s² (chosen: from 300 mm/s within 15 mm,
/// from top speed within 6 cm; people call it "stopped dead").
const TURNED_MM_PER_S2: f64 = 3000.0;
/// How a train slows down without power, in mm/s² (chosen: a worm gear does not roll; from top speed within 12 cm.
/// There is no decoder that could hold to its law).
const POWERLESS_MM_PER_S2: f64 = 1500.0;

/// The ends of an engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum End {
    /// The front end, that leads when it runs forward.
    Nose,
    /// The rear end.
    Tail,
}

impl End {
    const fn other(self) -> Self {
        match self {
            Self::Nose => Self::Tail,
            Self::Tail => Self::Nose,
        }
    }
}

/// A command to a decoder.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Order {
    Step(SpeedStep),
    /// Reverse.
    Turn,
    /// Reverse, from a station that repeats the direction.
    Face,
    /// Stop at once, in the same direction.
    Halt,
}

/// One train.
#[derive(Debug, Clone)]
pub(crate) struct LiveTrain {
    pub(crate) id: TrainId,
    pub(crate) train: Arc<Train>,
    motor: Drive,
    pub(crate) load: Load<Arc<Train>>,
    draws: Draws,
    /// Nothing while it is lifted.
    pub(crate) body: Option<Body>,
    pub(crate) leads: End,
    /// Commands that the decoder has not received yet, and when it does.
    orders: VecDeque<(Timestamp, Order)>,
    /// The step that its decoder received last.
    pub(crate) heard: SpeedStep,
    /// Stopping without its decoder: by how much each second, in mm/s², and how fast the wheels still turn.
    halting: Option<(f64, f64)>,
    pub(crate) speed: f64,
    /// Speed with dirty wheels over speed with clean ones.
    pub(crate) wheels: f64,
    pub(crate) odometer: f64,
    /// What that showed when a hand put the train down last.
    pub(crate) put_down_at: f64,
    /// Since when it has stood, while it stands.
    pub(crate) stands_since: Option<Timestamp>,
    /// None of its commands will move it.
    pub(crate) sleeps: bool,
    pub(crate) is_wrecked: bool,
}

/// What a train steps through: the world around it.
pub(crate) struct Around<'a, 'l, L: Fn(TurnoutId) -> Option<Leg>> {
    pub(crate) rails: &'a Rails<'l>,
    pub(crate) lies: &'a L,
    pub(crate) s88: &'a mut S88,
    pub(crate) rests: &'a mut Vec<RestTruth>,
}

/// What a step changed that concerns others.
#[derive(Debug, Default)]
pub(crate) struct Stepped {
    /// It is on other edges than before.
    pub(crate) other_edges: bool,
    pub(crate) incident: Option<IncidentKind>,
}

impl LiveTrain {
    pub(crate) fn new(id: TrainId, train: Train, warmth: f64, mut draws: Draws) -> Self {
        let train = Arc::new(train);
        Self {
            id,
            motor: Drive::at_rest(&train),
            load: Load::new(Arc::clone(&train), warmth, 1.0, draws.split()),
            train,
            draws,
            body: None,
            leads: End::Nose,
            orders: VecDeque::new(),
            heard: SpeedStep::STAND,
            halting: None,
            speed: 0.0,
            wheels: 1.0,
            odometer: 0.0,
            put_down_at: 0.0,
            stands_since: Some(Timestamp::ZERO),
            sleeps: true,
            is_wrecked: false,
        }
    }

    /// Front overhang, shoe and rear overhang as it runs now, in mm.
    pub(crate) fn lengths(&self) -> [f64; 3] {
        let Train { nose, shoe, tail, .. } = &*self.train;
        // No part of a train is shorter than nothing, whatever a test asks for.
        let [nose, shoe, tail] = [nose, shoe, tail].map(|length| length.as_mm().max(0.0));
        match self.leads {
            End::Nose => [nose, shoe, tail],
            End::Tail => [tail, shoe, nose],
        }
    }

    /// How far ahead of the leading end of its shoe detectors sense it, and how far behind, as it runs now, in mm: the engine
    /// draws its current through the shoe, and carriages have axles with a resistor.
    pub(crate) fn sensed(&self) -> [f64; 2] {
        let shoe = self.train.shoe.as_mm().max(0.0);
        let carriages = self.train.last_axle().as_mm();
        match self.leads {
            End::Nose => [0.0, shoe + carriages],
            End::Tail => [carriages, shoe],
        }
    }

    /// A command has left the line; its decoder receives it some time later.
    pub(crate) fn send(&mut self, order: Order, sent: Timestamp) {
        let delay = self.draws.normal(self.train.command_delay.as_s(), self.train.command_jitter.as_s());
        let last = self.orders.back().map_or(sent, |(heard, _)| *heard);
        // The decoder receives nothing before the present step has ended, and no command overtakes another.
        let heard = (sent + TimeSpan::from_s(delay.clamp(0.0, 1.0))).max(sent + STEP).max(last);
        self.orders.push_back((heard, order));
        self.sleeps = false;
    }

    /// Whether its front end leads once it has received all commands that were sent.
    pub(crate) fn runs_forward(&self) -> bool {
        let turns =
            self.orders.iter().filter(|(_, order)| matches!(order, Order::Turn | Order::Face)).count();
        (self.leads == End::Nose) == turns.is_multiple_of(2)
    }

    /// Its decoder loses power and forgets everything.
    pub(crate) fn lose_power(&mut self) {
        self.orders.retain(|(_, order)| matches!(order, Order::Face));
        self.heard = SpeedStep::STAND;
        self.halt(POWERLESS_MM_PER_S2);
    }

    /// Stops it at once; its decoder forgets its commands.
    pub(crate) fn stand(&mut self, now: Timestamp, rests: &mut Vec<RestTruth>) {
        self.halting = None;
        self.orders.clear();
        self.heard = SpeedStep::STAND;
        self.motor.reset();
        self.come_to_rest(now, rests);
    }

    fn come_to_rest(&mut self, now: Timestamp, rests: &mut Vec<RestTruth>) {
        self.speed = 0.0;
        if self.stands_since.is_none() {
            self.stands_since = Some(now);
            let place = self.body.as_ref().and_then(Body::place);
            rests.extend(place.map(|place| RestTruth::new(self.id, place, now, self.odometer)));
        }
    }

    fn halt(&mut self, mm_per_s2: f64) {
        if !self.motor.is_at_rest() && self.halting.is_none() {
            self.halting = Some((mm_per_s2, self.motor.speed()));
        }
        if self.halting.is_none() {
            self.motor.reset();
        }
        self.sleeps = false;
    }

    /// One integration step from `now`.
    pub(crate) fn advance<L: Fn(TurnoutId) -> Option<Leg>>(
        &mut self,
        now: Timestamp,
        around: &mut Around<'_, '_, L>,
    ) -> Stepped {
        let mut stepped = Stepped::default();
        if self.orders.front().is_some_and(|(heard, _)| *heard <= now)
            && let Some((_, order)) = self.orders.pop_front()
        {
            stepped.other_edges = self.obey(order, around.rails);
        }
        let wheel = self.turn_wheels();
        let Some(body) = &mut self.body else {
            self.fall_asleep();
            return stepped;
        };
        if wheel > 0.0 {
            if let Some(since) = self.stands_since.take() {
                self.load.stand((now - since).as_s());
                self.load.begin_run(body.factor);
                if let Some(last) = around.rests.iter_mut().rev().find(|rest| rest.train == self.id) {
                    last.until = Some(now);
                }
                stepped.incident = body
                    .splits(around.rails, around.lies)
                    .map(|turnout| IncidentKind::Derailment { turnout });
            }
        } else if self.speed == 0.0 {
            self.fall_asleep();
            return stepped;
        }
        let here = body.lead;
        let grade = 1.0 - self.train.traits.grade_sensitivity * body.grade;
        let load = self.load.advance(body.factor, here < body.dirty_until, wheel > 0.0);
        let speed = self.wheels
            * if self.motor.feels_the_rail() {
                wheel
            } else {
                wheel * load * grade * self.load.session_factor(wheel)
            };
        let gone = 0.5 * (self.speed + speed) * STEP_S;
        let there = here + gone;
        self.speed = speed;
        self.odometer += gone;
        body.lead = there;
        if there >= body.next {
            // Within a millisecond the speed is as good as constant.
            let part = |at_mm: f64| ((at_mm - here) / gone).clamp(0.0, 1.0);
            let when = |at_mm: f64| now + TimeSpan::from_s(STEP_S * part(at_mm));
            let counted = self.odometer - there;
            while let Some(met) = body.meet(around.rails, around.lies) {
                match met {
                    Met::Touches(Coming { sensor, usual_mm }) => {
                        if around.s88.close(sensor.what, when(sensor.at_mm), self.id, counted + usual_mm) {
                            body.hold(sensor);
                        }
                    }
                    Met::Leaves(sensor) => {
                        around.s88.leave(sensor.what, when(sensor.at_mm + self.train.shoe.as_mm()));
                    }
                    Met::Vacates(end) => around.s88.vacate(end.what, when(end.at_mm)),
                    Met::Dirt => {
                        if self.load.stalls(wheel) {
                            self.motor.cut_off();
                        }
                    }
                    Met::OtherEdges => stepped.other_edges = true,
                    Met::IllegalPair(turnout) => {
                        stepped.incident = Some(IncidentKind::Derailment { turnout });
                        break;
                    }
                    Met::End => {
                        stepped.incident = Some(IncidentKind::Overrun);
                        break;
                    }
                }
            }
        }
        if wheel == 0.0 {
            self.come_to_rest(now + STEP, around.rests);
        }
        stepped
    }

    /// How fast the wheels would turn on level straight track, one step later.
    fn turn_wheels(&mut self) -> f64 {
        let Some((rate, wheel)) = &mut self.halting else {
            let body = self.body.as_ref();
            let (rail, grade) = body.map_or((1.0, 0.0), |body| (body.factor, body.grade));
            let around = Surroundings { rail, grade, warmth: self.load.warmth() };
            return self.motor.advance(around, &mut self.draws);
        };
        *wheel = (*wheel - *rate * STEP_S).max(0.0);
        let wheel = *wheel;
        if wheel == 0.0 {
            self.halting = None;
            self.motor.reset();
            if self.heard != SpeedStep::STAND {
                self.motor.command(self.heard, &mut self.draws);
            }
        }
        wheel
    }

    /// Its decoder executes a command. Returns whether the train is on other edges than before.
    fn obey(&mut self, order: Order, rails: &Rails<'_>) -> bool {
        match order {
            // Stations repeat commands; a decoder does not begin again.
            Order::Step(step) if step == self.heard => false,
            Order::Step(step) => {
                self.heard = step;
                if self.halting.is_none() {
                    self.motor.command(step, &mut self.draws);
                }
                false
            }
            Order::Halt => {
                self.heard = SpeedStep::STAND;
                self.halt(TURNED_MM_PER_S2);
                false
            }
            Order::Turn | Order::Face => {
                self.heard = SpeedStep::STAND;
                self.halt(TURNED_MM_PER_S2);
                if self.halting.is_some() {
                    // It reverses at rest.
                    self.orders.push_front((Timestamp::ZERO, order));
                    return false;
                }
                self.leads = self.leads.other();
                if let Some(body) = &mut self.body {
                    body.turn(rails);
                }
                true
            }
        }
    }

    /// The scatter of the places where it closes sensors, if the world has any: its draws and its standard deviation (mm).
    pub(crate) fn shoe_scatter(&mut self, scatters: bool) -> Option<(Draws, f64)> {
        scatters.then(|| (self.draws.split(), self.train.traits.shoe_scatter_mm))
    }

    /// Another session begins after a pause.
    pub(crate) fn begin_session(&mut self, pause: TimeSpan) {
        if self.stands_since.is_some() {
            self.load.stand(pause.as_s().max(0.0));
        }
        let session = Session::draw(&self.train.traits.session, &mut self.draws);
        self.load.begin_session(session);
        self.motor.begin_session(session);
    }

    /// The next start from rest comes earlier by a time.
    pub(crate) fn advance_next_start(&mut self, by: TimeSpan) {
        self.motor.advance_next_start(by.as_s());
    }

    fn fall_asleep(&mut self) {
        self.sleeps = self.motor.stays_at_rest() && self.orders.is_empty() && self.halting.is_none();
    }
}
