//! Each detection is assigned to the train that caused it, despite missed detections and failed turnouts, and to none
//! if it is spurious; ambiguous detections change no estimate, and a lost train is reported.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Driver, Notice, Order, StopOrder};
use footplate_core::tracking::PathPoint;
use footplate_core::{Length, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use proptest::prelude::{ProptestConfig, prop_assert, proptest};

use crate::toy_railway::{ToyRailway, add_train, driver_of, step};

const FIRST: TrainId = TrainId(24);
const SECOND: TrainId = TrainId(58);
/// How long trains run in tests of random orders (s).
const RUNS_FOR: f64 = 26.0;

fn run(driver: &mut Driver, world: &ToyRailway, train: TrainId, step: SpeedStep) {
    driver.order(world.now, Order::Speed { train, step }).expect("a train and a step");
}

/// Two trains on the oval, train 24 behind train 58.
fn two_trains() -> (ToyRailway, Driver) {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    world.put(58, "B1", 100.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    add_train(&mut driver, &world, 58, Some(("B1", 100.0)));
    (world, driver)
}

/// Detections assigned to a train that caused them, and to one that did not.
fn assigned(world: &ToyRailway) -> [usize; 2] {
    let mut counted = [0; 2];
    for notice in &world.notices {
        let Notice::Passed { train, passed, .. } = notice else { continue };
        let slack = TimeSpan::from_ms(2);
        let (from, until) = (passed.window.after - slack, passed.window.until + slack);
        let really = world.passes.iter().any(|(at, sensor, passer)| {
            sensor == &passed.sensor && passer == train && (from..=until).contains(at)
        });
        counted[usize::from(!really)] += 1;
    }
    counted
}

fn error_mm(world: &ToyRailway, driver: &Driver, train: TrainId) -> f64 {
    let Some(located) = driver.locate(train, world.now) else { return f64::INFINITY };
    let at = driver.landmark(train, located.at).expect("a place");
    let estimated_place = world.layout.locate(at, &world.turnouts).expect("a place");
    let true_place = world.trains.iter().find(|toy| toy.id == train).expect("a train").at;
    let distance = |from, to| {
        world.layout.distance_ahead(from, to, &world.turnouts).map_or(f64::INFINITY, Length::as_mm)
    };
    distance(estimated_place, true_place).min(distance(true_place, estimated_place))
}

#[test]
fn two_trains_in_a_row_are_distinguished() {
    let (mut world, mut driver) = two_trains();
    run(&mut driver, &world, FIRST, step(9));
    run(&mut driver, &world, SECOND, step(8));
    world.run(&mut driver, 30.0);
    let [right, wrong] = assigned(&world);
    assert!(wrong == 0 && right >= 20, "{right} right, {wrong} wrong");
    for train in [FIRST, SECOND] {
        assert!(error_mm(&world, &driver, train) < 25.0, "{train}: {} mm", error_mm(&world, &driver, train));
    }
}

#[test]
fn a_missed_detection_and_a_failed_turnout_together_are_recognised() {
    let (mut world, mut driver) = two_trains();
    // Given a turnout that does not move when commanded, and a silent sensor before it,
    world.stuck.insert(TurnoutId(1));
    world.dead.insert(world.layout.sensor_named("A1").expect("a sensor"));
    driver.order(world.now, Order::Turnout { turnout: TurnoutId(1), curved: true }).expect("free");
    world.run(&mut driver, 0.5);
    run(&mut driver, &world, FIRST, step(8));
    // when a train passes both,
    world.run(&mut driver, 9.0);
    // then the train and the turnout are known once the next sensor reports.
    let has_failed = |notice: &Notice| {
        matches!(notice, Notice::TurnoutMismatch { turnout: TurnoutId(1), curved: false, train: FIRST })
    };
    assert!(world.notices.iter().any(has_failed), "{:#?}", world.notices);
    assert_eq!(assigned(&world)[1], 0);
    assert!(error_mm(&world, &driver, FIRST) < 25.0);
}

#[test]
fn a_spurious_sensor_moves_no_train_and_is_ignored_until_it_recovers() {
    let (mut world, mut driver) = two_trains();
    let spurious = world.layout.sensor_named("F2").expect("a sensor");
    run(&mut driver, &world, FIRST, step(8));
    for _ in 0..4 {
        world.close(spurious);
        world.run(&mut driver, 8.0);
    }
    let count = |is: fn(&Notice) -> bool| world.notices.iter().filter(|notice| is(notice)).count();
    assert_eq!(count(|notice| matches!(notice, Notice::Unexplained { .. })), 2);
    assert_eq!(count(|notice| matches!(notice, Notice::SensorStuck { .. })), 1);
    assert_eq!(assigned(&world)[1], 0);
    world.run(&mut driver, 200.0);
    let recovers =
        |notice: &Notice| matches!(notice, Notice::SensorRestored { sensor } if *sensor == spurious);
    assert!(world.notices.iter().any(recovers));
}

#[test]
fn a_missed_train_is_not_moved_by_a_spurious_detection() {
    let (mut world, mut driver) = two_trains();
    // Given a train that a sensor missed,
    world.dead.insert(world.layout.sensor_named("A1").expect("a sensor"));
    run(&mut driver, &world, FIRST, step(8));
    run(&mut driver, &world, SECOND, step(8));
    let unseen = |world: &ToyRailway| {
        world.notices.iter().any(|notice| matches!(notice, Notice::Overdue { train: FIRST, .. }))
    };
    assert!(world.run_until(&mut driver, 10.0, unseen), "{:#?}", world.notices);
    // when a sensor that it cannot have reached reports, and another train passes the next,
    world.close(world.layout.sensor_named("F2").expect("a sensor"));
    world.run(&mut driver, 10.0);
    // then its position is unchanged.
    assert_eq!(assigned(&world)[1], 0, "{:#?}", world.notices);
    assert!(error_mm(&world, &driver, FIRST) < 25.0);
}

#[test]
fn a_train_at_rest_causes_no_detection() {
    let (mut world, mut driver) = two_trains();
    world.run(&mut driver, 2.0);
    // The next sensor ahead of each.
    for name in ["A1", "D1"] {
        world.close(world.layout.sensor_named(name).expect("a sensor"));
        world.run(&mut driver, 1.0);
    }
    assert_eq!(assigned(&world), [0, 0]);
    assert_eq!(world.notices.len(), 2, "{:#?}", world.notices);
    assert!(world.notices.iter().all(|notice| matches!(notice, Notice::Unexplained { .. })));
}

#[test]
fn of_two_lost_trains_neither_gets_an_ambiguous_detection() {
    // Given two moving trains of unknown position,
    let mut world = ToyRailway::new(24, "D1", 300.0);
    world.put(58, "B1", 100.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    let model = driver.model(FIRST).expect("a model").clone();
    driver.add_train(model);
    add_train(&mut driver, &world, 58, None);
    run(&mut driver, &world, FIRST, step(8));
    run(&mut driver, &world, SECOND, step(8));
    // when sensors report,
    world.run(&mut driver, 8.0);
    // then the detections are reported as ambiguous, and neither train is taken for the other.
    let ambiguous = |notice: &Notice| matches!(notice, Notice::Ambiguous { or: Some(_), .. });
    assert!(world.notices.iter().any(ambiguous), "{:#?}", world.notices);
    assert_eq!(assigned(&world)[1], 0);
    // With one of them at rest, the other is located at its next sensor.
    run(&mut driver, &world, SECOND, step(0));
    world.run(&mut driver, 14.0);
    assert!(error_mm(&world, &driver, FIRST) < 40.0);
}

#[test]
fn a_slow_train_is_lost_after_two_missed_detections_in_a_row() {
    let (mut world, mut driver) = two_trains();
    run(&mut driver, &world, FIRST, step(4));
    world.run(&mut driver, 1.0);
    world.trains.retain(|toy| toy.id != FIRST);
    let lifted: Timestamp = world.now;
    let lost = |world: &ToyRailway| {
        world.notices.iter().any(|notice| matches!(notice, Notice::Lost { train: FIRST }))
    };
    assert!(world.run_until(&mut driver, 60.0, lost), "{:#?}", world.notices);
    // A1 is 600 mm ahead of where it was and B1 700 mm further, at 128 mm/s.
    let after = world.now - lifted;
    assert!(after < TimeSpan::from_s(14.0), "{after:?}");
}

#[test]
fn a_train_too_fast_to_stall_runs_on_over_two_silent_sensors_and_is_where_the_third_reports_it() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    run(&mut driver, &world, FIRST, step(8));
    let sensors = |world: &ToyRailway| world.passes.iter().map(|(_, sensor, _)| *sensor).collect::<Vec<_>>();
    world.run_until(&mut driver, 20.0, |world| sensors(world).len() == 1);
    world.dead = (0..12).map(SensorId).filter(|sensor| !sensors(&world).contains(sensor)).collect();
    let silent = |world: &ToyRailway| {
        let silent = |notice: &&Notice| matches!(notice, Notice::Overdue { train: FIRST, .. });
        world.notices.iter().filter(silent).count()
    };
    assert!(world.run_until(&mut driver, 20.0, |world| silent(world) == 2), "{:#?}", world.notices);
    world.dead.clear();
    world.run(&mut driver, 6.0);
    assert!(
        !world.notices.iter().any(|notice| matches!(notice, Notice::Lost { .. })),
        "{:#?}",
        world.notices
    );
    assert_eq!(driver.commanded(FIRST), step(8));
    assert!(error_mm(&world, &driver, FIRST) < 40.0, "{} mm", error_mm(&world, &driver, FIRST));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_train_is_taken_for_another_despite_missed_and_spurious_detections(
        pace in 5_u8..12,
        faster in 0_u8..3,
        silent in 0_u16..12,
        closes in proptest::collection::vec((0_u16..12, 0.0..20.0_f64), 0..2),
        // One step is 32 mm/s: the second train catches up 830 mm at most, and is 700 mm and this behind.
        apart_mm in 180.0..480.0_f64,
    ) {
        let mut world = ToyRailway::new(24, "D1", 100.0 + apart_mm);
        world.put(58, "B1", 100.0);
        let mut driver = driver_of(&world, "D1", 100.0 + apart_mm);
        add_train(&mut driver, &world, 58, Some(("B1", 100.0)));
        world.dead.insert(SensorId(silent));
        let (mut closes, by_themselves) = (closes.clone(), closes.len());
        closes.sort_by(|(_, one), (_, other)| one.total_cmp(other));
        // Toy trains do not collide: their speed and the duration are too small for one to catch up with the other,
        // but long enough for three passages if one of two slow trains is lost, after a spurious detection half a
        // second before its sensor and a missed detection.
        run(&mut driver, &world, FIRST, step(pace));
        run(&mut driver, &world, SECOND, step(pace + faster - 1));
        for (sensor, at) in closes.into_iter().chain([(0, RUNS_FOR)]) {
            let waits = (Timestamp::from_s(at) - world.now).as_s();
            world.run(&mut driver, waits);
            if at < RUNS_FOR {
                world.close(SensorId(sensor));
            }
        }
        // A spurious detection just when a train is due cannot be distinguished from the train's own.
        let [right, wrong] = assigned(&world);
        prop_assert!(wrong <= by_themselves && right >= 3, "{right} right, {wrong} wrong: {:#?}", world.notices);
    }
}

/// A train at `D1+300mm` whose position is uncertain by 1 m, so that a spurious report of `B1`, 1.3 m ahead, is assigned to it
/// for a while.
fn uncertain() -> (ToyRailway, Driver) {
    let world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    let node = world.layout.node_named("D1").expect("a node");
    let at = PathPoint { node, distance: Length::from_mm(300.0) };
    driver.place(world.now, FIRST, at, Length::from_m(1.0));
    (world, driver)
}

/// Lets `B1` report spuriously. Runs until `A1` has reported the train, which shows that it had not reached `B1`.
fn b1_reports_and_is_revised(world: &mut ToyRailway, driver: &mut Driver) {
    let [a1, b1] = ["A1", "B1"].map(|name| world.layout.sensor_named(name).expect("a sensor"));
    world.run(driver, 2.4);
    world.close(b1);
    let has_passed = |world: &ToyRailway, at| {
        world
            .notices
            .iter()
            .any(|notice| matches!(notice, Notice::Passed { passed, .. } if passed.sensor == at))
    };
    assert!(world.run_until(driver, 1.0, |world| has_passed(world, b1)), "{:#?}", world.notices);
    assert!(world.run_until(driver, 10.0, |world| has_passed(world, a1)), "{:#?}", world.notices);
    let is_revised = |notice: &Notice| matches!(notice, Notice::Unexplained { sensor, .. } if *sensor == b1);
    assert!(world.notices.iter().any(is_revised), "{:#?}", world.notices);
}

#[test]
fn a_revised_detection_beyond_the_target_moves_neither_the_target_nor_the_end_of_authority() {
    let (mut world, mut driver) = uncertain();
    // Given a train that is to stop between two sensors of a circuit,
    let target = world.layout.landmark("A1+350mm").expect("a place");
    let stop = StopOrder { step: Some(step(8)), ..StopOrder::at(FIRST, target) };
    driver.order(world.now, Order::Stop(stop)).expect("ahead");
    let [d1, a1] = ["D1", "A1"].map(|name| world.layout.node_named(name).expect("a node"));
    // and whose authority ends two laps ahead,
    let end = PathPoint { node: d1, distance: Length::from_m(5.0) };
    driver.set_end_of_authority(world.now, FIRST, Some(end));
    // when the second one seems to have reported it, so that it is stopped, and the first one does,
    b1_reports_and_is_revised(&mut world, &mut driver);
    // then its authority ends where it did, 4.1 m beyond the first one,
    let end = driver.end_of_authority(FIRST).expect("authority");
    assert!(end.node == a1 && (end.distance - Length::from_mm(4_100.0)).as_mm().abs() < 40.0, "{end:?}");
    world.run(&mut driver, 10.0);
    // and it says how far from its target it came to rest.
    let error = world.finished().first().and_then(|finished| finished.achieved.as_ref()?.error);
    let error_mm = error.expect("at rest").as_mm();
    let truth_mm = world.beyond_mm("A1+350mm");
    assert!((error_mm - truth_mm).abs() < 40.0, "{error_mm} mm, in truth {truth_mm} mm");
}
