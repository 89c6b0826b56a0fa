//! Layouts of blocks: from both edges of their detectors to trains that stop where they should.

use footplate_core::control::{Aim, Driver, Machine, Notice, Order, Output, StopOrder};
use footplate_core::track::{Landmark, Layout, Position, TurnoutStates};
use footplate_core::tracking::Locator;
use footplate_core::{Command, Event, EventKind, Length, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_eval::testbed::{Calibrated, VirtualLine, calibrate};
use footplate_sim::{End, LawFamily, LivingSwitches, VirtualStation};
use footplate_store::{built_in, parse_layout};

const ONE: TrainId = TrainId(24);
const OTHER: TrainId = TrainId(58);
/// Where trains are put by hand: on this edge of `oval-blocks`, clear of both its boundaries.
const PLACED_MM: f64 = 650.0;

fn oval() -> Layout {
    built_in("oval-blocks").unwrap().layout
}

fn world<'l>(layout: &'l Layout, seed: u64, trains: &[TrainId]) -> VirtualLine<'l> {
    let switches = LivingSwitches { law: Some(LawFamily::SCurve), ..LivingSwitches::well_kept() };
    VirtualLine::open(VirtualStation::draw(layout, seed, trains, &switches).unwrap()).unwrap()
}

fn step(number: u8) -> SpeedStep {
    SpeedStep::new(number).unwrap()
}

/// Sends one command, and collects what it hears.
struct Listener {
    command: Option<Command>,
    heard: Vec<Event>,
}

impl Machine for Listener {
    type Notice = ();
    fn handle_event(&mut self, _: Timestamp, event: &Event) {
        self.heard.push(*event);
    }
    fn handle_timeout(&mut self, _: Timestamp) {}
    fn poll_output(&mut self) -> Option<Output<()>> {
        self.command.take().map(Output::Command)
    }
    fn next_timeout(&self) -> Option<Timestamp> {
        None
    }
}

#[test]
fn a_block_is_occupied_from_the_front_of_a_train_until_its_rear_has_left() {
    let layout = oval();
    let mut line = world(&layout, 5, &[ONE]);
    let command = Some(Command::Speed { train: ONE, step: step(10) });
    let mut listener = Listener { command, heard: Vec::new() };
    line.drive(&mut listener, Timestamp::from_s(40.0));
    let truth = line.station.world.truth();
    let length = truth.sensed_length(ONE).unwrap().as_mm();
    let (mut entered, mut freed) = (0, 0);
    for event in &listener.heard {
        match event.kind {
            EventKind::Sensor(report) => {
                let pass = truth.passes().iter().rev().find(|pass| {
                    pass.sensor == report.sensor && pass.train == Some(ONE) && pass.at <= event.time
                });
                let late = event.time - pass.unwrap().at;
                assert!(late < TimeSpan::from_ms(200), "{late:?}: a pickup delay and a poll of all modules");
                entered += 1;
            }
            EventKind::Freed(report) => {
                // The boundary by which the train left, and when its rear was there.
                let passes = truth.passes().iter().filter(|pass| pass.train == Some(ONE));
                let mut left = passes.filter(|pass| {
                    let node = layout.sensor_node(pass.sensor).unwrap();
                    layout.block_left_at(node).is_some_and(|block| block.detector == report.sensor)
                });
                let left = left.rfind(|pass| pass.at < event.time).unwrap();
                let since = (event.time - left.at).as_s();
                let delay = truth.release_delay(report.sensor).unwrap().as_s();
                let speed = truth.train(ONE).unwrap().speed.as_mm_per_s();
                assert!((since - delay - length / speed).abs() < 0.5, "{since} s after the front");
                freed += 1;
            }
            _ => {}
        }
    }
    assert!(entered >= 5 && freed >= 4, "{entered} and {freed}");
}

#[test]
fn a_train_is_calibrated_stopped_and_measured_by_blocks_alone() {
    let layout = oval();
    let mut line = world(&layout, 23_327, &[ONE]);
    let Calibrated { model, locator, turnouts, seconds, ending, .. } =
        calibrate(&layout, &mut line, ONE, TimeSpan::from_s(480.0));
    assert!(seconds <= 481.0 && ending.contains("Budget"), "{seconds} s, {ending}");
    let (found, truth) = (model.train_length().known().unwrap(), line.station.world.truth());
    let error = (found.value - truth.sensed_length(ONE).unwrap()).as_mm();
    assert!(error.abs() < 10.0 && error.abs() < 3.0 * found.uncertainty.as_mm(), "{error} mm, {found:?}");

    let mut driver = Driver::new(layout.clone(), turnouts);
    driver.add_located(model, locator);
    for (name, offset) in [("B5", 0.0), ("B9", 300.0), ("B3", -150.0), ("B7", 10.0)] {
        // In the direction in which it was put down.
        let node = layout.node_named(name).unwrap();
        let now = line.now();
        let mut stop = |node| {
            let target = Landmark { node, offset: Length::from_mm(offset) };
            let order =
                StopOrder { train: ONE, target, aim: Aim::Median, step: Some(step(9)), next_round: true };
            driver.order(now, Order::Stop(order)).map(|_| target)
        };
        let target = stop(node).or_else(|_| stop(node.reverse())).unwrap();
        let until = line.now() + TimeSpan::from_s(60.0);
        while !matches!(line.drive(&mut driver, until).expect("it stops"), Notice::Done(_)) {}
        line.drive(&mut driver, line.now() + TimeSpan::from_s(2.0));
        let past = line.station.world.truth().past(ONE, layout.sensor_at(target.node).unwrap());
        let error = past.unwrap().as_mm() - offset;
        assert!(error.abs() < 40.0, "{name}{offset:+}: {error} mm");
    }
}

/// Drives for a time, then compares each train with the truth.
fn drive_and_compare(line: &mut VirtualLine<'_>, driver: &mut Driver, layout: &Layout, seconds: f64) {
    let until = line.now() + TimeSpan::from_s(seconds);
    while line.drive(driver, until).is_some() {}
    for train in [ONE, OTHER] {
        let located = driver.locate(train, line.now()).expect("both are located");
        let said = driver.landmark(train, located.at).unwrap();
        let truth = line.station.world.truth();
        let past = truth.past(train, layout.sensor_at(said.node).unwrap()).unwrap();
        let error = (said.offset - past).as_mm();
        assert!(error.abs() < 50.0, "train {train} at {}: {error} mm", layout.display(said));
    }
}

#[test]
fn two_trains_on_six_blocks_are_kept_apart_and_found_again_after_reversing() {
    let layout = oval();
    let mut line = world(&layout, 3, &[ONE, OTHER]);
    let place = |nth: usize| {
        let (edge, _) = layout.edges().nth(nth).unwrap();
        Position { edge, offset: Length::from_mm(PLACED_MM) }
    };
    let mut driver = Driver::new(layout.clone(), TurnoutStates::unknown());
    for train in [ONE, OTHER] {
        [ONE, OTHER].into_iter().for_each(|all| line.station.world.lift(all));
        line.station.world.place(train, place(0), End::Nose).unwrap();
        let found = calibrate(&layout, &mut line, train, TimeSpan::from_s(240.0));
        driver.add_located(found.model, Locator::new(train));
    }
    [ONE, OTHER].into_iter().for_each(|all| line.station.world.lift(all));
    line.station.world.place(ONE, place(4), End::Nose).unwrap();
    line.station.world.place(OTHER, place(0), End::Nose).unwrap();
    let wait = |line: &mut VirtualLine<'_>, driver: &mut Driver, seconds: f64| {
        let until = line.now() + TimeSpan::from_s(seconds);
        while line.drive(driver, until).is_some() {}
    };
    wait(&mut line, &mut driver, 6.0);
    for train in [ONE, OTHER] {
        driver.order(line.now(), Order::Speed { train, step: step(8) }).unwrap();
        wait(&mut line, &mut driver, 8.0);
        driver.order(line.now(), Order::Speed { train, step: step(0) }).unwrap();
        wait(&mut line, &mut driver, 5.0);
    }
    for reversed in [false, true] {
        for train in [ONE, OTHER] {
            if reversed {
                driver.order(line.now(), Order::Reverse { train, then: step(0) }).unwrap();
                wait(&mut line, &mut driver, 1.0);
            }
            let speed = Speed::from_mm_per_s(220.0);
            driver.order(line.now(), Order::Hold { train, speed }).unwrap();
        }
        // Until each has passed a boundary in the new direction.
        wait(&mut line, &mut driver, 8.0);
        for _ in 0..8 {
            drive_and_compare(&mut line, &mut driver, &layout, 4.1);
        }
        for train in [ONE, OTHER] {
            driver.order(line.now(), Order::Speed { train, step: step(0) }).unwrap();
        }
        wait(&mut line, &mut driver, 5.0);
    }
    let truth = line.station.world.truth();
    assert!([ONE, OTHER].iter().all(|train| !truth.train(*train).unwrap().is_wrecked));
}

#[test]
fn sensors_and_blocks_locate_a_train_together() {
    let text = r#"
        format = 1
        name = "mixed"
        length_uncertainty_mm = 3
        length_origin = "made up"
        sensors = [
          { names = ["C1", "C2"], numbers = [20, 21] },
          { names = ["C3", "C4"], numbers = [22, 23] },
          { names = ["C5", "C6"], numbers = [24, 25] },
        ]
        blocks = [{ name = "platform", number = 0 }, { name = "curve", number = 1 }]
        boundaries = [
          { names = ["B1", "B2"], enters = ["platform", ""] },
          { names = ["B3", "B4"], enters = ["curve", "platform"] },
          { names = ["B5", "B6"], enters = ["", "curve"] },
        ]
        edges = [
          { from = "B1", to = "C1", mm = 400 },
          { from = "C1", to = "B3", mm = 500 },
          { from = "B3", to = "B5", mm = 1100 },
          { from = "B5", to = "C3", mm = 600 },
          { from = "C3", to = "C5", mm = 900 },
          { from = "C5", to = "B1", mm = 700 },
        ]
    "#;
    let layout = parse_layout("mixed.toml", text.as_bytes()).unwrap().layout;
    let mut line = world(&layout, 2, &[ONE]);
    let found = calibrate(&layout, &mut line, ONE, TimeSpan::from_s(480.0));
    assert!(found.ending.contains("Budget"), "{}", found.ending);
    let truth = line.station.world.truth();
    let length = found.model.train_length().length();
    let error = (length.value - truth.sensed_length(ONE).unwrap()).as_mm();
    assert!(length.count > 0 && error.abs() < 3.0 * length.uncertainty.as_mm(), "{error} mm, {length:?}");
    let speed = |nth| found.model.speed(step(nth), footplate_core::Approach::Below);
    let known = (5..=14).filter(|nth| {
        let true_speed = truth.engine(ONE).unwrap().speeds.speed(step(*nth), footplate_core::Approach::Below);
        (speed(*nth).value.as_mm_per_s() / true_speed.as_mm_per_s() - 1.0).abs() < 0.08
    });
    assert!(known.count() >= 8, "most speeds are known");
}
