//! Sensors that report one number for both directions of travel: the direction is found, and stops are as good as with a direction.

use footplate_core::control::{Aim, Driver, Notice, Order, StopOrder};
use footplate_core::track::{Landmark, Layout, Position};
use footplate_core::{Length, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_eval::testbed::{Calibrated, VirtualLine, calibrate};
use footplate_sim::{End, LawFamily, LivingSwitches, PassTruth, VirtualStation};
use footplate_store::{ModuleLetters, SensorNames as _, built_in, parse_layout, write_layout};

const TRAIN: TrainId = TrainId(24);
const BUDGET: TimeSpan = TimeSpan::from_s(300.0);
/// From a passage to its report: two polls of all modules.
const REPORTED_WITHIN: TimeSpan = TimeSpan::from_ms(150);
/// Stops end so far beyond their sensor.
const BEYOND_MM: f64 = 60.0;

/// A built-in layout, of whose sensors those that are picked report the first of their numbers in both directions.
fn undirected(name: &str, picked: impl Fn(u16) -> bool) -> Layout {
    let text = write_layout(&built_in(name).unwrap());
    let line = |line: &str| {
        let first = line.split('"').nth(1).and_then(|name| ModuleLetters.sensor_named(name));
        match first.filter(|sensor| line.trim_start().starts_with("{ names") && picked(sensor.0)) {
            Some(number) => line.replace("], at", &format!("], number = {number}, at")) + "\n",
            None => line.to_owned() + "\n",
        }
    };
    let text: String = text.lines().map(line).collect();
    parse_layout("undirected.toml", text.as_bytes()).unwrap().layout
}

fn world(layout: &Layout, seed: u64) -> VirtualLine<'_> {
    let switches = LivingSwitches { law: Some(LawFamily::SCurve), ..LivingSwitches::well_kept() };
    VirtualLine::open(VirtualStation::draw(layout, seed, &[TRAIN], &switches).unwrap()).unwrap()
}

/// A driver with the train, calibrated and located.
fn calibrated(layout: &Layout, line: &mut VirtualLine<'_>) -> Driver {
    let Calibrated { model, locator, turnouts, ending, .. } = calibrate(layout, line, TRAIN, BUDGET);
    assert!(ending.contains("Budget"), "{ending}");
    let mut driver = Driver::new(layout.clone(), turnouts);
    driver.add_located(model, locator);
    driver
}

fn step(number: u8) -> SpeedStep {
    SpeedStep::new(number).unwrap()
}

/// What became of a session.
#[derive(Debug, Default)]
struct Session {
    /// How far beyond its target each stop ended, in mm.
    stops: Vec<f64>,
    /// Detections that were taken to be of a train, and those of them that it did not cause in this direction.
    passed: usize,
    wrong: usize,
}

impl Session {
    /// Drives until a time or until an order is done, and compares every detection with the truth.
    fn drive(&mut self, line: &mut VirtualLine<'_>, driver: &mut Driver, until: Timestamp) -> bool {
        while let Some(notice) = line.drive(driver, until) {
            match notice {
                Notice::Passed { train, passed, .. } => {
                    let truth = line.station.world.truth();
                    let is_it = |pass: &PassTruth| {
                        let off = (pass.at - passed.window.until).abs();
                        pass.train == Some(train) && pass.sensor == passed.sensor && off < REPORTED_WITHIN
                    };
                    self.passed += 1;
                    self.wrong += usize::from(!truth.passes().iter().any(is_it));
                }
                Notice::Done(_) => return true,
                _ => {}
            }
        }
        false
    }

    fn wait(&mut self, line: &mut VirtualLine<'_>, driver: &mut Driver, seconds: f64) {
        let until = line.now() + TimeSpan::from_s(seconds);
        while self.drive(line, driver, until) {}
    }

    /// Stops at a sensor that comes a few hops on.
    fn stop(&mut self, line: &mut VirtualLine<'_>, driver: &mut Driver, hops: usize, by: u8) {
        let now = line.now();
        let layout = driver.layout();
        let Some(located) = driver.locate(TRAIN, now) else { return self.stops.push(f64::INFINITY) };
        let mut node = located.at.node;
        for _ in 0..hops {
            node = layout.open_hops_from(node, driver.turnouts()).next().map_or(node, |hop| hop.to);
        }
        let Some(sensor) = layout.sensor_at(node) else { return };
        let target = Landmark { node, offset: Length::from_mm(BEYOND_MM) };
        let order =
            StopOrder { train: TRAIN, target, aim: Aim::Median, step: Some(step(by)), next_round: true };
        if driver.order(now, Order::Stop(order)).is_err() {
            return;
        }
        if self.drive(line, driver, now + TimeSpan::from_s(90.0)) {
            self.wait(line, driver, 2.0);
            let past = line.station.world.truth().past(TRAIN, sensor);
            self.stops.push(past.map_or(f64::INFINITY, |past| past.as_mm() - BEYOND_MM));
        }
    }
}

/// Calibrates a train, and drives it to eight stops. After the fourth, just beyond a sensor, it reverses and passes that again.
fn session(layout: &Layout, seed: u64) -> Session {
    let mut line = world(layout, seed);
    let mut driver = calibrated(layout, &mut line);
    let mut session = Session::default();
    for (number, (hops, by)) in [(3, 9), (4, 11), (3, 8), (5, 10)].iter().cycle().take(8).enumerate() {
        if number == 4 {
            driver.order(line.now(), Order::Reverse { train: TRAIN, then: step(0) }).unwrap();
            session.wait(&mut line, &mut driver, 2.0);
        }
        session.stop(&mut line, &mut driver, *hops, *by);
    }
    session
}

#[test]
fn stops_are_as_exact_and_detections_as_certain_as_where_sensors_report_the_direction() {
    let every = undirected("track-b", |_| true);
    let some = undirected("track-b", |number| number % 4 == 0);
    for (layout, seeds) in [(&every, 9_201..9_204), (&some, 9_204..9_207)] {
        for seed in seeds {
            let Session { stops, passed, wrong } = session(layout, seed);
            assert!(stops.len() >= 7 && passed > 60, "seed {seed}: {stops:?}, {passed}");
            assert!(stops.iter().all(|mm| mm.abs() < 60.0), "seed {seed}: {stops:?}");
            assert_eq!(wrong, 0, "seed {seed}: detections in another direction, or of no train");
        }
    }
}

#[test]
fn a_lost_train_is_located_in_its_true_direction_by_two_sensors() {
    let layout = undirected("track-b", |_| true);
    for (seed, is_reversed) in [(9_211, false), (9_211, true), (9_212, false), (9_212, true)] {
        let mut line = world(&layout, seed);
        let mut driver = calibrated(&layout, &mut line);
        let mut session = Session::default();
        if is_reversed {
            driver.order(line.now(), Order::Reverse { train: TRAIN, then: step(0) }).unwrap();
            session.wait(&mut line, &mut driver, 3.0);
        }
        let model = driver.model(TRAIN).unwrap().clone();
        driver.add_train(model);
        driver.order(line.now(), Order::Speed { train: TRAIN, step: step(8) }).unwrap();
        let until = line.now() + TimeSpan::from_s(60.0);
        let mut first = None;
        while first.is_none() {
            match line.drive(&mut driver, until).expect("it is detected") {
                Notice::EitherDirection { train, sensor, .. } => first = Some((train, sensor)),
                Notice::Passed { passed, .. } => panic!("{passed:?} before its direction is known"),
                _ => {}
            }
        }
        assert!(driver.locate(TRAIN, line.now()).is_none(), "either direction");
        session.wait(&mut line, &mut driver, 12.0);
        let located = driver.locate(TRAIN, line.now()).expect("by the next sensor");
        let said = driver.landmark(TRAIN, located.at).unwrap();
        let past = line.station.world.truth().past(TRAIN, layout.sensor_at(said.node).unwrap()).unwrap();
        let error = (said.offset - past).as_mm();
        assert!(error.abs() < 80.0, "seed {seed}: {error} mm");
        assert!(session.passed >= 2 && session.wrong == 0, "seed {seed}: {session:?}");
    }
}

#[test]
fn a_train_that_starts_on_a_sensor_is_found_by_the_next_ones() {
    let layout = undirected("track-a", |_| true);
    let mut line = world(&layout, 9_221);
    line.station.world.lift(TRAIN);
    let sensor = layout.sensor_named("C13").unwrap();
    let (edge, _) = layout.edges().find(|(_, edge)| Some(edge.from) == layout.sensor_node(sensor)).unwrap();
    // Its shoe is on it.
    let position = Position { edge, offset: Length::from_mm(20.0) };
    line.station.world.place(TRAIN, position, End::Nose).unwrap();
    let mut driver = calibrated(&layout, &mut line);
    let mut session = Session::default();
    (0..3).for_each(|_| session.stop(&mut line, &mut driver, 3, 9));
    assert!(session.stops.len() == 3 && session.stops.iter().all(|mm| mm.abs() < 60.0), "{session:?}");
    assert_eq!(session.wrong, 0, "{session:?}");
}
