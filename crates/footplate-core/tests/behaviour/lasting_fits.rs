//! A model that learns for long stays accurate: outliers get their due weight, and old trips become a prior.

use footplate_core::model::survey::SectionIndex;
use footplate_core::model::{MeasuredRatio, MotionFit, Rescaling};
use footplate_core::{Approach, Command, EdgeId, Event, EventKind, Length, SpeedStep, TimeSpan, TrainId};

use crate::toy_railway::{ToyRailway, step, straight};

const TRAIN: TrainId = TrainId(24);
/// The knee of a train with other laws.
const KNEE_MM_PER_S: f64 = 150.0;

/// The toy's trains run at 32 mm/s a step and stop at 170 mm/s², 180 ms after the command.
fn true_stop_mm(number: u8) -> f64 {
    let v = 32.0 * f64::from(number);
    0.18 * v + v * v / (2.0 * 170.0)
}

/// Runs at one step for some seconds and comes to rest; the start command is recorded too late by a time.
fn trip(world: &mut ToyRailway, fit: &mut MotionFit, number: u8, noted_later: TimeSpan) {
    for (commanded, seconds) in [(step(number), 9.0), (SpeedStep::STAND, 5.0)] {
        world.command(Command::Speed { train: TRAIN, step: commanded });
        let end = world.now + TimeSpan::from_s(seconds);
        while world.now < end {
            for event in world.tick() {
                let is_start =
                    matches!(event.kind, EventKind::Speed { step, .. } if step != SpeedStep::STAND);
                let time = event.time + if is_start { noted_later } else { TimeSpan::ZERO };
                fit.take(&world.layout, &straight(), &Event { time, ..event });
            }
        }
    }
}

fn stops_mm(fit: &MotionFit) -> Vec<(u8, f64, f64)> {
    let of = |number| {
        let stop = fit.model().stop(step(number), Approach::Below);
        (number, stop.distance.as_mm(), stop.doubt.as_mm())
    };
    [4, 6, 8, 10, 12].into_iter().map(of).collect()
}

/// An evening of stops in which one start at step 10 is early by a time.
fn after_an_evening(early: TimeSpan) -> Vec<(u8, f64, f64)> {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let sections = SectionIndex::of(&world.layout);
    let mut fit = MotionFit::new(TRAIN, step(14));
    for (nth, number) in [8, 12, 4, 10, 6, 8, 4, 12, 6, 10, 8, 4, 10, 6, 8, 4, 12, 6].into_iter().enumerate()
    {
        trip(&mut world, &mut fit, number, if nth == 12 { early } else { TimeSpan::ZERO });
        fit.refit(&sections);
    }
    stops_mm(&fit)
}

#[test]
fn one_start_that_is_45_mm_early_moves_no_stop_by_more_than_a_tenth_of_that() {
    // At step 10 a train runs 45 mm in 0.14 s.
    let usual = after_an_evening(TimeSpan::ZERO);
    for ((number, usual, _), (_, early, claimed)) in
        usual.into_iter().zip(after_an_evening(TimeSpan::from_ms(140)))
    {
        let truth = true_stop_mm(number);
        assert!(
            (early - usual).abs() < 4.5,
            "step {number}: {usual} mm without it, {early} mm with it, true {truth}"
        );
        assert!((early - truth).abs() < 2.0 * claimed, "step {number}: {early} ± {claimed} mm, true {truth}");
    }
}

#[test]
fn after_three_hundred_stops_a_model_is_as_accurate_as_stated() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let sections = SectionIndex::of(&world.layout);
    let mut fit = MotionFit::new(TRAIN, step(14));
    for round in 0..60 {
        for number in [8, 12, 4, 10, 6] {
            trip(&mut world, &mut fit, number, TimeSpan::ZERO);
        }
        if round % 3 == 0 {
            fit.refit(&sections);
        }
        if round == 30 {
            fit.begin_session(&sections);
        }
    }
    fit.refit(&sections);
    for (number, distance, deviation) in stops_mm(&fit) {
        let off = distance - true_stop_mm(number);
        assert!(
            off.abs() < 3.0 * deviation + 2.0 && off.abs() < 6.0,
            "step {number}: off by {off} ± {deviation} mm"
        );
        // The fit leaves 6 mm, and no sum of a stop and a start tells another 7 mm (`END_OF_STOP_TIME`).
        assert!(deviation < 9.2, "step {number}: ± {deviation} mm after 300 stops");
        let speed = fit.model().speed(step(number), Approach::Below);
        let off = speed.value.as_mm_per_s() / (32.0 * f64::from(number)) - 1.0;
        assert!(off.abs() < 0.01, "step {number}: {off}");
        assert!(speed.count >= 60, "all sensors count: {}", speed.count);
    }
}

#[test]
fn a_train_that_was_measured_again_goes_on_learning_from_there() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let sections = SectionIndex::of(&world.layout);
    let mut fit = MotionFit::new(TRAIN, step(14));
    for number in [8, 12, 4, 10, 6, 8, 4, 12, 6, 10, 8, 4, 10, 6] {
        trip(&mut world, &mut fit, number, TimeSpan::ZERO);
        fit.refit(&sections);
    }
    // Its wheels get dirty: everything takes as long as before over four fifths of the distance. A recovery measures three speeds.
    world.trains[0].wheels = 0.8;
    let measured =
        [5, 8, 11].map(|number| MeasuredRatio { step: step(number), ratio: 0.8, deviation: 0.006 });
    let change = Rescaling::of(measured.to_vec());
    fit.change(&fit.model().changed_numbers(&change));
    let deviations = |fit: &MotionFit| stops_mm(fit).into_iter().map(|(_, _, deviation)| deviation);
    let changed: Vec<f64> = deviations(&fit).collect();
    for number in [8, 12, 4, 10, 6, 8, 4, 12, 6, 10, 8, 4, 10, 6] {
        trip(&mut world, &mut fit, number, TimeSpan::ZERO);
        fit.refit(&sections);
    }
    for (number, distance, deviation) in stops_mm(&fit) {
        let off = distance - 0.8 * true_stop_mm(number);
        assert!(off.abs() < 2.0 * deviation, "step {number}: off by {off} ± {deviation} mm");
        let speed = fit.model().speed(step(number), Approach::Below).value.as_mm_per_s();
        let off = speed / (0.8 * 32.0 * f64::from(number)) - 1.0;
        assert!(off.abs() < 0.015, "step {number}: {off}");
    }
    // It knows its stops better than right after the recovery.
    assert!(
        deviations(&fit).zip(&changed).all(|(now, then)| now < 0.9 * then),
        "{changed:?}, {:?}",
        stops_mm(&fit)
    );
}

/// How much further a train rolls if it comes to rest on the falling hop (mm).
const DOWNHILL_MM: f64 = 25.0;

/// Where a train with a knee at 150 mm/s comes to rest, 180 ms after the command and in steps of a millisecond.
fn true_stop_with_knee_mm(number: u8) -> f64 {
    let mut v = 32.0 * f64::from(number);
    let mut distance = 0.18 * v;
    while v > 0.0 {
        v -= 0.170 * (0.4 + 0.6 * v / KNEE_MM_PER_S);
        distance += 1e-3 * v.max(0.0);
    }
    distance
}

#[test]
fn stops_of_a_train_with_other_laws_are_as_accurate_as_stated() {
    // Given a train that accelerates at constant power, which no law of the model does,
    let mut world = ToyRailway::new(24, "D1", 300.0);
    world.trains[0].knee = Some(KNEE_MM_PER_S);
    let sections = SectionIndex::of(&world.layout);
    let mut fit = MotionFit::new(TRAIN, step(14));
    for number in [8, 12, 4, 10, 6, 13, 9].into_iter().cycle().take(120) {
        trip(&mut world, &mut fit, number, TimeSpan::ZERO);
        fit.refit(&sections);
    }
    // then an error that its starts would hide is within what is claimed of its stops.
    for (number, stop, claimed) in stops_mm(&fit) {
        let truth = true_stop_with_knee_mm(number);
        assert!(
            (stop - truth).abs() < 2.0 * claimed,
            "step {number}: {stop} ± {claimed} mm, true {truth}; {:?}",
            fit.model().numbers().residual_scales
        );
    }
}

#[test]
fn a_train_that_is_located_while_it_accelerates_does_not_count_as_steady() {
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let sections = SectionIndex::of(&world.layout);
    let mut fit = MotionFit::new(TRAIN, step(14));
    for number in [8, 12, 4, 10, 6].into_iter().cycle().take(20) {
        trip(&mut world, &mut fit, number, TimeSpan::ZERO);
        fit.refit(&sections);
    }
    let before = stops_mm(&fit);
    // Given a session that begins at an unknown place, and a stop as soon as the train is located,
    fit.begin_session(&sections);
    world.command(Command::Speed { train: TRAIN, step: step(12) });
    let mut located_at = None;
    let end = world.now + TimeSpan::from_s(15.0);
    while world.now < end {
        for event in world.tick() {
            if located_at.is_none() && matches!(event.kind, EventKind::Sensor(_)) {
                located_at = Some(world.trains[0].speed_mm_per_s);
                fit.lose_place();
                world.command(Command::Speed { train: TRAIN, step: SpeedStep::STAND });
            }
            fit.take(&world.layout, &straight(), &event);
        }
    }
    trip(&mut world, &mut fit, 6, TimeSpan::ZERO);
    fit.refit(&sections);
    // then stops are what they were.
    for ((number, before, _), (_, after, _)) in before.into_iter().zip(stops_mm(&fit)) {
        assert!(
            (after - before).abs() < 8.0,
            "step {number}: {before} mm, then {after} mm; located at {located_at:?} mm/s"
        );
    }
}

#[test]
fn stops_downhill_are_learnt_to_be_longer_only_there() {
    // Given a circuit of three hops, one of them falling,
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let sections = SectionIndex::of(&world.layout);
    let mut fit = MotionFit::new(TRAIN, step(14));
    let falls = EdgeId(12);
    for number in [8, 12, 5, 10, 6, 9, 7].into_iter().cycle().take(150) {
        trip(&mut world, &mut fit, number, TimeSpan::ZERO);
        let at = world.trains[0].at;
        let further =
            world.layout.advance(at, Length::from_mm(DOWNHILL_MM), &world.turnouts).expect("a circuit");
        if at.edge == falls && further.edge == falls {
            world.trains[0].at = further;
        }
        fit.refit(&sections);
    }
    // then stops there are longer than elsewhere by that length.
    let offsets = fit.model().numbers().stop_offsets;
    let downhill = usize::from(falls.0);
    let (there, elsewhere): (Vec<_>, Vec<_>) = offsets.iter().partition(|(edge, ..)| *edge == downhill);
    let mean = |of: &[(usize, f64, f64)]| {
        of.iter().map(|(_, offset, _)| 1e3 * offset).sum::<f64>() / of.len() as f64
    };
    let difference = mean(&there) - mean(&elsewhere);
    assert!((difference - DOWNHILL_MM).abs() < 8.0, "{difference} mm: {offsets:?}");
}
