//! No part of a train is in a zone while the train exceeds its limit, whatever was ordered; elsewhere the train runs
//! as ordered.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Driver, Gap, Machine, Notice, Order, Refusal, StopOrder};
use footplate_core::track::Zone;
use footplate_core::{Command, EdgeId, Length, Speed, SpeedStep, TimeSpan, TrainId};

use crate::toy_railway::{ToyRailway, add_train, driver_for_both_approaches as driver_of, step};

const TRAIN: TrainId = TrainId(24);
/// Default lengths of a train ahead of and behind its pickup (mm).
const REACH: f64 = 250.0;
/// The lap with both turnouts straight (mm), and the zone of these tests on it: from B1 to the turnout.
const LAP_MM: f64 = 2_300.0;
const ZONE: [f64; 2] = [700.0, 1_200.0];
const LIMIT: f64 = 200.0;

/// A railway with a limit of 200 mm/s from B1 to turnout 2.
fn restricted() -> ToyRailway {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let [from, to] = ["B1", "MR2"].map(|name| world.layout.node_named(name).expect("a node"));
    let edge = world.layout.edge_between(from, to).expect("an edge");
    let zone = Zone { name: "hall".into(), limit: Speed::from_mm_per_s(LIMIT) };
    world.layout = world.layout.with_zone(zone, [edge.stretch()]).expect("a zone");
    world
}

/// The position of a pickup's leading end on the lap from A1 (mm).
fn lap_mm(world: &ToyRailway, train: usize) -> f64 {
    let toy = &world.trains[train];
    let edges = [("A1", "BR1"), ("BR1", "B1"), ("B1", "MR2"), ("MR2", "D1"), ("D1", "A1")];
    let edges = edges.map(|names| {
        let [from, to] = <[&str; 2]>::from(names).map(|name| world.layout.node_named(name).expect("a node"));
        world.layout.edge_between(from, to).expect("an edge")
    });
    let at = edges.iter().position(|edge| *edge == toy.at.edge).expect("with all turnouts straight");
    let length = |edge: &EdgeId| world.layout.edge(*edge).expect("an edge").length.as_mm();
    edges[..at].iter().map(length).sum::<f64>() + toy.at.offset.as_mm()
}

fn is_in_zone(at: f64) -> bool {
    at + REACH > ZONE[0] && at - REACH < ZONE[1]
}

/// Runs on and returns each train's largest excess over the limit in the zone (mm/s), negative if it stayed below.
fn largest_excess(world: &mut ToyRailway, driver: &mut Driver, seconds: f64) -> f64 {
    let mut worst = -LIMIT;
    let looks = (seconds / 0.02) as usize;
    for _ in 0..looks {
        world.run(driver, 0.02);
        for train in 0..world.trains.len() {
            if is_in_zone(lap_mm(world, train)) {
                worst = worst.max(world.trains[train].speed_mm_per_s - LIMIT);
            }
        }
    }
    worst
}

fn limitations(world: &ToyRailway) -> usize {
    let is_one = |notice: &&Notice| matches!(notice, Notice::SpeedLimited { .. });
    world.notices.iter().filter(is_one).count()
}

#[test]
fn a_train_slows_down_for_a_zone_and_resumes_its_step_behind_it() {
    for commanded in [9, 11, 12] {
        let mut world = restricted();
        let mut driver = driver_of(&world, "D1", 300.0);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(commanded) }).expect("a step");
        let worst = largest_excess(&mut world, &mut driver, 60.0);
        assert!(worst <= 0.0, "step {commanded}: {worst} mm/s too fast");
        // At most two steps of 32 mm/s below the limit.
        assert!(worst > -64.0, "step {commanded}: {worst} mm/s");
        assert!(limitations(&world) >= 2, "reported on every lap");
        // At the end of the lap, it has run at its ordered step for long.
        let back = |world: &ToyRailway| (2_150.0..LAP_MM).contains(&lap_mm(world, 0));
        assert!(world.run_until(&mut driver, 30.0, back));
        let full = 32.0 * f64::from(commanded);
        assert!((world.train().speed_mm_per_s - full).abs() < 1.0, "{} mm/s", world.train().speed_mm_per_s);
    }
}

#[test]
fn a_train_below_the_limit_is_not_slowed() {
    let mut world = restricted();
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(5) }).expect("a step");
    world.run(&mut driver, 40.0);
    let commanded: Vec<&Command> = world.commands.iter().map(|(_, command)| command).collect();
    assert_eq!(commanded, [&Command::Speed { train: TRAIN, step: step(5) }]);
    assert_eq!(limitations(&world), 0);
}

#[test]
fn a_train_at_rest_in_a_zone_starts_below_its_limit() {
    // The rear is still in the zone.
    let mut world = restricted();
    world.put(24, "D1", 10.0);
    let mut driver = driver_of(&world, "D1", 10.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(14) }).expect("a step");
    let first = |world: &ToyRailway| world.commands.first().map(|(_, command)| *command);
    world.run(&mut driver, 0.5);
    let Some(Command::Speed { step: commanded, .. }) = first(&world) else { panic!("{:?}", world.commands) };
    assert!((5..=6).contains(&commanded.get()), "{commanded}");
    assert!(largest_excess(&mut world, &mut driver, 3.0) <= 0.0);
    // Step 14 does not pay before the zone begins again.
    let is_fast = |world: &ToyRailway| world.train().speed_mm_per_s > 380.0;
    assert!(world.run_until(&mut driver, 6.0, is_fast), "it has left: {}", world.train().speed_mm_per_s);
}

#[test]
fn stops_before_within_and_behind_a_zone_end_as_promised() {
    for place in ["A1+100mm", "B1-100mm", "B1+150mm", "B1+400mm", "D1+40mm", "D1+400mm", "D1+850mm"] {
        let mut world = restricted();
        let mut driver = driver_of(&world, "D1", 300.0);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(12) }).expect("a step");
        assert!(largest_excess(&mut world, &mut driver, 20.0) <= 0.0);
        world.notices.clear();
        let target = driver.layout().landmark(place).expect("a place");
        let stop = StopOrder { next_round: true, ..StopOrder::at(TRAIN, target) };
        driver.order(world.now, Order::Stop(stop)).expect("a place");
        let mut worst = -LIMIT;
        for _ in 0..1_500 {
            worst = f64::max(worst, largest_excess(&mut world, &mut driver, 0.02));
            if !world.finished().is_empty() {
                break;
            }
        }
        assert!(worst <= 0.0, "{place}: {worst} mm/s too fast");
        let finished = world.finished();
        let promise = finished.first().and_then(|finished| finished.promise).expect("a promise");
        let beyond = world.beyond_mm(place);
        let [low, high] = [promise.low, promise.high].map(Length::as_mm);
        assert!(
            (low..=high).contains(&beyond) && beyond.abs() < 45.0,
            "{place}: {beyond} of {low} to {high}"
        );
    }
}

#[test]
fn a_held_speed_is_held_again_behind_a_zone() {
    let mut world = restricted();
    let mut driver = driver_of(&world, "D1", 300.0);
    let hold = Order::Hold { train: TRAIN, speed: Speed::from_mm_per_s(350.0) };
    driver.order(world.now, hold).expect("a speed");
    assert!(largest_excess(&mut world, &mut driver, 60.0) <= 0.0);
    let back = |world: &ToyRailway| (2_100.0..LAP_MM).contains(&lap_mm(world, 0));
    assert!(world.run_until(&mut driver, 30.0, back));
    assert!((world.train().speed_mm_per_s - 350.0).abs() < 35.0, "{}", world.train().speed_mm_per_s);
}

#[test]
fn an_arrival_allows_for_the_zone_and_keeps_its_limit() {
    let mut world = restricted();
    let mut driver = driver_of(&world, "D1", 300.0);
    let arrive = |driver: &Driver, seconds: f64| {
        let target = driver.layout().landmark("D1+100mm").expect("a place");
        Order::Arrive { train: TRAIN, target, within: TimeSpan::from_s(seconds) }
    };
    let free = ToyRailway::new(24, "D1", 300.0);
    let mut unrestricted = driver_of(&free, "D1", 300.0);
    let earliest = |driver: &mut Driver| {
        let refused = driver.order(world.now, arrive(driver, 2.0)).expect_err("two metres");
        let Refusal::TooSoon { earliest, .. } = refused else { panic!("{refused}") };
        earliest.as_s()
    };
    let [soonest, before] = [earliest(&mut driver), earliest(&mut unrestricted)];
    // The metre in the zone takes five seconds at least; without the limit, no more than four of its two metres run
    // at full speed.
    assert!(soonest > before + 0.5 && soonest < before + 6.0, "{soonest} s instead of {before} s");
    for seconds in [1.03 * soonest, 1.5 * soonest] {
        world.put(24, "D1", 300.0);
        let mut driver = driver_of(&world, "D1", 300.0);
        let ordered = world.now;
        driver.order(ordered, arrive(&driver, seconds)).expect("a time that can be kept");
        assert!(largest_excess(&mut world, &mut driver, 0.9 * seconds) <= 0.0);
        while world.train().speed_mm_per_s > 0.0 {
            assert!(largest_excess(&mut world, &mut driver, 0.04) <= 0.0);
        }
        let (late, beyond) = ((world.now - ordered).as_s() - seconds, world.beyond_mm("D1+100mm"));
        assert!(late.abs() < 0.6 && beyond.abs() < 45.0, "{seconds} s: {late} s, {beyond} mm");
    }
}

#[test]
fn a_follower_keeps_the_zone_limit() {
    let mut world = restricted();
    world.put(24, "D1", 100.0);
    world.put(58, "D1", 850.0);
    let mut driver = driver_of(&world, "D1", 100.0);
    add_train(&mut driver, &world, 58, Some(("D1", 850.0)));
    let leader = TrainId(58);
    driver.order(world.now, Order::Speed { train: leader, step: step(10) }).expect("a step");
    let gap = Gap::Time(TimeSpan::from_s(4.0));
    driver.order(world.now, Order::Follow { train: TRAIN, leader, gap }).expect("a gap");
    let worst = largest_excess(&mut world, &mut driver, 60.0);
    assert!(worst <= 0.0, "{worst} mm/s too fast");
    assert!(world.trains.iter().all(|toy| toy.travelled_mm > 8_000.0), "both run");
}

#[test]
fn a_lost_train_keeps_the_limit_of_the_slowest_zone() {
    let mut world = restricted();
    let mut driver = driver_of(&world, "D1", 300.0);
    let model = driver.model(TRAIN).expect("known").clone();
    driver.add_train(model);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(13) }).expect("a step");
    // The next sensor locates it, and then it may run faster.
    let is_found =
        |world: &ToyRailway| world.notices.iter().any(|notice| matches!(notice, Notice::Passed { .. }));
    while !is_found(&world) {
        world.run(&mut driver, 0.1);
        assert!(world.train().speed_mm_per_s <= LIMIT);
    }
    assert!(largest_excess(&mut world, &mut driver, 30.0) <= 0.0);
    let is_fast = |world: &ToyRailway| world.train().speed_mm_per_s > 400.0;
    assert!(world.run_until(&mut driver, 20.0, is_fast));
}

#[test]
fn a_missed_detection_lets_no_train_into_a_zone_too_fast() {
    let mut world = restricted();
    let mut driver = driver_of(&world, "D1", 300.0);
    world.dead = world.layout.sensor_named("A1").into_iter().collect();
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(12) }).expect("a step");
    assert!(largest_excess(&mut world, &mut driver, 8.0) <= 0.0);
}

#[test]
fn a_limit_below_the_slowest_step_gives_the_slowest_step() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let edges: Vec<_> = world.layout.edges().map(|(edge, _)| edge.stretch()).collect();
    let zone = Zone { name: "everywhere".into(), limit: Speed::from_mm_per_s(10.0) };
    world.layout = world.layout.with_zone(zone, edges).expect("a zone");
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(12) }).expect("a step");
    world.run(&mut driver, 5.0);
    let slowest = (1..=14).filter_map(SpeedStep::new).find(|step| {
        driver.model(TRAIN).expect("known").uses(*step) == footplate_core::model::StepUse::Moves
    });
    assert_eq!(Some(driver.commanded(TRAIN)), slowest);
}

#[test]
fn timeouts_always_advance_with_and_without_zones() {
    for mut world in [restricted(), ToyRailway::new(24, "D1", 300.0)] {
        let mut driver = driver_of(&world, "D1", 300.0);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(12) }).expect("a step");
        for _ in 0..1_500 {
            world.run(&mut driver, 0.02);
            // Everything due has been done: the next time is in the future.
            driver.handle_timeout(world.now);
            world.listen(&mut driver);
            assert!(driver.next_timeout().is_none_or(|at| at > world.now), "{:?}", driver.next_timeout());
        }
    }
}
