//! A fit and a locator are accurate on the toy railway, which shares no formula with them.

use std::sync::OnceLock;

use footplate_core::link::DetectionWindow;
use footplate_core::model::MotionModel;
use footplate_core::model::survey::SectionIndex;
use footplate_core::tracking::{Locator, PathPoint, TrackContext};
use footplate_core::{Approach, Command, EventKind, Length, Speed, TimeSpan, TrainId};

use crate::toy_railway::{ToyRailway, known_model, step, straight};

const TRAIN: TrainId = TrainId(24);

fn model() -> &'static MotionModel {
    static MODEL: OnceLock<MotionModel> = OnceLock::new();
    MODEL.get_or_init(|| known_model(24))
}

/// Steps of 32 mm/s, changes at 170 mm/s² after 180 ms.
fn true_stopping_distance(speed: Speed) -> Length {
    let v = speed.as_mm_per_s();
    Length::from_mm(0.18 * v + v * v / (2.0 * 170.0))
}

#[test]
fn measured_steps_are_accurate_to_a_per_cent_and_as_stated() {
    for (number, true_mm_per_s) in [(5, 160.0), (8, 256.0), (10, 320.0), (12, 384.0)] {
        let speed = model().speed(step(number), Approach::Below);
        let off = speed.value.as_mm_per_s() - true_mm_per_s;
        assert!(off.abs() < 0.01 * true_mm_per_s, "step {number}: {off} mm/s");
        // The scale of the survey is not observable: half a per cent on this track.
        let deviation = speed.uncertainty.as_mm_per_s().hypot(0.005 * true_mm_per_s);
        assert!(off.abs() < 3.0 * deviation, "step {number}: {off} with {deviation} mm/s");
        assert!(speed.count >= 3);
    }
}

#[test]
fn an_unmeasured_step_has_a_larger_uncertainty() {
    let measured = model().speed(step(8), Approach::Below);
    let between = model().speed(step(9), Approach::Below);
    assert!((between.value.as_mm_per_s() - 288.0).abs() < 3.0 * between.uncertainty.as_mm_per_s() + 3.0);
    assert!(between.uncertainty > 2.0 * measured.uncertainty && between.count == 0);
}

#[test]
fn stops_are_as_long_as_the_railway_makes_them() {
    for number in [4, 5, 8, 10, 12, 14] {
        let speed = model().speed(step(number), Approach::Below).value;
        let stop = model().stop(step(number), Approach::Below);
        let off = stop.distance - true_stopping_distance(speed);
        assert!(
            off.abs() < 3.0 * stop.doubt + Length::from_mm(3.0),
            "step {number}: {stop:?}, off by {off:?}"
        );
        assert!(off.abs() < Length::from_mm(20.0), "step {number}: off by {off:?}");
    }
}

#[test]
fn the_rest_predicted_at_the_command_contains_the_true_one() {
    // Given a train running at step 8,
    let mut world = ToyRailway::new(24, "D1", 300.0);
    let (sections, turnouts) = (SectionIndex::of(&world.layout), straight());
    let layout = world.layout.clone();
    let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
    let mut locator = Locator::new(TRAIN);
    let node = layout.node_named("D1").unwrap();
    locator.place(world.now, PathPoint { node, distance: Length::from_mm(300.0) }, Length::from_mm(3.0));
    world.command(Command::Speed { train: TRAIN, step: step(8) });
    let follow = |world: &mut ToyRailway, locator: &mut Locator, seconds: f64| {
        let (mut inside, mut ticks) = (0, 0);
        let end = world.now + TimeSpan::from_s(seconds);
        while world.now < end {
            for event in world.tick() {
                match event.kind {
                    EventKind::Sensor(report) => {
                        let after = event.time - report.poll_interval.unwrap();
                        let window = DetectionWindow { after, until: event.time };
                        assert!(locator.likelihood(context, model(), report.sensor, window).is_some());
                        locator.pass(context, model(), report.sensor, window);
                    }
                    _ => locator.handle_command(context, model(), &event),
                }
            }
            let located = locator.locate(context, model(), world.now).unwrap();
            // The toy's sensors are where the layout states, so that its path lengths are the layout's.
            let here = footplate_core::tracking::place_of(context, model(), located.at).unwrap();
            let ahead = layout.distance_ahead(here, world.train().at, &turnouts).unwrap_or(Length::ZERO);
            let behind = layout.distance_ahead(world.train().at, here, &turnouts).unwrap_or(Length::ZERO);
            let off = ahead.min(behind);
            ticks += 1;
            inside += i32::from(off < 1.96 * located.uncertainty + Length::from_mm(5.0));
        }
        f64::from(inside) / f64::from(ticks)
    };
    // then its estimated position is correct during acceleration and steady running,
    assert!(follow(&mut world, &mut locator, 14.0) > 0.95);
    // and when it is commanded to stop,
    let before = world.train().travelled_mm;
    let rest = locator.rest_if_stopped(context, model(), world.now).unwrap();
    let here = locator.locate(context, model(), world.now).unwrap();
    world.command(Command::Speed { train: TRAIN, step: step(0) });
    assert!(follow(&mut world, &mut locator, 6.0) > 0.95);
    // the distance run is within the predicted interval.
    let ran = world.train().travelled_mm - before;
    let predicted = (rest.at.distance - here.at.distance).as_mm();
    let deviation = rest.doubt.as_mm().hypot(rest.scatter.as_mm());
    assert!(
        (ran - predicted).abs() < 3.0 * deviation,
        "ran {ran}, predicted {predicted} with {deviation} mm"
    );
    assert!(deviation < 25.0);
    assert!(locator.locate(context, model(), world.now).unwrap().at_rest);
}

#[test]
fn a_report_behind_a_lost_reply_counts_by_its_real_width() {
    // Given a train at step 8, located within 3 mm at every sensor,
    let (mut close, mut blind) = (Vec::new(), Vec::new());
    for seed in 0..12 {
        let mut world = ToyRailway::new(24, "D1", 300.0);
        let (sections, turnouts) = (SectionIndex::of(&world.layout), straight());
        let layout = world.layout.clone();
        let context = TrackContext { layout: &layout, sections: &sections, turnouts: &turnouts };
        let mut locators = [Locator::new(TRAIN), Locator::new(TRAIN)];
        let at = PathPoint { node: layout.node_named("D1").unwrap(), distance: Length::from_mm(300.0) };
        for locator in &mut locators {
            locator.place(world.now, at, Length::from_mm(3.0));
        }
        world.command(Command::Speed { train: TRAIN, step: step(8) });
        let mut reports = 0;
        let last = 5 + seed % 3;
        while reports < last {
            for event in world.tick() {
                let EventKind::Sensor(report) = event.kind else {
                    locators.iter_mut().for_each(|locator| locator.handle_command(context, model(), &event));
                    continue;
                };
                reports += 1;
                let usual =
                    DetectionWindow { after: event.time - report.poll_interval.unwrap(), until: event.time };
                // when the last report follows lost replies, late in its window, or with a usual window,
                let wide = DetectionWindow { after: event.time - TimeSpan::from_ms(730), until: event.time };
                let windows = if reports == last { [usual, wide] } else { [usual, usual] };
                for (locator, window) in locators.iter_mut().zip(windows) {
                    locator.pass(context, model(), report.sensor, window);
                }
            }
        }
        let error = |locator: &Locator| {
            let located = locator.locate(context, model(), world.now).unwrap();
            let here = footplate_core::tracking::place_of(context, model(), located.at).unwrap();
            let ahead = layout.distance_ahead(here, world.train().at, &turnouts).unwrap_or(Length::ZERO);
            let behind = layout.distance_ahead(world.train().at, here, &turnouts).unwrap_or(Length::ZERO);
            let inside = ahead.min(behind) < 1.96 * located.uncertainty;
            (ahead.min(behind).as_mm(), located.uncertainty.as_mm(), inside)
        };
        close.push(error(&locators[0]));
        blind.push(error(&locators[1]));
    }
    // then the train is where it was predicted, with or without the window of 187 mm, and the interval is no longer
    // than the prediction's.
    let mean = |errors: &[(f64, f64, bool)]| errors.iter().map(|(error, ..)| error).sum::<f64>() / 12.0;
    assert!(mean(&blind) < mean(&close) + 4.0, "{:.1} against {:.1} mm", mean(&blind), mean(&close));
    assert!(blind.iter().all(|(_, uncertainty, inside)| *inside && *uncertainty < 12.0), "{blind:?}");
}
