//! A train holds any speed between its slowest and fastest step, as precisely as the sensors allow, with few
//! commands.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Driver, Machine as _, Notice, Order, PacedLine, Refusal};
use footplate_core::{Command, Speed, TimeSpan, Timestamp, TrainId};
use proptest::prelude::{ProptestConfig, prop_assert, proptest};

use crate::toy_railway::{ToyRailway, driver_for_both_approaches as driver_of, step};

const TRAIN: TrainId = TrainId(24);

fn hold(mm_per_s: f64) -> Order {
    Order::Hold { train: TRAIN, speed: Speed::from_mm_per_s(mm_per_s) }
}

fn line(world: &ToyRailway) -> Option<PacedLine> {
    world.notices.iter().find_map(|notice| match notice {
        Notice::Paced(line) => Some(*line),
        _ => None,
    })
}

/// Runs until a line has started.
fn begin(world: &mut ToyRailway, driver: &mut Driver) -> PacedLine {
    assert!(world.run_until(driver, 30.0, |world| line(world).is_some()), "{:#?}", world.notices);
    line(world).expect("a line")
}

/// When steps were commanded.
fn commanded(world: &ToyRailway) -> Vec<Timestamp> {
    let steps = world.commands.iter().filter(|(_, command)| matches!(command, Command::Speed { .. }));
    steps.map(|(at, _)| *at).collect()
}

#[test]
fn a_speed_between_two_steps_is_held_for_as_long_as_asked() {
    // Steps of the toy train are 32 mm/s apart; 240 is between two steps, 256 is a step. Sensors are up to 900 mm
    // apart: a speed known to one per cent gives an error of 9 mm at the next.
    for mm_per_s in [200.0, 240.0, 256.0, 270.0, 390.0] {
        let mut world = ToyRailway::new(24, "D1", 300.0);
        let mut driver = driver_of(&world, "D1", 300.0);
        driver.order(world.now, hold(mm_per_s)).expect("a speed between its steps");
        let line = begin(&mut world, &mut driver);
        let name = world.layout.node_name(line.node).to_owned();
        let zero = world.train().travelled_mm - world.beyond_mm(&name);
        let mut worst = 0.0_f64;
        let (from_mm, from) = (world.train().travelled_mm, world.now);
        for _ in 0..300 {
            world.run(&mut driver, 0.1);
            let ideal = line.way.as_mm() + mm_per_s * (world.now - line.time).as_s();
            worst = worst.max((world.train().travelled_mm - zero - ideal).abs());
        }
        let mean = (world.train().travelled_mm - from_mm) / (world.now - from).as_s();
        assert!(worst < 35.0, "{mm_per_s}: {worst} mm off");
        assert!((mean / mm_per_s - 1.0).abs() < 0.005, "{mm_per_s}: {mean}");
        assert!(driver.busy(TRAIN).is_some());
    }
}

#[test]
fn a_speed_outside_the_steps_is_rejected_with_the_possible_range() {
    let world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    for mm_per_s in [0.0, -100.0, 20.0, 900.0, f64::NAN, f64::INFINITY] {
        let refused = driver.order(world.now, hold(mm_per_s)).expect_err("no such speed");
        let Refusal::SpeedOutOfRange { lowest, highest, .. } = refused else { panic!("{refused}") };
        assert!(lowest < highest, "{refused}");
        driver.clone().order(world.now, hold(0.5 * (lowest + highest).as_mm_per_s())).expect("in between");
    }
}

#[test]
fn a_lost_train_that_is_to_hold_a_speed_asks_for_no_time_that_has_passed() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.lose(world.now, TRAIN);
    driver.order(world.now, hold(240.0)).expect("a speed");
    world.run(&mut driver, 0.2);
    driver.handle_timeout(world.now);
    assert!(driver.next_timeout().is_none_or(|at| at > world.now), "{:?}", driver.next_timeout());
    // It is paced once two sensors have shown where it is.
    begin(&mut world, &mut driver);
}

#[test]
fn another_order_ends_pacing() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, hold(240.0)).expect("a speed");
    begin(&mut world, &mut driver);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(0) }).expect("a step");
    world.run(&mut driver, 10.0);
    assert!(world.train().speed_mm_per_s == 0.0 && driver.busy(TRAIN).is_none());
    let count = commanded(&world).len();
    world.run(&mut driver, 20.0);
    assert_eq!(commanded(&world).len(), count, "nothing is commanded to a train that should be at rest");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_command_budget_is_kept_at_any_speed(
        speeds in proptest::collection::vec(60.0..440.0_f64, 1..4),
        from_mm in 250.0..850.0_f64,
        dead in proptest::option::of(0_u16..8),
    ) {
        let mut world = ToyRailway::new(24, "D1", from_mm);
        let mut driver = driver_of(&world, "D1", from_mm);
        world.dead = dead.into_iter().map(footplate_core::SensorId).collect();
        for mm_per_s in speeds {
            if driver.order(world.now, hold(mm_per_s)).is_err() {
                continue;
            }
            let since = world.commands.len();
            world.run(&mut driver, 25.0);
            // The order's own command is immediate, and one of the earlier order may still have been waiting.
            let commanded: Vec<Timestamp> = commanded(&world).into_iter().skip(since + 1).collect();
            for pair in commanded.windows(2) {
                prop_assert!(pair[1] - pair[0] >= TimeSpan::from_ms(195), "{pair:?}");
            }
            for four in commanded.windows(4) {
                prop_assert!(four[3] - four[0] >= TimeSpan::from_ms(1_990), "{four:?}");
            }
        }
    }
}
