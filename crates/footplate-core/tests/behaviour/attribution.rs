//! Closures of contacts are laid to the trains that made them, past silent contacts and turnouts that did not move, and
//! to nobody where nobody was; a train that cannot be told from another is waited for, and one that is lost is said to be.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Driver, Notice, Order};
use footplate_core::{Length, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use proptest::prelude::{ProptestConfig, prop_assert, proptest};

use crate::toy_railway::{ToyRailway, add_train, driver_of, step};

const FIRST: TrainId = TrainId(24);
const SECOND: TrainId = TrainId(58);
/// How long trains run of which anything may be asked (s).
const RUNS_FOR: f64 = 26.0;

fn run(driver: &mut Driver, world: &ToyRailway, train: TrainId, step: SpeedStep) {
    driver.order(world.now, Order::Speed { train, step }).expect("a train and a step");
}

/// Two trains on the oval, the one 24 behind the one 58.
fn two_trains() -> (ToyRailway, Driver) {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    world.put(58, "B1", 100.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    add_train(&mut driver, &world, 58, Some(("B1", 100.0)));
    (world, driver)
}

/// Closures that were laid to a train: that did close the contact, and that did not.
fn laid(world: &ToyRailway) -> [usize; 2] {
    let mut counted = [0; 2];
    for notice in &world.notices {
        let Notice::Passed { train, passed, .. } = notice else { continue };
        let slack = TimeSpan::from_ms(2);
        let (from, until) = (passed.window.after - slack, passed.window.until + slack);
        let really = world
            .passes
            .iter()
            .any(|(at, sensor, who)| sensor == &passed.sensor && who == train && (from..=until).contains(at));
        counted[usize::from(!really)] += 1;
    }
    counted
}

fn error_mm(world: &ToyRailway, driver: &Driver, train: TrainId) -> f64 {
    let Some(located) = driver.locate(train, world.now) else { return f64::INFINITY };
    let at = driver.landmark(train, located.at).expect("a place");
    let believed = world.layout.locate(at, &world.turnouts).expect("a place");
    let true_place = world.trains.iter().find(|toy| toy.id == train).expect("a train").at;
    let way = |from, to| {
        world.layout.distance_ahead(from, to, &world.turnouts).map_or(f64::INFINITY, Length::as_mm)
    };
    way(believed, true_place).min(way(true_place, believed))
}

#[test]
fn two_trains_that_follow_each_other_are_told_apart() {
    let (mut world, mut driver) = two_trains();
    run(&mut driver, &world, FIRST, step(9));
    run(&mut driver, &world, SECOND, step(8));
    world.run(&mut driver, 30.0);
    let [right, wrong] = laid(&world);
    assert!(wrong == 0 && right >= 20, "{right} right, {wrong} wrong");
    for train in [FIRST, SECOND] {
        assert!(error_mm(&world, &driver, train) < 25.0, "{train}: {} mm", error_mm(&world, &driver, train));
    }
}

#[test]
fn a_silent_contact_and_a_turnout_that_did_not_move_at_once_are_looked_past() {
    let (mut world, mut driver) = two_trains();
    // Given a turnout that does not move when it is told to, and a contact before it that stays silent,
    world.stuck.insert(TurnoutId(1));
    world.dead.insert(world.layout.sensor_named("A1").expect("a contact"));
    driver.order(world.now, Order::Turnout { turnout: TurnoutId(1), curved: true }).expect("free");
    world.run(&mut driver, 0.5);
    run(&mut driver, &world, FIRST, step(8));
    // when a train comes by both,
    world.run(&mut driver, 9.0);
    // then it is believed once the contact after that says so, and the turnout with it.
    let lies = |notice: &Notice| {
        matches!(notice, Notice::TurnoutMismatch { turnout: TurnoutId(1), curved: false, train: FIRST })
    };
    assert!(world.notices.iter().any(lies), "{:#?}", world.notices);
    assert_eq!(laid(&world)[1], 0);
    assert!(error_mm(&world, &driver, FIRST) < 25.0);
}

#[test]
fn a_contact_that_closes_by_itself_moves_nobody_and_is_not_believed_until_it_behaves() {
    let (mut world, mut driver) = two_trains();
    let contact = world.layout.sensor_named("F2").expect("a contact");
    run(&mut driver, &world, FIRST, step(8));
    for _ in 0..4 {
        world.close(contact);
        world.run(&mut driver, 8.0);
    }
    let said = |is: fn(&Notice) -> bool| world.notices.iter().filter(|notice| is(notice)).count();
    assert_eq!(said(|notice| matches!(notice, Notice::Unexplained { .. })), 2);
    assert_eq!(said(|notice| matches!(notice, Notice::SensorStuck { .. })), 1);
    assert_eq!(laid(&world)[1], 0);
    world.run(&mut driver, 200.0);
    let behaves = |notice: &Notice| matches!(notice, Notice::SensorRestored { sensor } if *sensor == contact);
    assert!(world.notices.iter().any(behaves));
}

#[test]
fn a_train_that_one_contact_missed_is_not_moved_by_another_that_closes_by_itself() {
    let (mut world, mut driver) = two_trains();
    // Given a train that a contact did not see,
    world.dead.insert(world.layout.sensor_named("A1").expect("a contact"));
    run(&mut driver, &world, FIRST, step(8));
    run(&mut driver, &world, SECOND, step(8));
    let unseen = |world: &ToyRailway| {
        world.notices.iter().any(|notice| matches!(notice, Notice::Overdue { train: FIRST, .. }))
    };
    assert!(world.run_until(&mut driver, 10.0, unseen), "{:#?}", world.notices);
    // when one closes that it cannot have come to, and another train passes the next,
    world.close(world.layout.sensor_named("F2").expect("a contact"));
    world.run(&mut driver, 10.0);
    // then it is where it was.
    assert_eq!(laid(&world)[1], 0, "{:#?}", world.notices);
    assert!(error_mm(&world, &driver, FIRST) < 25.0);
}

#[test]
fn a_train_that_stands_closes_nothing() {
    let (mut world, mut driver) = two_trains();
    world.run(&mut driver, 2.0);
    // The next contact ahead of either.
    for name in ["A1", "D1"] {
        world.close(world.layout.sensor_named(name).expect("a contact"));
        world.run(&mut driver, 1.0);
    }
    assert_eq!(laid(&world), [0, 0]);
    assert_eq!(world.notices.len(), 2, "{:#?}", world.notices);
    assert!(world.notices.iter().all(|notice| matches!(notice, Notice::Unexplained { .. })));
}

#[test]
fn of_two_lost_trains_neither_takes_a_contact_that_may_be_the_other_s() {
    // Given two trains that run and nobody knows where,
    let mut world = ToyRailway::new(24, "D1", 300.0);
    world.put(58, "B1", 100.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    let model = driver.model(FIRST).expect("a model").clone();
    driver.add_train(model);
    add_train(&mut driver, &world, 58, None);
    run(&mut driver, &world, FIRST, step(8));
    run(&mut driver, &world, SECOND, step(8));
    // when contacts close,
    world.run(&mut driver, 8.0);
    // then that is said, and nobody is taken for the other.
    let ambiguous = |notice: &Notice| matches!(notice, Notice::Ambiguous { or: Some(_), .. });
    assert!(world.notices.iter().any(ambiguous), "{:#?}", world.notices);
    assert_eq!(laid(&world)[1], 0);
    // With one of them at rest the other is found at its next contact.
    run(&mut driver, &world, SECOND, step(0));
    world.run(&mut driver, 14.0);
    assert!(error_mm(&world, &driver, FIRST) < 40.0);
}

#[test]
fn a_train_is_lost_when_two_contacts_in_a_row_have_been_silent() {
    let (mut world, mut driver) = two_trains();
    run(&mut driver, &world, FIRST, step(8));
    world.run(&mut driver, 1.0);
    world.trains.retain(|toy| toy.id != FIRST);
    let lifted: Timestamp = world.now;
    let lost = |world: &ToyRailway| {
        world.notices.iter().any(|notice| matches!(notice, Notice::Lost { train: FIRST }))
    };
    assert!(world.run_until(&mut driver, 60.0, lost), "{:#?}", world.notices);
    // A1 is 600 mm ahead of where it was and B1 700 mm further, at 256 mm/s.
    let after = world.now - lifted;
    assert!(after < TimeSpan::from_s(8.0), "{after:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn nobody_is_taken_for_another_whatever_stays_silent_or_closes_by_itself(
        pace in 5_u8..12,
        faster in 0_u8..3,
        silent in 0_u16..12,
        closes in proptest::collection::vec((0_u16..12, 0.0..20.0_f64), 0..2),
        apart_mm in 0.0..300.0_f64,
    ) {
        let mut world = ToyRailway::new(24, "D1", 100.0 + apart_mm);
        world.put(58, "B1", 100.0);
        let mut driver = driver_of(&world, "D1", 100.0 + apart_mm);
        add_train(&mut driver, &world, 58, Some(("B1", 100.0)));
        world.dead.insert(SensorId(silent));
        let (mut closes, by_themselves) = (closes.clone(), closes.len());
        closes.sort_by(|(_, one), (_, other)| one.total_cmp(other));
        // Toy trains run through each other: not so fast, and not so long, that one catches up with the other; but long
        // enough for three passages when one of two slow trains is lost, to a contact that closed half a second before
        // it came there and a silent one after that.
        run(&mut driver, &world, FIRST, step(pace));
        run(&mut driver, &world, SECOND, step(pace + faster - 1));
        for (sensor, at) in closes.into_iter().chain([(0, RUNS_FOR)]) {
            let waits = (Timestamp::from_s(at) - world.now).as_s();
            world.run(&mut driver, waits);
            if at < RUNS_FOR {
                world.close(SensorId(sensor));
            }
        }
        // A contact that closes by itself just when a train is due there is the train's, as far as anybody can tell.
        let [right, wrong] = laid(&world);
        prop_assert!(wrong <= by_themselves && right >= 3, "{right} right, {wrong} wrong: {:#?}", world.notices);
    }
}
