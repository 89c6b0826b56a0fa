//! Dispatched trains reach their destinations, stay on reserved track, and no turnout moves under them.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use std::sync::OnceLock;

use footplate_core::control::{
    Alarm, Dispatcher, Driver, Journey, LinkNews, Machine, Notice, Order, Output, Refusal, Reservation,
    TrainLengths,
};
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, Leg, Position, TurnoutStates};
use footplate_core::tracking::PathPoint;
use footplate_core::{
    Command, EdgeId, Length, SensorId, Speed, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};
use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, prop_assert, proptest};

use crate::toy_body::ToyBody;
use crate::toy_railway::{ToyRailway, known_model, step, straight};

pub(crate) const TRAINS: [TrainId; 2] = [TrainId(24), TrainId(58)];
/// Both starts are on the circuit.
pub(crate) const STARTS: [(&str, f64); 2] = [("D1", 500.0), ("B1", 150.0)];
pub(crate) const LENGTHS: TrainLengths =
    TrainLengths { overhang: Length::from_mm(50.0), pickup: Length::from_mm(30.0) };
/// Destinations: sensors of the circuit, in both directions.
pub(crate) const PLACES: [&str; 8] = ["A1", "A2", "B1", "B2", "C1", "C2", "D1", "D2"];
/// The fault of a train that is outside its reservation.
pub(crate) const STRAYED: &str = "is on track that it does not hold";
/// Positions are sums of lengths.
const ROUNDING: Length = Length::from_mm(0.5);

pub(crate) fn model(train: TrainId) -> MotionModel {
    static MODELS: OnceLock<[MotionModel; 2]> = OnceLock::new();
    let models = MODELS.get_or_init(|| TRAINS.map(|train| known_model(train.0)));
    models.iter().find(|model| model.train() == train).expect("one of two").clone()
}

/// Two trains on the toy railway's circuit.
pub(crate) struct Traffic {
    pub(crate) world: ToyRailway,
    pub(crate) dispatcher: Dispatcher,
    pub(crate) notices: Vec<Notice>,
    bodies: [ToyBody; 2],
    /// A turnout of which the link has no address: its commands are not sent.
    pub(crate) unsent: Option<TurnoutId>,
    /// The faults found so far.
    pub(crate) wrongs: Vec<String>,
}

impl Traffic {
    pub(crate) fn new() -> Self {
        Self::with(Dispatcher::new, STARTS)
    }

    /// The same with a watchdog.
    fn watched() -> Self {
        Self::with(Dispatcher::watched, STARTS)
    }

    pub(crate) fn with(
        dispatch: impl FnOnce(Timestamp, Driver) -> Dispatcher,
        starts: [(&str, f64); 2],
    ) -> Self {
        let [(node, mm), _] = starts;
        let mut world = ToyRailway::new(TRAINS[0].0, node, mm);
        let mut driver = Driver::new(world.layout.clone(), straight());
        for (train, (name, mm)) in TRAINS.into_iter().zip(starts) {
            let node = world.layout.node_named(name).expect("a node");
            driver.add_train(model(train));
            driver.place(
                world.now,
                train,
                PathPoint { node, distance: Length::from_mm(mm) },
                Length::from_mm(2.0),
            );
            world.put(train.0, name, mm);
        }
        let mut dispatcher = dispatch(world.now, driver);
        for train in TRAINS {
            dispatcher.set_lengths(world.now, train, LENGTHS);
        }
        let bodies = Default::default();
        Self { world, dispatcher, notices: Vec::new(), bodies, unsent: None, wrongs: Vec::new() }
    }

    pub(crate) fn go(&mut self, train: TrainId, place: &str) {
        let target = self.world.layout.landmark(place).expect("a place");
        self.dispatcher.go(self.world.now, train, Journey::to(target)).expect("on the layout");
    }

    fn listen(&mut self) {
        while let Some(output) = self.dispatcher.poll_output() {
            match output {
                Output::Command(Command::PowerOff | Command::PowerOn) => {}
                Output::Command(Command::Turnout { turnout, .. }) if self.unsent == Some(turnout) => {}
                Output::Command(command) => {
                    self.check_turnout(command);
                    self.world.command(command);
                }
                Output::Notice(notice) => self.notices.push(notice),
                Output::HoldLine(_) | Output::Watch(_) => {}
            }
        }
    }

    /// Every commanded turnout is reserved for exactly one train.
    fn check_turnout(&mut self, command: Command) {
        let Command::Turnout { turnout, .. } = command else { return };
        let has_reserved = |train: &&TrainId| {
            self.dispatcher.reservation(**train).is_some_and(|reserved| reserved.takes(turnout))
        };
        if TRAINS.iter().filter(has_reserved).count() != 1 {
            self.wrongs
                .push(format!("turnout {turnout} was thrown without being reserved for exactly one train"));
        }
    }

    pub(crate) fn run(&mut self, seconds: f64) {
        let end = self.world.now + TimeSpan::from_s(seconds);
        let mut looks_at = self.world.now;
        self.listen();
        while self.world.now < end && self.wrongs.is_empty() {
            let events = self.world.tick();
            self.follow();
            for event in events {
                self.dispatcher.handle_event(self.world.now.max(event.time), &event);
                self.listen();
            }
            if self.dispatcher.next_timeout().is_some_and(|at| at <= self.world.now) {
                self.dispatcher.handle_timeout(self.world.now);
                self.listen();
            }
            if looks_at <= self.world.now {
                looks_at += TimeSpan::from_ms(20);
                self.check_reservations();
            }
        }
    }

    fn follow(&mut self) {
        let ToyRailway { layout, turnouts, .. } = &self.world;
        for (train, body) in TRAINS.into_iter().zip(&mut self.bodies) {
            let at = self.world.trains.iter().find(|found| found.id == train).expect("on the rails").at;
            body.follow(layout, turnouts, at, LENGTHS.ahead(), LENGTHS.behind());
        }
    }

    /// The track under each train is reserved for it, and no track is reserved twice.
    fn check_reservations(&mut self) {
        let [one, two] = TRAINS.map(|train| self.dispatcher.reservation(train).expect("dispatched"));
        let mut wrongs = Vec::new();
        if one.meets(two) {
            wrongs.push("two trains hold the same track".to_owned());
        }
        for ((train, reserved), body) in TRAINS.into_iter().zip([one, two]).zip(&self.bodies) {
            let at = self.world.trains.iter().find(|found| found.id == train).expect("on the rails").at;
            let layout = &self.world.layout;
            let points = body.points(layout, at, LENGTHS.ahead(), LENGTHS.behind());
            if !points.into_iter().all(|point| is_held(layout, point, reserved)) {
                wrongs.push(format!("train {train} {STRAYED}: {at:?} of {reserved:?}"));
            }
        }
        self.wrongs.extend(wrongs);
    }

    /// Runs on until a sensor has been passed.
    pub(crate) fn run_to(&mut self, name: &str) {
        let reached = self.world.layout.sensor_named(name).expect("a sensor");
        while !self.world.passes.iter().any(|(_, sensor, _)| *sensor == reached) {
            self.run(0.05);
        }
    }

    pub(crate) fn arrivals(&self, train: TrainId) -> usize {
        let here =
            |notice: &&Notice| matches!(notice, Notice::Arrived { train: arrived, .. } if *arrived == train);
        self.notices.iter().filter(here).count()
    }
}

pub(crate) fn is_held(layout: &Layout, point: Position, reserved: &Reservation) -> bool {
    let length = layout.edge(point.edge).map_or(Length::ZERO, |edge| edge.length);
    let first = EdgeId(2 * point.edge.stretch().0);
    let offset = if point.edge == first { point.offset } else { length - point.offset };
    reserved.spans().any(|(stretch, span)| {
        stretch == point.edge.stretch() && span.from <= offset + ROUNDING && offset - ROUNDING <= span.to
    })
}

#[test]
fn a_dispatched_train_arrives_and_another_makes_room() {
    let mut traffic = Traffic::new();
    traffic.go(TRAINS[0], "C1+150mm");
    traffic.run(90.0);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    assert_eq!(traffic.arrivals(TRAINS[0]), 1, "{:#?}", traffic.notices);
    // The other train is at rest there.
    traffic.go(TRAINS[0], "B1+150mm");
    traffic.run(120.0);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    assert_eq!(traffic.arrivals(TRAINS[0]), 2, "{:#?}", traffic.notices);
    let aside = |notice: &Notice| matches!(notice, Notice::StepsAside { .. });
    assert!(traffic.notices.iter().any(aside), "{:#?}", traffic.notices);
}

#[test]
fn a_train_runs_once_round_to_a_place_just_behind_it() {
    // Given a circuit that is free, a place 20 mm behind the train, and its overrun there, which ends beyond the train,
    let mut traffic = Traffic::with(Dispatcher::new, [("D1", 500.0), ("EN1", 150.0)]);
    let target = traffic.world.layout.landmark("D1+480mm").expect("a place");
    // when it is sent there in the direction it faces,
    let journey = Journey { faces: true, ..Journey::to(target) };
    traffic.dispatcher.go(traffic.world.now, TRAINS[0], journey).expect("on the layout");
    traffic.run(60.0);
    // then it arrives after one lap, on the first route that is set for it.
    assert_eq!(traffic.arrivals(TRAINS[0]), 1, "{:#?}", traffic.notices);
    let set = |notice: &&Notice| matches!(notice, Notice::RouteSet { .. });
    assert_eq!(traffic.notices.iter().filter(set).count(), 1, "{:#?}", traffic.notices);
    let at = traffic.world.trains[0].at;
    assert!((at.offset.as_mm() - 480.0).abs() < 15.0, "{at:?}");
    assert_eq!(traffic.wrongs, Vec::<String>::new());
}

#[test]
fn a_train_driven_by_hand_stops_before_the_track_of_another() {
    let mut traffic = Traffic::new();
    let speed = Order::Speed { train: TRAINS[0], step: step(10) };
    traffic.dispatcher.order(traffic.world.now, speed).expect("a step");
    let ends = |traffic: &Traffic| traffic.notices.contains(&Notice::AuthorityEnds { train: TRAINS[0] });
    while !ends(&traffic) && traffic.world.now < Timestamp::from_s(30.0) {
        traffic.run(0.01);
    }
    let holders = TRAINS.map(|train| traffic.dispatcher.holders_beyond(train, traffic.world.now));
    assert_eq!(holders, [vec![TRAINS[1]], vec![]], "a person reads whose the track ahead is");
    traffic.run(25.0);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    assert!(traffic.world.trains.iter().all(|train| train.speed_mm_per_s < 1.0));
    let throw = Order::Turnout { turnout: TurnoutId(1), curved: true };
    let taken = traffic.dispatcher.order(traffic.world.now, throw);
    assert!(matches!(taken, Err(Refusal::TurnoutOccupied { turnout: TurnoutId(1), .. })), "{taken:?}");
}

#[test]
fn a_train_missed_before_the_end_of_its_track_is_located_behind_it() {
    // Given a train on a dead-end track, missed by the last sensor before the end,
    let mut traffic = Traffic::with(Dispatcher::new, [("EN1", 150.0), ("B1", 150.0)]);
    traffic.world.dead.insert(traffic.world.layout.sensor_named("F1").expect("a sensor"));
    traffic.go(TRAINS[0], "F1+400mm");
    traffic.run(30.0);
    assert_eq!(traffic.arrivals(TRAINS[0]), 1, "{:#?}", traffic.notices);
    // when it is sent back,
    traffic.go(TRAINS[0], "E1+300mm");
    traffic.run(60.0);
    // then it arrives without anyone entering its position.
    assert_eq!(traffic.arrivals(TRAINS[0]), 2, "{:#?}", traffic.notices);
    let lost = |notice: &Notice| matches!(notice, Notice::ReservedAsUnknown { .. });
    assert!(!traffic.notices.iter().any(lost), "{:#?}", traffic.notices);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
}

#[test]
fn a_train_too_close_to_a_turnout_to_throw_it_backs_away_first() {
    // Given a train whose overhang is over turnout 1, which is set for the other leg,
    let mut traffic = Traffic::with(Dispatcher::new, [("D1", 500.0), ("B1", 250.0)]);
    let go = |traffic: &mut Traffic, place: &str| {
        let journey =
            Journey { faces: true, ..Journey::to(traffic.world.layout.landmark(place).expect("a place")) };
        traffic.dispatcher.go(traffic.world.now, TRAINS[0], journey).expect("on the layout");
        traffic.run(60.0);
    };
    go(&mut traffic, "A1+160mm");
    assert_eq!(traffic.arrivals(TRAINS[0]), 1, "{:#?}", traffic.notices);
    assert_eq!(traffic.world.turnouts.get(TurnoutId(1)), Some(Leg::Straight));
    // when it is sent over the leg for which the turnout is not set, and has to come from this side,
    go(&mut traffic, "C1+150mm");
    // then it arrives over the turnout thrown for it.
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    assert_eq!(traffic.arrivals(TRAINS[0]), 2, "{:#?}", traffic.notices);
    let at = traffic.world.trains[0].at;
    let node = traffic.world.layout.node_named("C1").expect("a node");
    assert_eq!(traffic.world.layout.edge(at.edge).map(|edge| edge.from), Some(node));
    assert!((at.offset.as_mm() - 150.0).abs() < 15.0, "{at:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn every_train_stays_on_its_reserved_track(
        sent in vec((0_usize..2, 0_usize..8, 0.0..180.0_f64, 2.0..25.0_f64), 4..10),
        deaf in vec(0_u16..8, 0..2),
    ) {
        let mut traffic = Traffic::new();
        traffic.world.dead.extend(deaf.into_iter().map(SensorId));
        for (train, place, mm, seconds) in sent {
            let place = PLACES.get(place).expect("one of eight");
            traffic.go(TRAINS[train], &format!("{place}{mm:+.0}mm"));
            traffic.run(seconds);
            prop_assert!(traffic.wrongs.is_empty(), "{:?}", traffic.wrongs);
        }
        traffic.run(60.0);
        prop_assert!(traffic.wrongs.is_empty(), "{:?}", traffic.wrongs);
    }
}

#[test]
fn a_train_at_rest_too_uncertain_to_run_is_located_first() {
    // 1.2 m are the largest overrun, at 3.59 standard deviations: 334 mm. Below, it is searched where nothing else bars its path.
    for (uncertainty, searches) in [(20.0, 0), (330.0, 1), (340.0, 1)] {
        let starts = [("D1", 500.0), ("EN1", 150.0)];
        let mut traffic = Traffic::with(Dispatcher::watched, starts);
        let [(node, mm), _] = starts;
        let node = traffic.world.layout.node_named(node).expect("a node");
        let at = PathPoint { node, distance: Length::from_mm(mm) };
        let now = traffic.world.now;
        traffic.dispatcher.place(now, TRAINS[0], at, Length::from_mm(uncertainty));
        let lost = |notice: &&Notice| matches!(notice, Notice::Danger { why: Alarm::Lost, .. });
        traffic.go(TRAINS[0], "C1+150mm");
        traffic.run(200.0);
        assert_eq!(traffic.notices.iter().filter(lost).count(), searches, "from {uncertainty} mm");
        assert_eq!(traffic.arrivals(TRAINS[0]), 1, "from {uncertainty} mm: {:#?}", traffic.notices);
        assert_eq!(traffic.wrongs, Vec::<String>::new());
    }
}

#[test]
fn a_journey_interrupted_by_a_silent_station_is_completed_after_recovery() {
    let mut traffic = Traffic::watched();
    traffic.go(TRAINS[0], "C1+150mm");
    traffic.run(2.5);
    assert!(traffic.world.trains[0].speed_mm_per_s > 50.0);
    traffic.dispatcher.handle_link(traffic.world.now, LinkNews::Silent);
    traffic.run(4.0);
    assert!(traffic.world.trains[0].speed_mm_per_s < 1.0);
    traffic.dispatcher.handle_link(traffic.world.now, LinkNews::Answers);
    traffic.run(200.0);
    let watched =
        |wanted: fn(&Notice) -> bool| traffic.notices.iter().filter(|notice| wanted(notice)).count();
    assert_eq!(watched(|notice| matches!(notice, Notice::Danger { .. })), 1);
    assert!(traffic.wrongs.is_empty(), "{:?}", traffic.wrongs);
    assert_eq!(watched(|notice| matches!(notice, Notice::Recovered { .. })), 1);
    assert_eq!(traffic.arrivals(TRAINS[0]), 1);
}

#[test]
fn an_order_that_a_recovery_interrupts_goes_on_after_it() {
    // A train that holds a speed, with another far ahead, is stopped because the station is silent.
    let mut traffic = Traffic::with(Dispatcher::watched, [("D1", 500.0), ("C1", 150.0)]);
    let hold = Order::Hold { train: TRAINS[0], speed: Speed::from_mm_per_s(200.0) };
    let order = traffic.dispatcher.order(traffic.world.now, hold).expect("the track ahead is free");
    traffic.run(2.5);
    traffic.dispatcher.handle_link(traffic.world.now, LinkNews::Silent);
    traffic.run(4.0);
    assert_eq!(traffic.dispatcher.interrupted(TRAINS[0]), Some(order), "{:#?}", traffic.notices);
    traffic.dispatcher.handle_link(traffic.world.now, LinkNews::Answers);
    traffic.run(200.0);
    // Its order goes on once it is located, and is not said to have ended.
    let resumed = |notice: &&Notice| matches!(notice, Notice::Resumed { interrupted, .. } if *interrupted == Some(order));
    assert_eq!(traffic.notices.iter().filter(resumed).count(), 1, "{:#?}", traffic.notices);
    let ended = |notice: &&Notice| match notice {
        Notice::GivenUp { order: ended, .. } | Notice::Replaced { order: ended, .. } => *ended == order,
        Notice::Cancelled { .. } => true,
        _ => false,
    };
    assert_eq!(traffic.notices.iter().find(ended), None);
    assert_eq!(traffic.dispatcher.interrupted(TRAINS[0]), None);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
}

#[test]
fn a_train_driven_by_hand_is_stopped_before_another_and_can_be_dispatched_afterwards() {
    let mut traffic = Traffic::new();
    traffic
        .dispatcher
        .order(traffic.world.now, Order::Speed { train: TRAINS[0], step: step(9) })
        .expect("free");
    traffic.run(60.0);
    assert!(traffic.wrongs.is_empty(), "{:?}", traffic.wrongs);
    assert!(traffic.world.trains[0].speed_mm_per_s < 1.0);
    // The train at rest keeps only the track under it: both can reach their destinations.
    traffic.go(TRAINS[1], "D1+150mm");
    traffic.run(60.0);
    traffic.go(TRAINS[0], "A1+150mm");
    traffic.run(60.0);
    assert!(traffic.wrongs.is_empty(), "{:?}", traffic.wrongs);
    assert_eq!((traffic.arrivals(TRAINS[0]), traffic.arrivals(TRAINS[1])), (1, 1), "{:#?}", traffic.notices);
}

#[test]
fn no_train_is_dispatched_while_the_position_of_another_is_unknown() {
    let traffic = Traffic::new();
    let mut driver = Driver::new(traffic.world.layout.clone(), straight());
    TRAINS.into_iter().for_each(|train| driver.add_train(model(train)));
    let node = traffic.world.layout.node_named("D1").expect("a node");
    driver.place(
        traffic.world.now,
        TRAINS[0],
        PathPoint { node, distance: Length::ZERO },
        Length::from_mm(2.0),
    );
    let mut dispatcher = Dispatcher::new(traffic.world.now, driver);
    let journey = Journey::to(traffic.world.layout.landmark("C1+150mm").expect("a place"));
    let [known, other] = TRAINS;
    let refused = dispatcher.go(traffic.world.now, known, journey);
    assert_eq!(refused, Err(Refusal::OtherNowhere { train: known, other }));
    let refused = dispatcher.go(traffic.world.now, other, journey);
    assert_eq!(refused, Err(Refusal::Lost { train: other }));
}

#[test]
fn a_journey_goes_on_after_a_person_switched_the_power_off_and_on() {
    let mut traffic = Traffic::watched();
    traffic.go(TRAINS[0], "C1+150mm");
    traffic.run(2.5);
    traffic.dispatcher.switch_power(traffic.world.now, false);
    traffic.run(5.0);
    traffic.dispatcher.switch_power(traffic.world.now, true);
    traffic.run(60.0);
    assert!(traffic.wrongs.is_empty(), "{:?}", traffic.wrongs);
    assert_eq!(traffic.arrivals(TRAINS[0]), 1, "{:#?}", traffic.notices);
}

/// The same two trains with all turnouts unknown.
/// A watched dispatcher to which only these turnout positions are known.
pub(crate) fn knowing(turnouts: &TurnoutStates, starts: [(&str, f64); 2]) -> Traffic {
    Traffic::with(
        |now, driver| {
            let mut knowing = Driver::new(driver.layout().clone(), turnouts.clone());
            for train in TRAINS {
                let located = driver.locate(train, now).expect("placed");
                knowing.add_train(model(train));
                knowing.place(now, train, located.at, located.uncertainty);
            }
            Dispatcher::watched(now, knowing)
        },
        starts,
    )
}

#[test]
fn unknown_turnouts_are_set_for_a_journey() {
    let mut traffic = knowing(&TurnoutStates::unknown(), [("A1", 50.0), ("B1", 300.0)]);
    traffic.go(TRAINS[0], "C1+100mm");
    traffic.run(60.0);
    assert!(traffic.wrongs.is_empty(), "{:?}", traffic.wrongs);
    assert_eq!(traffic.arrivals(TRAINS[0]), 1, "{:#?}", traffic.notices);
}

#[test]
fn a_journey_is_refused_while_a_train_may_be_on_a_turnout_of_unknown_position() {
    let mut traffic = knowing(&TurnoutStates::unknown(), [("D1", 500.0), ("A1", 250.0)]);
    let journey = Journey::to(traffic.world.layout.landmark("C1").expect("a place"));
    let refused = traffic.dispatcher.go(traffic.world.now, TRAINS[0], journey);
    assert_eq!(refused, Err(Refusal::TurnoutUnknown { turnout: TurnoutId(1), train: TRAINS[1] }));
}

#[test]
fn an_order_that_is_refused_ends_no_journey() {
    let mut traffic = Traffic::watched();
    traffic.go(TRAINS[0], "C1+150mm");
    traffic.run(2.5);
    let step = SpeedStep::new(99).expect("a step");
    let refused = traffic.dispatcher.order(traffic.world.now, Order::Speed { train: TRAINS[0], step });
    assert!(matches!(refused, Err(Refusal::StepTooHigh { .. })), "{refused:?}");
    traffic.run(60.0);
    assert!(traffic.wrongs.is_empty(), "{:?}", traffic.wrongs);
    assert_eq!(traffic.arrivals(TRAINS[0]), 1, "{:#?}", traffic.notices);
}

#[test]
fn a_journey_ordered_without_power_waits_for_it() {
    let mut traffic = Traffic::watched();
    traffic.dispatcher.switch_power(traffic.world.now, false);
    traffic.go(TRAINS[0], "C1+150mm");
    traffic.run(60.0);
    // No turnout is thrown, and the journey is not given up.
    assert!(
        !traffic
            .notices
            .iter()
            .any(|notice| matches!(notice, Notice::GivenUp { .. } | Notice::Withdrawn { .. }))
    );
    traffic.dispatcher.switch_power(traffic.world.now, true);
    traffic.run(60.0);
    assert_eq!(traffic.arrivals(TRAINS[0]), 1, "{:#?}", traffic.notices);
}
