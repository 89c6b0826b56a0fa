//! Sensors that report one number for both directions: trains are located in their true direction, or not before that is known.

use footplate_core::control::{Driver, Notice, Order, Reservation, Watchdog};
use footplate_core::{Command, SensorId, TrainId};

use crate::toy_railway::{ToyRailway, driver_of, step, undirected_layout};
use crate::watching::{FIRST, Watched};

/// A train beyond a node, and a driver that knows where it is.
fn scene(node: &str, mm: f64) -> (ToyRailway, Driver) {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    world.layout = undirected_layout();
    world.put(24, node, mm);
    let driver = driver_of(&world, node, mm);
    (world, driver)
}

/// The sensors that a train was said to have passed.
fn passed(world: &ToyRailway, notices: &[Notice]) -> Vec<String> {
    let of = |notice: &Notice| match notice {
        Notice::Passed { passed, .. } => Some(world.layout.sensor_name(passed.sensor).to_owned()),
        _ => None,
    };
    notices.iter().filter_map(of).collect()
}

#[test]
fn a_located_train_passes_them_in_its_direction_and_back_again_after_it_reverses() {
    let (mut world, mut driver) = scene("D1", 300.0);
    driver.order(world.now, Order::Speed { train: FIRST, step: step(9) }).expect("a step");
    world.run(&mut driver, 9.0);
    driver.order(world.now, Order::Reverse { train: FIRST, then: step(9) }).expect("a step");
    assert!(world.run_until(&mut driver, 20.0, |world| world.passes.len() == 6));
    world.run(&mut driver, 0.1);
    assert_eq!(passed(&world, &world.notices), ["A1", "B1", "D1", "D2", "B2", "A2"]);
    let either =
        |notice: &&Notice| matches!(notice, Notice::EitherDirection { .. } | Notice::Unexplained { .. });
    assert_eq!(world.notices.iter().find(either), None);
}

#[test]
fn a_lost_train_is_located_at_the_second_sensor_with_both_of_its_detections() {
    for (node, mm, expected) in [("D1", 300.0, ["A1", "B1"]), ("A2", 600.0, ["D2", "B2"])] {
        let (mut world, mut driver) = scene(node, mm);
        let model = driver.model(FIRST).expect("a model").clone();
        driver.add_train(model);
        driver.order(world.now, Order::Speed { train: FIRST, step: step(9) }).expect("a step");
        let is_seen = |world: &ToyRailway| {
            world
                .notices
                .iter()
                .any(|notice| matches!(notice, Notice::EitherDirection { train: TrainId(24), .. }))
        };
        assert!(world.run_until(&mut driver, 10.0, is_seen), "{:?}", world.notices);
        // Longer than other ambiguities last.
        world.run(&mut driver, 1.0);
        assert_eq!(driver.locate(FIRST, world.now), None, "its direction is not known");
        world.run(&mut driver, 5.0);
        assert_eq!(passed(&world, &world.notices)[..2], expected);
        let located = driver.locate(FIRST, world.now).expect("located");
        let said = driver.landmark(FIRST, located.at).expect("a place");
        let off = world.beyond_mm(&world.layout.display(said).to_string());
        assert!(off.abs() < 20.0, "{node}: {off} mm");
    }
}

#[test]
fn a_sensor_passed_a_second_time_after_a_reversal_shows_no_direction() {
    let (mut world, mut driver) = scene("D1", 300.0);
    let model = driver.model(FIRST).expect("a model").clone();
    driver.add_train(model);
    driver.order(world.now, Order::Speed { train: FIRST, step: step(6) }).expect("a step");
    let seen = |world: &ToyRailway| {
        world.notices.iter().filter(|notice| matches!(notice, Notice::EitherDirection { .. })).count()
    };
    assert!(world.run_until(&mut driver, 10.0, |world| seen(world) == 1));
    driver.order(world.now, Order::Reverse { train: FIRST, then: step(9) }).expect("a step");
    assert!(world.run_until(&mut driver, 20.0, |world| world.passes.len() == 2), "{:?}", world.passes);
    world.run(&mut driver, 0.5);
    assert_eq!(driver.locate(FIRST, world.now), None);
    // The next one does.
    assert!(world.run_until(&mut driver, 20.0, |world| world.passes.len() == 3), "{:?}", world.passes);
    world.run(&mut driver, 0.1);
    assert_eq!(passed(&world, &world.notices), ["A2", "D2"]);
}

#[test]
fn a_train_that_creeps_back_is_located_by_the_sensor_that_it_ran_over() {
    let (world, driver) = scene("D1", 300.0);
    let dog = Watchdog::new(driver, world.now);
    let mut watched = Watched { world, dog, notices: Vec::new(), commanded: Vec::new() };
    watched.dog.ask_before_creeping();
    watched.go(FIRST, 8);
    watched.run(6.0);
    watched.dog.distrust(watched.world.now, FIRST);
    watched.run(30.0);
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    let located = |watched: &Watched| {
        watched.notices.iter().filter(|notice| matches!(notice, Notice::Located { .. })).count()
    };
    assert!(watched.run_until(60.0, |watched| located(watched) == 1), "{:#?}", watched.notices);
    watched.run(1.0);
    let (commands, passes) = (watched.commanded.len(), watched.world.passes.len());
    let over = watched.world.passes.last().map(|(_, sensor, _)| *sensor).expect("it has passed one");
    watched.dog.lose(watched.world.now, FIRST);
    assert!(watched.run_until(60.0, |watched| located(watched) == 2), "{:#?}", watched.notices);
    let reversed = |(_, command): &(_, Command)| matches!(command, Command::Reverse { .. });
    assert!(watched.commanded[commands..].iter().any(reversed));
    // One sensor was enough: the one that it had run over, in its new direction.
    let layout = &watched.world.layout;
    let back = layout.sensor_node(over).and_then(|node| layout.sensor_at(node.reverse())).expect("both");
    let crept: Vec<SensorId> = watched.world.passes[passes..].iter().map(|(_, sensor, _)| *sensor).collect();
    assert_eq!(crept, [back]);
    let name = layout.sensor_name(back).to_owned();
    assert_eq!(passed(&watched.world, &watched.notices).last(), Some(&name));
}
