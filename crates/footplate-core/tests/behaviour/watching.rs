//! A watchdog stops a train that no longer behaves as modelled, and all trains that could meet it; it switches the
//! power off if a stop is not confirmed, and recovers trains by measuring them again. Whatever is reported, a train
//! in danger is not commanded to move.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use std::collections::BTreeSet;

use footplate_core::control::{
    Alarm, LinkNews, Machine, Notice, Order, Outcome, Output, Refusal, Remeasured, StopOrder, Watchdog,
};
use footplate_core::track::Landmark;
use footplate_core::{
    Command, Event, EventKind, Length, NodeId, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId,
    TurnoutId,
};
use proptest::collection::vec;
use proptest::prelude::{Just, ProptestConfig, Strategy, any, prop_assert, prop_oneof, proptest};

use crate::toy_railway::{ToyRailway, add_train, driver_of, step};

pub(crate) const FIRST: TrainId = TrainId(24);
pub(crate) const SECOND: TrainId = TrainId(58);

/// A world with a watchdog, and all its notices and commands.
pub(crate) struct Watched {
    pub(crate) world: ToyRailway,
    pub(crate) dog: Watchdog,
    pub(crate) notices: Vec<Notice>,
    pub(crate) commanded: Vec<(Timestamp, Command)>,
}

impl Watched {
    pub(crate) fn one() -> Self {
        let world = ToyRailway::new(24, "D1", 300.0);
        let driver = driver_of(&world, "D1", 300.0);
        let dog = Watchdog::new(driver, world.now);
        Self { world, dog, notices: Vec::new(), commanded: Vec::new() }
    }

    pub(crate) fn asking() -> Self {
        let mut watched = Self::one();
        watched.dog.ask_before_creeping();
        watched.go(FIRST, 8);
        watched.run(6.0);
        watched.dog.distrust(watched.world.now, FIRST);
        watched.run(30.0);
        watched
    }

    /// The same, with train 58 half a lap ahead.
    pub(crate) fn two() -> Self {
        Self::with_another_at("B1", 100.0)
    }

    pub(crate) fn with_another_at(node: &str, mm: f64) -> Self {
        let mut world = ToyRailway::new(24, "D1", 300.0);
        world.put(58, node, mm);
        let mut driver = driver_of(&world, "D1", 300.0);
        add_train(&mut driver, &world, 58, Some((node, mm)));
        let dog = Watchdog::new(driver, world.now);
        Self { world, dog, notices: Vec::new(), commanded: Vec::new() }
    }

    fn listen(&mut self) {
        while let Some(output) = self.dog.poll_output() {
            match output {
                Output::Command(command) => {
                    self.commanded.push((self.world.now, command));
                    // Power is not part of the toy world.
                    if !matches!(command, Command::PowerOff | Command::PowerOn) {
                        self.world.command(command);
                    }
                }
                Output::Notice(notice) => self.notices.push(notice),
                Output::HoldLine(_) | Output::Watch(_) => {}
            }
        }
    }

    pub(crate) fn run_until(&mut self, seconds: f64, is_so: impl Fn(&Self) -> bool) -> bool {
        let end = self.world.now + TimeSpan::from_s(seconds);
        self.listen();
        while self.world.now < end && !is_so(self) {
            for event in self.world.tick() {
                self.dog.handle_event(self.world.now.max(event.time), &event);
                self.listen();
            }
            if self.dog.next_timeout().is_some_and(|at| at <= self.world.now) {
                self.dog.handle_timeout(self.world.now);
                self.listen();
            }
        }
        is_so(self)
    }

    pub(crate) fn run(&mut self, seconds: f64) {
        self.run_until(seconds, |_| false);
    }

    pub(crate) fn go(&mut self, train: TrainId, number: u8) {
        self.dog.order(self.world.now, Order::Speed { train, step: step(number) }).expect("free to go");
    }

    /// An operator puts the first train down and enters its position.
    fn put_first_down(&mut self) {
        self.world.put(24, "D1", 100.0);
        let node = self.world.layout.node_named("D1").expect("a node");
        let at = footplate_core::tracking::PathPoint { node, distance: Length::from_mm(100.0) };
        self.dog.place(self.world.now, FIRST, at, Length::from_mm(3.0));
    }

    pub(crate) fn alarm(&self) -> Option<Alarm> {
        self.notices.iter().find_map(|notice| match notice {
            Notice::Danger { why, .. } => Some(*why),
            _ => None,
        })
    }

    pub(crate) fn recovered(&self) -> Option<Outcome> {
        self.notices.iter().find_map(|notice| match notice {
            Notice::Recovered { outcome, .. } => Some(*outcome),
            _ => None,
        })
    }

    fn power_off(&self) -> Option<Timestamp> {
        self.commanded.iter().find(|(_, command)| *command == Command::PowerOff).map(|(at, _)| *at)
    }
}

#[test]
fn a_healthy_train_raises_no_alarm() {
    let mut watched = Watched::one();
    watched.go(FIRST, 9);
    watched.run(120.0);
    assert_eq!(watched.alarm(), None, "{:#?}", watched.notices);
}

#[test]
fn dirty_wheels_are_detected_measured_and_compensated() {
    let mut watched = Watched::one();
    watched.go(FIRST, 9);
    watched.run(20.0);
    // When a train gets slower by a fifth,
    watched.world.trains[0].wheels = 0.8;
    assert!(watched.run_until(15.0, |watched| watched.alarm().is_some()), "{:#?}", watched.notices);
    // then it is stopped, located, measured,
    assert!(watched.run_until(200.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
    let Some(Outcome::Rescaled { ratio }) = watched.recovered() else { panic!("{:#?}", watched.notices) };
    assert!((ratio - 0.8).abs() < 0.02, "{ratio}");
    // hands over what its fit goes on from, once,
    assert!(matches!(watched.dog.take_remeasured(FIRST), Some(Remeasured::Changed(_))));
    assert!(watched.dog.take_remeasured(FIRST).is_none());
    // continues its order,
    assert!(watched.notices.iter().any(|notice| matches!(notice, Notice::Resumed { train: FIRST, .. })));
    watched.run(20.0);
    assert!(watched.world.trains[0].speed_mm_per_s > 100.0);
    // and stops at its target.
    let target = watched.dog.driver().layout().landmark("A1+150mm").expect("a place");
    watched.dog.order(watched.world.now, Order::Stop(StopOrder::at(FIRST, target))).expect("ahead");
    watched.run(60.0);
    assert!(watched.world.beyond_mm("A1+150mm").abs() < 60.0, "{}", watched.world.beyond_mm("A1+150mm"));
    assert!(watched.power_off().is_none());
}

#[test]
fn a_delayed_train_is_checked_even_if_it_runs_as_before() {
    let mut watched = Watched::one();
    watched.go(FIRST, 9);
    watched.run(20.0);
    // The train was lifted for a moment: it may be another locomotive now.
    watched.world.trains[0].wheels = 0.0;
    watched.run(1.5);
    watched.world.trains[0].wheels = 1.0;
    assert!(watched.run_until(10.0, |watched| watched.alarm().is_some()), "{:#?}", watched.notices);
    assert!(matches!(watched.alarm(), Some(Alarm::Untimely(_))), "{:?}", watched.alarm());
    assert!(watched.run_until(120.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
    assert_eq!(watched.recovered(), Some(Outcome::AsBefore));
}

#[test]
fn a_late_start_raises_no_alarm() {
    let mut watched = Watched::one();
    watched.world.trains[0].wheels = 0.0;
    watched.go(FIRST, 9);
    watched.run(1.5);
    watched.world.trains[0].wheels = 1.0;
    watched.run(40.0);
    assert_eq!(watched.alarm(), None, "{:#?}", watched.notices);
}

#[test]
fn trains_that_could_meet_one_in_danger_are_stopped_and_resume_later() {
    let mut watched = Watched::two();
    watched.go(FIRST, 8);
    watched.go(SECOND, 8);
    watched.run(8.0);
    watched.dog.distrust(watched.world.now, FIRST);
    watched.run(0.5);
    assert!(watched.dog.is_held(FIRST));
    let refused = watched.dog.order(watched.world.now, Order::Speed { train: FIRST, step: step(5) });
    assert_eq!(refused, Err(Refusal::InDanger { train: FIRST }));
    // The other train comes near and is stopped before.
    watched.run(12.0);
    let moves = |watched: &Watched| watched.world.trains[1].speed_mm_per_s > 1.0;
    assert!(watched.dog.is_held(SECOND) && !moves(&watched), "{:#?}", watched.notices);
    // On so small a railway neither finds a path past the other: an operator resolves it.
    let asks = |watched: &Watched| {
        watched.notices.iter().any(|notice| matches!(notice, Notice::NeedsOperator { train: FIRST, .. }))
    };
    assert!(watched.run_until(200.0, |watched| asks(watched) || watched.recovered().is_some()));
    assert!(!watched.world.trains.iter().any(|train| train.is_off_the_track));
}

#[test]
fn power_is_switched_off_when_a_stop_is_not_sent() {
    let mut watched = Watched::one();
    watched.go(FIRST, 10);
    watched.run(5.0);
    watched.world.is_silent = true;
    watched.go(FIRST, 0);
    let asked = watched.world.now;
    assert!(watched.run_until(3.0, |watched| watched.power_off().is_some()));
    let off = watched.power_off().expect("it is off");
    assert!(off - asked <= TimeSpan::from_ms(1_010), "{:?}", off - asked);
    assert_eq!(watched.alarm(), Some(Alarm::StopUnconfirmed));
}

#[test]
fn power_returns_two_seconds_after_it_went_off() {
    let mut watched = Watched::one();
    watched.go(FIRST, 10);
    watched.run(5.0);
    watched.world.is_silent = true;
    watched.go(FIRST, 0);
    assert!(watched.run_until(3.0, |watched| watched.power_off().is_some()));
    watched.world.is_silent = false;
    let off = watched.power_off().expect("it is off");
    let on = |watched: &Watched| watched.commanded.iter().any(|(_, command)| *command == Command::PowerOn);
    assert!(watched.run_until(5.0, on), "{:#?}", watched.notices);
    let without = watched.world.now - off;
    assert!((without - TimeSpan::from_s(2.0)).abs() <= TimeSpan::from_ms(2), "{without:?}");
}

#[test]
fn power_is_switched_off_when_a_train_does_not_stop() {
    let mut watched = Watched::one();
    watched.go(FIRST, 10);
    watched.run(5.0);
    watched.go(FIRST, 0);
    watched.run(6.0);
    // It should be at rest, and the sensor ahead of it reports.
    let ahead = watched.dog.driver().sensor_ahead(FIRST, watched.world.now).expect("a sensor");
    watched.world.close(ahead);
    watched.run(0.2);
    assert_eq!(watched.alarm(), Some(Alarm::DoesNotStop(ahead)));
    assert!(watched.power_off().is_some());
}

#[test]
fn a_removed_train_needs_an_operator_and_is_trusted_once_placed() {
    let mut watched = Watched::one();
    watched.go(FIRST, 8);
    watched.run(4.0);
    watched.world.trains.clear();
    let asks = |watched: &Watched| {
        watched.notices.iter().any(|notice| matches!(notice, Notice::NeedsOperator { train: FIRST, .. }))
    };
    assert!(watched.run_until(150.0, asks), "{:#?}", watched.notices);
    let stop = StopOrder::at(FIRST, Landmark { node: NodeId(0), offset: Length::from_mm(100.0) });
    assert_eq!(
        watched.dog.order(watched.world.now, Order::Stop(stop)),
        Err(Refusal::InDanger { train: FIRST })
    );
    watched.put_first_down();
    watched.go(FIRST, 8);
    watched.run(10.0);
    assert!(!watched.dog.is_held(FIRST));
}

#[test]
fn a_single_lost_train_is_located_by_running_it() {
    let mut watched = Watched::one();
    watched.go(FIRST, 8);
    watched.run(4.0);
    watched.world.trains.clear();
    let asks = |watched: &Watched| {
        watched.notices.iter().any(|notice| matches!(notice, Notice::NeedsOperator { train: FIRST, .. }))
    };
    assert!(watched.run_until(150.0, asks), "{:#?}", watched.notices);
    // The train is moved by hand, and its position is not entered.
    watched.world.put(24, "B1", 50.0);
    watched.go(FIRST, 8);
    watched.run(12.0);
    assert!(!watched.dog.is_held(FIRST));
    let estimated = watched.dog.driver().position(FIRST, watched.world.now).expect("it is located");
    let truth = watched.world.train().at;
    assert_eq!(estimated.edge, truth.edge);
    let off = (estimated.offset - truth.offset).as_mm();
    assert!(off.abs() < 15.0, "{off} mm");
}

#[test]
fn orders_waiting_for_a_placed_train_are_reported_as_cancelled() {
    let mut watched = Watched::two();
    watched.go(FIRST, 8);
    watched.go(SECOND, 8);
    watched.run(4.0);
    watched.world.trains.retain(|train| train.id != FIRST);
    let asks = |watched: &Watched| {
        watched.notices.iter().any(|notice| matches!(notice, Notice::NeedsOperator { train: FIRST, .. }))
    };
    assert!(watched.run_until(250.0, asks), "{:#?}", watched.notices);
    assert!(watched.dog.is_held(SECOND), "{:#?}", watched.notices);
    let from = watched.notices.len();
    watched.put_first_down();
    watched.listen();
    assert!(!watched.dog.is_held(SECOND));
    assert!(
        watched.notices.iter().skip(from).any(|notice| matches!(
            notice,
            Notice::Cancelled { train: SECOND, order: Order::Speed { train: SECOND, .. }, .. }
        )),
        "{:#?}",
        watched.notices
    );
    watched.go(SECOND, 8);
}

/// One input of a watchdog.
#[derive(Debug, Clone)]
enum Happening {
    Ordered(Order),
    Reported(u16),
    Left,
    Waited(u32),
    Link(LinkNews),
    Placed(u16, f64),
    Distrusted(TrainId),
}

fn any_happening() -> impl Strategy<Value = Happening> {
    let train = || prop_oneof![3 => Just(FIRST), 2 => Just(SECOND), 1 => Just(TrainId(7))];
    let any_step = || (0_u8..14).prop_map(|number| SpeedStep::new(number).expect("a step"));
    let order = prop_oneof![
        4 => (train(), any_step()).prop_map(|(train, step)| Order::Speed { train, step }),
        1 => (train(), any_step()).prop_map(|(train, then)| Order::Reverse { train, then }),
        1 => (0_u16..4, any::<bool>())
            .prop_map(|(turnout, curved)| Order::Turnout { turnout: TurnoutId(turnout), curved }),
        2 => (train(), 0_u16..26, 0.0..900.0_f64).prop_map(|(train, node, mm)| {
            let target = Landmark { node: NodeId(node), offset: Length::from_mm(mm) };
            Order::Stop(StopOrder::at(train, target))
        }),
    ];
    prop_oneof![
        3 => order.prop_map(Happening::Ordered),
        4 => (0_u16..14).prop_map(Happening::Reported),
        6 => Just(Happening::Left),
        8 => prop_oneof![0_u32..300, 0_u32..9_000].prop_map(Happening::Waited),
        1 => prop_oneof![Just(LinkNews::Silent), Just(LinkNews::Answers)].prop_map(Happening::Link),
        1 => (0_u16..26, -100.0..2_000.0_f64).prop_map(|(node, mm)| Happening::Placed(node, mm)),
        1 => train().prop_map(Happening::Distrusted),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_train_in_danger_is_commanded_to_move_only_to_be_located(happenings in vec(any_happening(), 1..80)) {
        let mut watched = Watched::two();
        let dog = &mut watched.dog;
        let mut now = Timestamp::from_s(1.0);
        let mut waiting = Vec::new();
        // Trains in danger without clearance to creep.
        let mut must_stand: BTreeSet<TrainId> = BTreeSet::new();
        for happening in happenings {
            now += TimeSpan::from_ms(5);
            match happening {
                Happening::Ordered(order) => {
                    let _ = dog.order(now, order);
                }
                Happening::Reported(sensor) => {
                    let report = Report { sensor: SensorId(sensor), poll_interval: Some(TimeSpan::from_ms(65)) };
                    dog.handle_event(now, &Event { time: now, kind: EventKind::Sensor(report) });
                }
                Happening::Left if !waiting.is_empty() => {
                    let kind = match waiting.remove(0) {
                        Command::Speed { train, step } => EventKind::Speed { train, step },
                        Command::Reverse { train } => EventKind::Reverse { train },
                        Command::Turnout { turnout, curved } => EventKind::Turnout { turnout, curved },
                        Command::Function { .. } | Command::PowerOff | Command::PowerOn => continue,
                    };
                    dog.handle_event(now, &Event { time: now, kind });
                }
                Happening::Left => {}
                Happening::Waited(ms) => {
                    let end = now + TimeSpan::from_ms(ms.into());
                    for _ in 0..50 {
                        match dog.next_timeout().filter(|at| *at <= end) {
                            Some(at) => {
                                now = now.max(at);
                                dog.handle_timeout(now);
                            }
                            None => break,
                        }
                    }
                    now = now.max(end);
                    dog.handle_timeout(now);
                }
                Happening::Link(news) => dog.handle_link(now, news),
                Happening::Placed(node, mm) => {
                    let at = footplate_core::tracking::PathPoint { node: NodeId(node), distance: Length::from_mm(mm) };
                    dog.place(now, FIRST, at, Length::from_mm(5.0));
                    // The end of the last danger releases the other trains.
                    must_stand.retain(|train| dog.is_held(*train));
                }
                Happening::Distrusted(train) => dog.distrust(now, train),
            }
            while let Some(output) = dog.poll_output() {
                match output {
                    Output::Command(command) => {
                        if let Command::Speed { train, step } = command {
                            let may_be_commanded = step == SpeedStep::STAND || !must_stand.contains(&train);
                            prop_assert!(may_be_commanded, "{train} is in danger and commanded {step}");
                        }
                        waiting.push(command);
                    }
                    Output::Notice(Notice::Danger { train, stopped, why, .. }) => {
                        prop_assert!(!why.to_string().is_empty());
                        must_stand.insert(train);
                        must_stand.extend(stopped);
                    }
                    Output::Notice(Notice::Creeps { train, .. }) => {
                        must_stand.remove(&train);
                    }
                    Output::Notice(Notice::Recovered { .. } | Notice::Resumed { .. }) => {
                        must_stand.retain(|train| dog.is_held(*train));
                    }
                    _ => {}
                }
            }
        }
    }

    #[test]
    fn power_is_switched_off_within_a_second_of_an_unsent_stop(
        runs_for in 0.5..20.0_f64,
        throttle in 4_u8..13,
    ) {
        let mut watched = Watched::one();
        watched.go(FIRST, throttle);
        watched.run(runs_for);
        watched.world.is_silent = true;
        watched.dog.distrust(watched.world.now, FIRST);
        let asked = watched.world.now;
        prop_assert!(watched.run_until(2.0, |watched| watched.power_off().is_some()));
        prop_assert!(watched.power_off().is_some_and(|off| off - asked <= TimeSpan::from_ms(1_010)));
    }

    #[test]
    fn a_train_that_no_sensor_reports_is_commanded_to_stop(throttle in 5_u8..13, runs_for in 1.0..10.0_f64) {
        let mut watched = Watched::one();
        watched.go(FIRST, throttle);
        watched.run(runs_for);
        watched.world.dead = (0..12).map(SensorId).collect();
        let stops = |watched: &Watched| {
            watched.alarm().is_some()
                && watched.commanded.iter().any(|(_, command)| {
                    matches!(command, Command::Speed { train: FIRST, step: SpeedStep::STAND })
                })
        };
        prop_assert!(watched.run_until(30.0, stops), "{:#?}", watched.notices);
    }
}
