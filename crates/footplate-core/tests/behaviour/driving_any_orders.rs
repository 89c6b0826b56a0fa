//! Whatever is ordered and reported, a driver neither panics nor plans a stop beyond its target.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use std::sync::OnceLock;

use footplate_core::control::{Aim, Driver, Machine, Notice, Order, Output, Refusal, StopOrder};
use footplate_core::model::MotionModel;
use footplate_core::track::Landmark;
use footplate_core::tracking::PathPoint;
use footplate_core::{
    Command, Event, EventKind, Length, NodeId, Ratio, Report, SensorId, Speed, SpeedStep, TimeSpan,
    Timestamp, TrainId, TurnoutId,
};
use proptest::collection::vec;
use proptest::prelude::{Just, ProptestConfig, Strategy, any, prop_assert, prop_oneof, proptest};

use crate::toy_railway::{ToyRailway, driver_of, known_model, layout, step, straight};

/// One input of a driver.
#[derive(Debug, Clone)]
enum Happening {
    Ordered(Order),
    Reported(u16, Option<u32>),
    /// A commanded command is sent.
    Left,
    Stranger(EventKind),
    Waited(u32),
    Placed(u16, f64),
}

fn any_step() -> impl Strategy<Value = SpeedStep> {
    (0_u8..20).prop_map(|number| SpeedStep::new(number).expect("a step"))
}

fn any_train() -> impl Strategy<Value = TrainId> {
    prop_oneof![4 => Just(TrainId(24)), 2 => Just(TrainId(58)), 1 => Just(TrainId(7))]
}

fn any_mm() -> impl Strategy<Value = Length> {
    prop_oneof![8 => -500.0..3_000.0_f64, 1 => any::<f64>()].prop_map(Length::from_mm)
}

fn any_speed() -> impl Strategy<Value = Speed> {
    prop_oneof![8 => 0.0..700.0_f64, 1 => any::<f64>()].prop_map(Speed::from_mm_per_s)
}

fn any_order() -> impl Strategy<Value = Order> {
    let aim = prop_oneof![
        Just(Aim::Median),
        any::<f64>().prop_map(|share| Aim::NotBeyond(Ratio::from_parts(share))),
        (0.0..0.6_f64).prop_map(|share| Aim::NotBeyond(Ratio::from_parts(share))),
    ];
    let stop = (any_train(), 0_u16..26, any_mm(), aim, proptest::option::of(any_step()), any::<bool>());
    prop_oneof![
        (any_train(), any_step()).prop_map(|(train, step)| Order::Speed { train, step }),
        (any_train(), any_step()).prop_map(|(train, then)| Order::Reverse { train, then }),
        (0_u16..4, any::<bool>())
            .prop_map(|(turnout, curved)| Order::Turnout { turnout: TurnoutId(turnout), curved }),
        stop.prop_map(|(train, node, offset, aim, step, next_round)| {
            let target = Landmark { node: NodeId(node), offset };
            Order::Stop(StopOrder { train, target, aim, step, next_round })
        }),
        (any_train(), any_mm()).prop_map(|(train, distance)| Order::Move { train, distance }),
        (any_train(), any_speed()).prop_map(|(train, speed)| Order::Hold { train, speed }),
    ]
}

fn any_happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        4 => any_order().prop_map(Happening::Ordered),
        4 => (0_u16..14, proptest::option::of(0_u32..200)).prop_map(|(s, i)| Happening::Reported(s, i)),
        6 => Just(Happening::Left),
        1 => (any_train(), any_step()).prop_map(|(train, step)| Happening::Stranger(EventKind::Speed { train, step })),
        1 => any_train().prop_map(|train| Happening::Stranger(EventKind::Reverse { train })),
        1 => (0_u16..4, any::<bool>()).prop_map(|(turnout, curved)| {
            Happening::Stranger(EventKind::Turnout { turnout: TurnoutId(turnout), curved })
        }),
        6 => prop_oneof![0_u32..300, 0_u32..20_000].prop_map(Happening::Waited),
        1 => (0_u16..26, -100.0..2_000.0_f64).prop_map(|(node, mm)| Happening::Placed(node, mm)),
    ]
}

fn model(train: u16) -> MotionModel {
    static MODEL: OnceLock<MotionModel> = OnceLock::new();
    if train == 24 {
        MODEL.get_or_init(|| known_model(24)).clone()
    } else {
        MotionModel::unknown(TrainId(train), step(14))
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_sequence_of_orders_and_events_makes_it_panic(happenings in vec(any_happening(), 1..60)) {
        let mut driver = Driver::new(layout(), straight());
        driver.add_train(model(24));
        driver.add_train(model(58));
        let mut now = Timestamp::from_s(1.0);
        let mut waiting = Vec::new();
        for happening in happenings {
            now += TimeSpan::from_ms(5);
            match happening {
                Happening::Ordered(order) => {
                    let first = driver.clone().order(now, order);
                    let again = driver.order(now, order);
                    // A rejected order is rejected again for the same reason.
                    prop_assert!(matches!((&first, &again), (Ok(_), Ok(_)) | (Err(_), Err(_))));
                    if let Err(why) = &again {
                        prop_assert!(!why.to_string().is_empty());
                        prop_assert!(driver.order(now, order).is_err());
                    }
                }
                Happening::Reported(sensor, interval) => {
                    let poll_interval = interval.map(|ms| TimeSpan::from_ms(ms.into()));
                    let report = Report { sensor: SensorId(sensor), poll_interval };
                    driver.handle_event(now, &Event { time: now, kind: EventKind::Sensor(report) });
                }
                Happening::Left if !waiting.is_empty() => {
                    let kind = match waiting.remove(0) {
                        Command::Speed { train, step } => EventKind::Speed { train, step },
                        Command::Reverse { train } => EventKind::Reverse { train },
                        Command::Turnout { turnout, curved } => EventKind::Turnout { turnout, curved },
                        Command::Function { .. } | Command::PowerOff | Command::PowerOn => continue,
                    };
                    driver.handle_event(now, &Event { time: now, kind });
                }
                Happening::Left => {}
                Happening::Stranger(kind) => driver.handle_event(now, &Event { time: now, kind }),
                Happening::Waited(ms) => {
                    let end = now + TimeSpan::from_ms(ms.into());
                    for _ in 0..50 {
                        match driver.next_timeout().filter(|at| *at <= end) {
                            Some(at) => {
                                now = now.max(at);
                                driver.handle_timeout(now);
                            }
                            None => break,
                        }
                        // Otherwise a loop that wakes it when it asks would never wait.
                        prop_assert!(driver.next_timeout().is_none_or(|at| at > now));
                        while let Some(output) = driver.poll_output() {
                            if let Output::Command(command) = output { waiting.push(command) }
                        }
                    }
                    now = now.max(end);
                    driver.handle_timeout(now);
                }
                Happening::Placed(node, mm) => {
                    let at = PathPoint { node: NodeId(node), distance: Length::from_mm(mm) };
                    driver.place(now, TrainId(24), at, Length::from_mm(5.0));
                }
            }
            while let Some(output) = driver.poll_output() {
                match output {
                    Output::Command(command) => waiting.push(command),
                    // The predicted median of a stop never lies beyond its target.
                    Output::Notice(Notice::Planned(plan)) => {
                        prop_assert!(plan.promise.median <= Length::from_mm(1.0), "{plan:?}");
                    }
                    _ => {}
                }
            }
        }
    }

    #[test]
    fn a_stop_is_commanded_whatever_detections_are_missed(
        silent in vec(0_u16..8, 0..8),
        from_mm in 250.0..850.0_f64,
        target in 0.0..2_200.0_f64,
        throttle in 4_u8..13,
    ) {
        let mut world = ToyRailway::new(24, "D1", from_mm);
        let mut driver = driver_of(&world, "D1", from_mm);
        world.dead = silent.into_iter().map(SensorId).collect();
        let place = world.layout.landmark(&format!("D1{target:+}mm")).expect("a place");
        let stop = StopOrder { step: Some(step(throttle)), ..StopOrder::at(TrainId(24), place) };
        match driver.order(world.now, Order::Stop(stop)) {
            Err(Refusal::TooNear { .. }) => {}
            refused @ Err(_) => prop_assert!(false, "{refused:?}"),
            Ok(order) => {
                let ended = |world: &ToyRailway| world.notices.iter().any(|notice| match notice {
                    Notice::Done(finished) => finished.order == order,
                    Notice::GivenUp { order: given_up, .. } => *given_up == order,
                    _ => false,
                });
                prop_assert!(world.run_until(&mut driver, 90.0, ended), "{:#?}", world.notices);
                world.run(&mut driver, 8.0);
                prop_assert!(world.train().speed_mm_per_s == 0.0, "it still runs");
            }
        }
    }
}
