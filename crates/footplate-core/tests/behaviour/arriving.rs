//! A train arrives at its target on time, or the order is rejected at once with the possible times.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Driver, Notice, Order, Refusal};
use footplate_core::{TimeSpan, TrainId};

use crate::toy_railway::{ToyRailway, driver_for_both_approaches as driver_of, step};

const TRAIN: TrainId = TrainId(24);

fn arrive(driver: &Driver, place: &str, seconds: f64) -> Order {
    let target = driver.layout().landmark(place).expect("a place");
    Order::Arrive { train: TRAIN, target, within: TimeSpan::from_s(seconds) }
}

/// How late (s) a train arrives after an order now, and how far beyond the place (mm).
fn arrival_errors(world: &mut ToyRailway, driver: &mut Driver, place: &str, seconds: f64) -> [f64; 2] {
    let ordered = world.now;
    driver.order(ordered, arrive(driver, place, seconds)).expect("a time that can be kept");
    world.run(driver, 0.8 * seconds);
    while world.train().speed_mm_per_s > 0.0 {
        world.run(driver, 0.05);
    }
    [(world.now - ordered).as_s() - seconds, world.beyond_mm(place)]
}

#[test]
fn a_train_arrives_on_time_from_rest_and_while_moving() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    for (place, seconds) in [("B1+120mm", 14.0), ("D1+300mm", 20.0), ("A1+100mm", 40.0)] {
        let [late, beyond] = arrival_errors(&mut world, &mut driver, place, seconds);
        // Stops of the toy train spread by some millimetres, and a sensor is polled every 70 ms.
        assert!(late.abs() < 0.5 && beyond.abs() < 40.0, "{place}: {late} s, {beyond} mm");
        world.run(&mut driver, 3.0);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(8) }).expect("a step");
        world.run(&mut driver, 6.0);
        let [late, beyond] = arrival_errors(&mut world, &mut driver, "B1+200mm", 25.0);
        assert!(late.abs() < 0.5 && beyond.abs() < 40.0, "on the run: {late} s, {beyond} mm");
        world.run(&mut driver, 3.0);
    }
}

#[test]
fn too_short_a_time_is_rejected_with_the_shortest_possible() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    let refused = driver.order(world.now, arrive(&driver, "B1+120mm", 1.0)).expect_err("about a metre");
    let Refusal::TooSoon { earliest, .. } = refused else { panic!("{refused}") };
    assert!(driver.busy(TRAIN).is_none() && world.commands.is_empty(), "nothing has changed");
    let seconds = 1.02 * earliest.as_s();
    let [late, beyond] = arrival_errors(&mut world, &mut driver, "B1+120mm", seconds);
    assert!(late.abs() < 0.6 && beyond.abs() < 60.0, "{late} s, {beyond} mm");
}

#[test]
fn a_train_at_rest_with_time_to_spare_waits_before_it_starts() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, arrive(&driver, "B1+120mm", 120.0)).expect("all the time in the world");
    let planned = world.now;
    world.run(&mut driver, 60.0);
    assert_eq!(world.train().travelled_mm, 0.0, "it waits");
    let starts = world.notices.iter().find_map(|notice| match notice {
        Notice::Arrives(plan) => plan.starts,
        _ => None,
    });
    let (starts, _) = starts.expect("a start");
    assert!((starts - planned).as_s() > 90.0, "{starts:?}");
    world.run(&mut driver, 70.0);
    assert!(world.beyond_mm("B1+120mm").abs() < 40.0);
}
