//! No part of a train is in a zone while the train is faster than the zone allows, whatever it was told to do; and it is as
//! fast as it was told to be everywhere else.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Driver, Gap, Machine, Notice, Order, Refusal, StopOrder};
use footplate_core::track::Zone;
use footplate_core::{Command, EdgeId, Length, Speed, SpeedStep, TimeSpan, TrainId};

use crate::toy_railway::{ToyRailway, add_train, driver_of_both_ways as driver_of, step};

const TRAIN: TrainId = TrainId(24);
/// A driver takes a train of which nothing else is said to reach so far ahead of and behind its pickup (mm).
const REACH: f64 = 250.0;
/// Once round with both turnouts straight (mm), and where the zone of these tests is on it: from B1 to the turnout.
const ROUND: f64 = 2_300.0;
const ZONE: [f64; 2] = [700.0, 1_200.0];
const LIMIT: f64 = 200.0;

/// A railway whose rails from B1 to turnout 2 are restricted to 200 mm/s.
fn restricted() -> ToyRailway {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let [from, to] = ["B1", "MR2"].map(|name| world.layout.node_named(name).expect("a node"));
    let edge = world.layout.edge_between(from, to).expect("an edge");
    let zone = Zone { name: "hall".into(), limit: Speed::from_mm_per_s(LIMIT) };
    world.layout = world.layout.with_zone(zone, [edge.stretch()]).expect("a zone");
    world
}

/// How far round from A1 the leading end of a pickup is (mm).
fn round_mm(world: &ToyRailway, train: usize) -> f64 {
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

/// Runs on, and says by how much (mm/s) each train was too fast in the zone at most, negative if never.
fn too_fast(world: &mut ToyRailway, driver: &mut Driver, seconds: f64) -> f64 {
    let mut worst = -LIMIT;
    let looks = (seconds / 0.02) as usize;
    for _ in 0..looks {
        world.run(driver, 0.02);
        for train in 0..world.trains.len() {
            if is_in_zone(round_mm(world, train)) {
                worst = worst.max(world.trains[train].speed_mm_per_s - LIMIT);
            }
        }
    }
    worst
}

fn restraints(world: &ToyRailway) -> usize {
    let is_one = |notice: &&Notice| matches!(notice, Notice::SpeedLimited { .. });
    world.notices.iter().filter(is_one).count()
}

#[test]
fn a_train_told_to_run_at_a_step_slows_down_for_a_zone_and_gets_as_fast_again_behind_it() {
    for commanded in [9, 11, 12] {
        let mut world = restricted();
        let mut driver = driver_of(&world, "D1", 300.0);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(commanded) }).expect("a step");
        let worst = too_fast(&mut world, &mut driver, 60.0);
        assert!(worst <= 0.0, "step {commanded}: {worst} mm/s too fast");
        // No slower than two steps of 32 mm/s below the limit.
        assert!(worst > -64.0, "step {commanded}: {worst} mm/s");
        assert!(restraints(&world) >= 2, "said on every round");
        // At the end of the way back to A1 it has long been as fast as it was told to be.
        let back = |world: &ToyRailway| (2_150.0..ROUND).contains(&round_mm(world, 0));
        assert!(world.run_until(&mut driver, 30.0, back));
        let full = 32.0 * f64::from(commanded);
        assert!((world.train().speed_mm_per_s - full).abs() < 1.0, "{} mm/s", world.train().speed_mm_per_s);
    }
}

#[test]
fn who_is_slow_enough_is_left_alone() {
    let mut world = restricted();
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(5) }).expect("a step");
    world.run(&mut driver, 40.0);
    let commanded: Vec<&Command> = world.commands.iter().map(|(_, command)| command).collect();
    assert_eq!(commanded, [&Command::Speed { train: TRAIN, step: step(5) }]);
    assert_eq!(restraints(&world), 0);
}

#[test]
fn a_train_that_stands_in_a_zone_starts_as_slowly_as_that_allows() {
    // The rear end is still in the zone.
    let mut world = restricted();
    world.put(24, "D1", 10.0);
    let mut driver = driver_of(&world, "D1", 10.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(14) }).expect("a step");
    let first = |world: &ToyRailway| world.commands.first().map(|(_, command)| *command);
    world.run(&mut driver, 0.5);
    let Some(Command::Speed { step: commanded, .. }) = first(&world) else { panic!("{:?}", world.commands) };
    assert!((5..=6).contains(&commanded.get()), "{commanded}");
    assert!(too_fast(&mut world, &mut driver, 3.0) <= 0.0);
    // Step 14 is not worth while on the way to where the zone begins again.
    let is_fast = |world: &ToyRailway| world.train().speed_mm_per_s > 380.0;
    assert!(world.run_until(&mut driver, 6.0, is_fast), "it has left: {}", world.train().speed_mm_per_s);
}

#[test]
fn stops_are_where_they_were_promised_before_within_and_behind_a_zone() {
    for place in ["A1+100mm", "B1-100mm", "B1+150mm", "B1+400mm", "D1+40mm", "D1+400mm", "D1+850mm"] {
        let mut world = restricted();
        let mut driver = driver_of(&world, "D1", 300.0);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(12) }).expect("a step");
        assert!(too_fast(&mut world, &mut driver, 20.0) <= 0.0);
        world.notices.clear();
        let target = driver.layout().landmark(place).expect("a place");
        let stop = StopOrder { next_round: true, ..StopOrder::at(TRAIN, target) };
        driver.order(world.now, Order::Stop(stop)).expect("a place");
        let mut worst = -LIMIT;
        for _ in 0..1_500 {
            worst = f64::max(worst, too_fast(&mut world, &mut driver, 0.02));
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
    assert!(too_fast(&mut world, &mut driver, 60.0) <= 0.0);
    let back = |world: &ToyRailway| (2_100.0..ROUND).contains(&round_mm(world, 0));
    assert!(world.run_until(&mut driver, 30.0, back));
    assert!((world.train().speed_mm_per_s - 350.0).abs() < 35.0, "{}", world.train().speed_mm_per_s);
}

#[test]
fn an_arrival_in_time_counts_the_zone_and_keeps_to_it() {
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
    // The metre in the zone takes five seconds at least; no more than four of its way of two metres are at full speed
    // without.
    assert!(soonest > before + 0.5 && soonest < before + 6.0, "{soonest} s instead of {before} s");
    for seconds in [1.03 * soonest, 1.5 * soonest] {
        world.put(24, "D1", 300.0);
        let mut driver = driver_of(&world, "D1", 300.0);
        let ordered = world.now;
        driver.order(ordered, arrive(&driver, seconds)).expect("a time that can be kept");
        assert!(too_fast(&mut world, &mut driver, 0.9 * seconds) <= 0.0);
        while world.train().speed_mm_per_s > 0.0 {
            assert!(too_fast(&mut world, &mut driver, 0.04) <= 0.0);
        }
        let (late, beyond) = ((world.now - ordered).as_s() - seconds, world.beyond_mm("D1+100mm"));
        assert!(late.abs() < 0.6 && beyond.abs() < 45.0, "{seconds} s: {late} s, {beyond} mm");
    }
}

#[test]
fn who_follows_keeps_to_the_zone_as_well() {
    let mut world = restricted();
    world.put(24, "D1", 100.0);
    world.put(58, "D1", 850.0);
    let mut driver = driver_of(&world, "D1", 100.0);
    add_train(&mut driver, &world, 58, Some(("D1", 850.0)));
    let leader = TrainId(58);
    driver.order(world.now, Order::Speed { train: leader, step: step(10) }).expect("a step");
    let gap = Gap::Time(TimeSpan::from_s(4.0));
    driver.order(world.now, Order::Follow { train: TRAIN, leader, gap }).expect("a gap");
    let worst = too_fast(&mut world, &mut driver, 60.0);
    assert!(worst <= 0.0, "{worst} mm/s too fast");
    assert!(world.trains.iter().all(|toy| toy.travelled_mm > 8_000.0), "both run");
}

#[test]
fn a_train_that_nobody_can_place_runs_no_faster_than_the_slowest_zone_allows() {
    let mut world = restricted();
    let mut driver = driver_of(&world, "D1", 300.0);
    let model = driver.model(TRAIN).expect("known").clone();
    driver.add_train(model);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(13) }).expect("a step");
    // The next contact tells where it is, and then it may be faster.
    let is_found =
        |world: &ToyRailway| world.notices.iter().any(|notice| matches!(notice, Notice::Passed { .. }));
    while !is_found(&world) {
        world.run(&mut driver, 0.1);
        assert!(world.train().speed_mm_per_s <= LIMIT);
    }
    assert!(too_fast(&mut world, &mut driver, 30.0) <= 0.0);
    let is_fast = |world: &ToyRailway| world.train().speed_mm_per_s > 400.0;
    assert!(world.run_until(&mut driver, 20.0, is_fast));
}

#[test]
fn a_contact_that_is_silent_lets_nobody_into_a_zone_too_fast() {
    let mut world = restricted();
    let mut driver = driver_of(&world, "D1", 300.0);
    world.dead = world.layout.sensor_named("A1").into_iter().collect();
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(12) }).expect("a step");
    assert!(too_fast(&mut world, &mut driver, 8.0) <= 0.0);
}

#[test]
fn a_limit_below_the_slowest_step_is_run_at_that() {
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
fn nobody_is_woken_again_and_again_whether_or_not_there_are_zones() {
    for mut world in [restricted(), ToyRailway::new(24, "D1", 300.0)] {
        let mut driver = driver_of(&world, "D1", 300.0);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(12) }).expect("a step");
        for _ in 0..1_500 {
            world.run(&mut driver, 0.02);
            // Whatever was due has been done: the next time lies ahead.
            driver.handle_timeout(world.now);
            world.listen(&mut driver);
            assert!(driver.next_timeout().is_none_or(|at| at > world.now), "{:?}", driver.next_timeout());
        }
    }
}
