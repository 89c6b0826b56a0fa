//! A driver stops trains at their targets, rejects what it cannot do in advance, and never waits for a report that
//! may not come.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Aim, Driver, Notice, Order, Refusal, StopOrder};
use footplate_core::link::TimeModel;
use footplate_core::tracking::PathPoint;
use footplate_core::{Command, Length, Ratio, SensorId, TimeSpan, TrainId, TurnoutId};

use crate::toy_railway::{ToyRailway, driver_of, known_model, step, straight};

const TRAIN: TrainId = TrainId(24);

fn stop_at(driver: &Driver, place: &str) -> StopOrder {
    StopOrder::at(TRAIN, driver.layout().landmark(place).expect("a place"))
}

fn is_done(world: &ToyRailway) -> bool {
    !world.finished().is_empty()
}

fn speed_of_stop(command: &Command) -> bool {
    matches!(command, Command::Speed { step, .. } if step.get() == 0)
}

/// Stops from rest at near and far places; returns how far beyond each the train really came to rest.
fn stops(places: &[&str], order: impl Fn(StopOrder) -> StopOrder) -> Vec<(f64, f64, f64)> {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    let mut missed = Vec::new();
    for place in places {
        world.notices.clear();
        let stop = order(stop_at(&driver, place));
        driver.order(world.now, Order::Stop(stop)).expect("a place that can be reached");
        assert!(world.run_until(&mut driver, 120.0, is_done), "{place}: {:#?}", world.notices);
        let finished = world.finished()[0];
        let promise = finished.promise.expect("a promise");
        missed.push((world.beyond_mm(place), promise.low.as_mm(), promise.high.as_mm()));
    }
    missed
}

#[test]
fn stops_at_a_place_end_within_the_promised_interval() {
    let places = ["B1+120mm", "A1-30mm", "MR2+40mm", "D1+700mm", "A1+150mm", "B1-80mm", "D1+55mm", "A1"];
    for (missed, low, high) in stops(&places, |stop| stop) {
        assert!((low..=high).contains(&missed), "{missed} mm of {low} to {high} mm");
        // 100 mm with a sensor passed at a settled speed; without one, the uncertainty of the start.
        assert!(high - low < 200.0 && missed.abs() < 45.0, "{missed} mm of {low} to {high} mm");
    }
}

#[test]
fn a_stop_not_beyond_a_place_ends_short_of_it() {
    let share = Aim::NotBeyond(Ratio::from_percent(0.1));
    for (missed, _, _) in stops(&["B1+120mm", "D1+700mm", "B1-80mm"], |stop| StopOrder { aim: share, ..stop })
    {
        assert!((-120.0..=0.0).contains(&missed), "{missed} mm");
    }
}

#[test]
fn short_moves_end_within_the_promised_interval() {
    let mut world = ToyRailway::new(24, "D1", 100.0);
    let mut driver = driver_of(&world, "D1", 100.0);
    for mm in [40.0, 120.0, 250.0] {
        world.notices.clear();
        let before = world.train().travelled_mm;
        driver.order(world.now, Order::Move { train: TRAIN, distance: Length::from_mm(mm) }).expect("a move");
        assert!(world.run_until(&mut driver, 60.0, is_done), "{:#?}", world.notices);
        let moved = world.train().travelled_mm - before;
        let promise = world.finished()[0].promise.expect("a promise");
        let (low, high) = (promise.low.as_mm(), promise.high.as_mm());
        assert!((low..=high).contains(&(moved - mm)), "{moved} mm instead of {mm} mm, {low} to {high} mm");
        assert!((moved - mm).abs() < 10.0 + 0.2 * mm, "{moved} mm instead of {mm} mm");
    }
}

#[test]
fn a_moving_train_stops_directly_and_too_near_a_target_is_rejected() {
    // Given a train running at step 10,
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(10) }).expect("a step");
    world.run_until(&mut driver, 30.0, |world| world.beyond_mm("B1") > 20.0 && world.beyond_mm("B1") < 40.0);
    world.notices.clear();
    // when the target is nearer than it can stop,
    let near = stop_at(&driver, "B1+100mm");
    let refused = driver.order(world.now, Order::Stop(near)).expect_err("nearer than it can stop");
    // then the order is rejected with the nearest place, repeatedly,
    let Refusal::TooNear { nearest, beyond, round: Some(round), .. } = &refused else { panic!("{refused}") };
    assert!(driver.order(world.now, Order::Stop(near)).is_err());
    assert!((round.as_mm() - 2_300.0).abs() < 40.0, "{round:?}");
    // a stop at the nearest place succeeds,
    let nearest_mm = driver.layout().landmark(nearest).expect("a place").offset.as_mm();
    assert!((nearest_mm - 100.0 - beyond.as_mm()).abs() < 12.0, "{refused}");
    let a_little_further = stop_at(&driver, &format!("B1+{:.0}mm", nearest_mm + 30.0));
    driver.order(world.now, Order::Stop(a_little_further)).expect("the nearest place and a little");
    assert!(world.run_until(&mut driver, 20.0, is_done));
    assert!(world.beyond_mm("B1+100mm") > 0.0);
    // and the rejected target is reached on the next lap.
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(10) }).expect("a step");
    world.run_until(&mut driver, 60.0, |world| (0.0..20.0).contains(&world.beyond_mm("B1+20mm")));
    world.notices.clear();
    let next = StopOrder { next_round: true, ..near };
    driver.order(world.now, Order::Stop(next)).expect("the next round");
    assert!(world.run_until(&mut driver, 60.0, is_done), "{:#?}", world.notices);
    assert!(world.beyond_mm("B1+100mm").abs() < 30.0, "{} mm", world.beyond_mm("B1+100mm"));
}

#[test]
fn a_faster_link_shortens_the_earliest_stop_by_the_distance_run_meanwhile() {
    // Given a train running at step 10, and a stop that is rejected,
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(10) }).expect("a step");
    world.run_until(&mut driver, 30.0, |world| (20.0..40.0).contains(&world.beyond_mm("B1")));
    let missed_by = |driver: &mut Driver| {
        let stop = stop_at(driver, "B1+100mm");
        match driver.order(world.now, Order::Stop(stop)).expect_err("nearer than it can stop") {
            Refusal::TooNear { beyond, .. } => beyond,
            refused => panic!("{refused}"),
        }
    };
    let over_the_slowest = missed_by(&mut driver);
    // when the command is sent within 6 ms instead of 66 ms,
    driver.set_link(TimeModel { soonest: TimeSpan::from_ms(6), ..TimeModel::ASSUMED });
    let sooner = over_the_slowest - missed_by(&mut driver);
    // then the nearest stop is closer by the distance run in 60 ms.
    let speed = driver.locate(TRAIN, world.now).expect("a place").speed;
    let runs = speed * TimeSpan::from_ms(60);
    assert!(runs > Length::from_mm(15.0), "{runs:?}");
    assert!((sooner - runs).abs() < Length::from_mm(1.0), "{sooner:?} instead of {runs:?}");
}

#[test]
fn a_stop_is_commanded_by_the_clock_when_no_sensor_reports() {
    // Given a train running to a stop,
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Stop(stop_at(&driver, "D1+100mm"))).expect("one round");
    world.run_until(&mut driver, 20.0, |world| world.beyond_mm("A1") > 0.0 && world.beyond_mm("A1") < 40.0);
    // when all sensors are silent from then on,
    world.dead = (0..8).map(SensorId).collect();
    // then the stop is still commanded, and ends near its target.
    assert!(world.run_until(&mut driver, 60.0, is_done), "{:#?}", world.notices);
    assert!(world.commands.iter().any(|(_, command)| speed_of_stop(command)));
    assert!(world.beyond_mm("D1+100mm").abs() < 150.0, "{} mm", world.beyond_mm("D1+100mm"));
}

#[test]
fn a_lost_train_is_located_and_then_stopped_at_its_target() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = Driver::new(world.layout.clone(), straight());
    driver.add_train(known_model(24));
    driver.order(world.now, Order::Stop(stop_at(&driver, "A1+60mm"))).expect("it will be found");
    assert!(world.run_until(&mut driver, 120.0, is_done), "{:#?}", world.notices);
    assert!(world.beyond_mm("A1+60mm").abs() < 30.0, "{} mm", world.beyond_mm("A1+60mm"));
}

#[test]
fn a_plan_is_reported_again_only_when_it_has_changed() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Stop(stop_at(&driver, "D1+100mm"))).expect("a place that can be reached");
    assert!(world.run_until(&mut driver, 60.0, is_done));
    let mut plans = Vec::new();
    for notice in &world.notices {
        if let Notice::Planned(plan) = notice {
            plans.push(*plan);
        }
    }
    assert!(plans.len() >= 2, "{plans:?}");
    for pair in plans.windows(2) {
        let moved = (pair[1].leaves - pair[0].leaves).abs();
        assert!(moved >= TimeSpan::from_ms(1) || pair[0].trigger != pair[1].trigger, "{pair:?}");
    }
    // The last plan was carried out: its stop left the line at the time that it names, within a poll of this world.
    let stop = world.commands.iter().rfind(|(_, command)| speed_of_stop(command)).expect("it stopped").0;
    let planned = plans[plans.len() - 1].leaves;
    assert!((stop - planned).abs() <= TimeSpan::from_ms(12), "{stop:?} {planned:?}");
}

#[test]
fn a_search_that_no_sensor_answers_is_given_up_after_a_minute() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = Driver::new(world.layout.clone(), straight());
    driver.add_train(known_model(24));
    world.dead = (0..12).map(SensorId).collect();
    driver
        .order(world.now, Order::Stop(stop_at(&driver, "B1+100mm")))
        .expect("a lost train is located first");
    let given_up =
        |world: &ToyRailway| world.notices.iter().any(|notice| matches!(notice, Notice::GivenUp { .. }));
    assert!(world.run_until(&mut driver, 90.0, given_up), "{:#?}", world.notices);
    assert!((world.now.as_s() - 60.0).abs() < 0.1, "{:?}", world.now);
    let why = world.notices.iter().find_map(|notice| match notice {
        Notice::GivenUp { why, .. } => Some(why.clone()),
        _ => None,
    });
    assert_eq!(why, Some(Refusal::NotFound { train: TRAIN, within: TimeSpan::from_s(60.0) }));
}

#[test]
fn a_vanished_train_is_given_up_and_commanded_to_stop() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(10) }).expect("a step");
    world.dead = (0..12).map(SensorId).collect();
    world.run(&mut driver, 60.0);
    assert!(world.notices.iter().any(|notice| matches!(notice, Notice::Overdue { train: TRAIN, .. })));
    assert!(world.notices.iter().any(|notice| matches!(notice, Notice::Lost { train: TRAIN })));
    assert!(world.train().speed_mm_per_s < 1.0);
    let lost = driver.order(world.now, Order::Move { train: TRAIN, distance: Length::from_mm(50.0) });
    assert_eq!(lost, Err(Refusal::Lost { train: TRAIN }));
}

#[test]
fn after_reversing_a_train_is_located_to_a_centimetre_and_stops_in_the_other_direction() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Speed { train: TRAIN, step: step(8) }).expect("a step");
    world.run(&mut driver, 6.0);
    world.notices.clear();
    driver.order(world.now, Order::Reverse { train: TRAIN, then: step(0) }).expect("a train");
    assert!(world.run_until(&mut driver, 30.0, is_done), "{:#?}", world.notices);
    world.run(&mut driver, 0.5);
    let moving = |command: &Command| matches!(command, Command::Reverse { .. });
    assert_eq!(world.commands.iter().filter(|(_, command)| moving(command)).count(), 1);
    let located = driver.locate(TRAIN, world.now).expect("it is not lost");
    assert!(located.at_rest && located.uncertainty < Length::from_mm(30.0), "{located:?}");
    world.notices.clear();
    driver.order(world.now, Order::Stop(stop_at(&driver, "D2+200mm"))).expect("back along its path");
    assert!(world.run_until(&mut driver, 60.0, is_done), "{:#?}", world.notices);
    assert!(world.beyond_mm("D2+200mm").abs() < 40.0, "{} mm", world.beyond_mm("D2+200mm"));
}

#[test]
fn a_train_never_runs_off_the_end_of_the_track() {
    for throttle in [6, 10, 14] {
        let mut world = ToyRailway::new(24, "E1", 20.0);
        let mut driver = driver_of(&world, "E1", 20.0);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(throttle) }).expect("a step");
        world.run(&mut driver, 40.0);
        assert!(!world.train().is_off_the_track && world.train().speed_mm_per_s < 1.0);
        assert!(world.notices.iter().any(|notice| matches!(notice, Notice::TrackEnds { .. })));
    }
}

#[test]
fn a_train_keeps_its_end_of_authority_whatever_is_ordered_or_reported() {
    for (throttle, is_deaf) in [(6, false), (10, true), (14, false), (14, true)] {
        let mut world = ToyRailway::new(24, "D1", 300.0);
        let mut driver = driver_of(&world, "D1", 300.0);
        if is_deaf {
            world.dead.extend(world.layout.sensors().map(|(sensor, _)| sensor));
        }
        let limit =
            PathPoint { node: stop_at(&driver, "D1").target.node, distance: Length::from_mm(2_000.0) };
        driver.set_end_of_authority(world.now, TRAIN, Some(limit));
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(throttle) }).expect("a step");
        world.run(&mut driver, 40.0);
        let beyond = world.beyond_mm("D1+2000mm");
        assert!((-400.0..0.0).contains(&beyond) && world.train().speed_mm_per_s < 1.0, "{beyond} mm");
        assert!(world.notices.iter().any(|notice| matches!(notice, Notice::AuthorityEnds { .. })));
        // After reversing, its authority ends where it is.
        driver.order(world.now, Order::Reverse { train: TRAIN, then: step(throttle) }).expect("a train");
        let before = world.train().travelled_mm;
        world.run(&mut driver, 20.0);
        assert!(world.train().travelled_mm - before < 60.0, "{} mm", world.train().travelled_mm - before);
        driver.set_end_of_authority(world.now, TRAIN, None);
        driver.order(world.now, Order::Speed { train: TRAIN, step: step(6) }).expect("a step");
        world.run(&mut driver, 5.0);
        assert!(world.train().speed_mm_per_s > 1.0);
    }
}

#[test]
fn a_stop_beyond_the_end_of_authority_ends_before_it() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    let stop = stop_at(&driver, "A1+400mm");
    driver.set_end_of_authority(
        world.now,
        TRAIN,
        Some(PathPoint { node: stop_at(&driver, "D1").target.node, distance: Length::from_mm(1_100.0) }),
    );
    driver.order(world.now, Order::Stop(stop)).expect("a path leads there");
    world.run(&mut driver, 20.0);
    let given_up =
        |notice: &Notice| matches!(notice, Notice::GivenUp { why: Refusal::AtLimit { train: TRAIN }, .. });
    assert!(world.notices.iter().any(given_up), "{:#?}", world.notices);
    assert!((-200.0..0.0).contains(&world.beyond_mm("A1+200mm")), "{} mm", world.beyond_mm("A1+200mm"));
}

#[test]
fn a_turnout_is_never_thrown_under_a_train() {
    let mut world = ToyRailway::new(24, "A1", 190.0);
    let mut driver = driver_of(&world, "A1", 190.0);
    let throw = |turnout| Order::Turnout { turnout: TurnoutId(turnout), curved: true };
    let refused = driver.order(world.now, throw(1));
    assert_eq!(refused, Err(Refusal::TurnoutOccupied { turnout: TurnoutId(1), train: TRAIN }));
    assert_eq!(driver.order(world.now, throw(9)), Err(Refusal::UnknownTurnout { turnout: TurnoutId(9) }));
    driver.order(world.now, throw(2)).expect("no train is there");
    world.run(&mut driver, 1.0);
    assert!(driver.turnouts().get(TurnoutId(2)).is_some_and(|leg| leg.is_curved()));
}

#[test]
fn a_failed_turnout_is_detected_by_the_path_of_the_train() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    world.stuck.insert(TurnoutId(1));
    let mut driver = driver_of(&world, "D1", 300.0);
    driver.order(world.now, Order::Turnout { turnout: TurnoutId(1), curved: true }).expect("free");
    world.run(&mut driver, 0.5);
    driver.order(world.now, Order::Stop(stop_at(&driver, "D1+200mm"))).expect("round over C");
    assert!(world.run_until(&mut driver, 60.0, is_done), "{:#?}", world.notices);
    let otherwise = |notice: &Notice| {
        matches!(notice, Notice::TurnoutMismatch { turnout: TurnoutId(1), curved: false, .. })
    };
    assert!(world.notices.iter().any(otherwise), "{:#?}", world.notices);
    assert!(world.beyond_mm("D1+200mm").abs() < 30.0, "{} mm", world.beyond_mm("D1+200mm"));
}

#[test]
fn invalid_orders_are_rejected_and_change_nothing() {
    let world = ToyRailway::new(24, "D1", 300.0);
    let mut driver = driver_of(&world, "D1", 300.0);
    let now = world.now;
    let stop = stop_at(&driver, "B1");
    let other = StopOrder { train: TrainId(58), ..stop };
    for (order, says) in [
        (
            Order::Speed { train: TRAIN, step: step(15) },
            "step 15 is too high: the highest step of this train is 14",
        ),
        (Order::Stop(other), "train 58 is not part of this session"),
        (Order::Stop(StopOrder { step: Some(step(0)), ..stop }), "step 0 does not move this train reliably"),
        (
            Order::Stop(StopOrder { aim: Aim::NotBeyond(Ratio::from_percent(80.0)), ..stop }),
            "probability 80 % is out of range: use 0.0001 % to 50 %",
        ),
        (
            Order::Stop(stop_at(&driver, "E1")),
            "no path from `D1` to `E1` with the turnouts in their present positions: throw turnouts, for example `turnout all \
             straight`, or let `go` throw them",
        ),
        (
            Order::Stop(stop_at(&driver, "F1+2000mm")),
            "the track ends at `EX2`, 1100 mm before the end of the path",
        ),
        (Order::Stop(stop_at(&driver, "B2")), "no path from `D1` to `B2`"),
        (Order::Move { train: TRAIN, distance: Length::from_mm(-5.0) }, "distance -5 mm is out of range"),
    ] {
        let refused = driver.order(now, order).expect_err(says).to_string();
        assert!(refused.contains(says), "{refused}");
        assert_eq!(driver.busy(TRAIN), None);
    }
}
