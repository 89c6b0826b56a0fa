//! What people read of a train's runs beside its model are the true numbers: scatter, changes of speed, laws, and taped stops.
//!
//! The toy railway's truth: 32 mm/s a step, every change at 170 mm/s², 180 ms after its command.
#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::sync::OnceLock;

use footplate_core::link::PollTimingEstimator;
use footplate_core::model::MotionModel;
use footplate_core::model::report::{Review, RunPassages, TwoSensorChange, TwoSensorMean};
use footplate_core::model::survey::SectionIndex;
use footplate_core::{Command, Event, EventKind, Length, SpeedStep, TimeSpan, TrainId};

use crate::toy_railway::{ToyRailway, known_model_both_approaches, layout, step};

const TRAIN: TrainId = TrainId(24);
const MM_PER_S2: f64 = 170.0;
const DELAY_S: f64 = 0.18;

fn model() -> &'static MotionModel {
    static MODEL: OnceLock<MotionModel> = OnceLock::new();
    MODEL.get_or_init(|| known_model_both_approaches(TRAIN.0))
}

/// A run through steps, each for so many seconds; at every standstill a person lays a tape from the sensor passed last.
fn run_through(steps: &[(u8, f64)]) -> RunPassages {
    let mut world = ToyRailway::new(TRAIN.0, "D1", 300.0);
    let mut events: Vec<Event> = Vec::new();
    for (number, seconds) in steps {
        world.command(Command::Speed { train: TRAIN, step: SpeedStep::new(*number).unwrap() });
        let end = world.now + TimeSpan::from_s(*seconds);
        let mut is_at_rest = false;
        while world.now < end {
            events.extend(world.tick());
            if *number == 0 && world.train().speed_mm_per_s == 0.0 && !is_at_rest {
                is_at_rest = true;
                let (_, landmark, _) = *world.passes.last().unwrap();
                let node = world.layout.sensor_node(landmark).unwrap();
                let offset = Length::from_mm(world.beyond_mm(world.layout.node_name(node)));
                let kind = EventKind::Stopped { train: TRAIN, landmark, offset };
                // The middle of the 0.2 to 0.5 s that people take.
                events.push(Event { time: world.now + TimeSpan::from_ms(350), kind });
            }
        }
    }
    let mut timing = PollTimingEstimator::default();
    for event in &events {
        match event.kind {
            EventKind::Sensor(_) => timing.report(event.time),
            EventKind::Speed { .. } => timing.command_sent(),
            _ => {}
        }
    }
    timing.fit(world.now);
    let entries = events.iter().map(|event| (event, false));
    RunPassages::read(&world.layout, TRAIN, SpeedStep::STAND, 0, entries, &timing)
}

fn assert_near(found: f64, expected: f64, tolerance: f64, of: &str) {
    assert!((found - expected).abs() < tolerance, "{of}: {found}, not {expected} ± {tolerance}");
}

#[test]
fn changes_of_speed_are_seen_as_they_were() {
    let (layout, model) = (layout(), model());
    let sections = SectionIndex::of(&layout);
    // Given twelve changes from step 4 to 14 and eleven back, begun all over the circuit,
    let laps = (0..12).map(f64::from).flat_map(|n| [(4, 14.0 + 0.37 * n), (14, 9.0 + 0.23 * n)]);
    let run = run_through(&laps.collect::<Vec<_>>());
    let review = Review::of(&layout, &sections, model, std::slice::from_ref(&run));
    // then its sensors do not scatter, because the toy's do not,
    assert!(review.running.sensor_scatter < Length::from_mm(2.0), "{:?}", review.running.sensor_scatter);
    assert!(review.running.run_deviation < 0.005, "{}", review.running.run_deviation);
    assert_eq!(review.running.suspicious().count(), 0);
    // every change is where the train was, give or take half a poll at either sensor,
    assert!(review.changes.len() > 12, "{}", review.changes.len());
    for change in review.changes.iter().filter(|change| change.steps[0] > SpeedStep::STAND) {
        let [from, to] = change.steps.map(|step| 32.0 * f64::from(step.get()));
        assert_near(change.speeds[0].as_mm_per_s(), from, 0.01 * from, "speed before");
        assert_near(change.speeds[1].as_mm_per_s(), to, 0.01 * to, "speed after");
        let rate = MM_PER_S2.copysign(to - from);
        let distance = |t: f64| {
            let changing = (t - DELAY_S).clamp(0.0, (to - from) / rate);
            from * t.min(DELAY_S)
                + (from + 0.5 * rate * changing) * changing
                + to * (t - DELAY_S - changing).max(0.0)
        };
        let first = change.points[0];
        for point in &change.points {
            let ran = distance(point.since_command) - distance(first.since_command);
            assert_near(1e3 * point.distance, ran, 30.0, "distance (mm)");
        }
        // The curve that is drawn through it begins and ends at these speeds, and residuals are what is beyond it.
        let times = [0.0, 8.0, 9.0].into_iter().chain(change.points.iter().map(|point| point.since_command));
        let times: Vec<TimeSpan> = times.map(TimeSpan::from_s).collect();
        let fitted = review.fitted_change(model, change, &times).unwrap();
        let [begin, settled, later, at_points @ ..] = &fitted.states[..] else { panic!("{fitted:?}") };
        assert_near(begin.speed.as_mm_per_s(), from, 0.01 * from, "speed at the command");
        assert_near(settled.speed.as_mm_per_s(), to, 0.01 * to, "speed at its end");
        assert_near((later.distance - settled.distance).as_mm(), to, 0.01 * to, "distance in a second");
        assert!(begin.acceleration.as_mm_per_s2() == 0.0 && later.acceleration.as_mm_per_s2().abs() < 1.0);
        assert_eq!(fitted.residuals.len(), change.points.len());
        for ((state, point), residual) in at_points.iter().zip(&change.points).zip(&fitted.residuals) {
            assert_near(
                1e3 * point.distance - state.distance.as_mm(),
                residual.as_mm(),
                0.01,
                "residual (mm)",
            );
            assert!(residual.as_mm().abs() < 25.0, "{residual:?}");
        }
    }
    // and two sensors each measure its acceleration.
    let changes =
        TwoSensorChange::find(&layout, &sections, model, &review.running, std::slice::from_ref(&run));
    let means = TwoSensorMean::of(&changes);
    let steps: Vec<_> = means.iter().map(|mean| (mean.steps, mean.acceleration.count)).collect();
    assert_eq!(steps, [([step(4), step(14)], 12), ([step(14), step(4)], 11)]);
    for (mean, expected) in means.iter().zip([MM_PER_S2, -MM_PER_S2]) {
        let found = mean.acceleration.value.as_mm_per_s2();
        assert_near(found, expected, 0.03 * MM_PER_S2, "acceleration (mm/s²)");
        // The delay of a command, known to 0.06 s of two, is common to all changes: a tenth and no less.
        let part = mean.acceleration.uncertainty.as_mm_per_s2() / MM_PER_S2;
        assert_near(part, 0.105, 0.02, "part that is uncertain");
    }
}

#[test]
fn a_taped_stop_is_counted_from_its_command() {
    let (layout, model) = (layout(), model());
    // Given a stop from each of nine steps, the tape laid from the sensor passed last,
    let steps = [4, 6, 8, 10, 12, 14, 9, 7, 13];
    let stops = steps.into_iter().zip((0..9).map(f64::from));
    let run =
        run_through(&stops.flat_map(|(step, n)| [(step, 14.0 + 0.41 * n), (0, 6.0)]).collect::<Vec<_>>());
    let review = Review::of(&layout, &SectionIndex::of(&layout), model, std::slice::from_ref(&run));
    // then each is as long as this railway makes it: 180 ms at speed, and v²/2a.
    let found: Vec<_> = review.stops.iter().map(|stop| stop.step.get()).collect();
    assert_eq!(found, steps);
    let mut off = 0.0;
    for stop in &review.stops {
        let v = 32.0 * f64::from(stop.step.get());
        assert_near(stop.speed.as_mm_per_s(), v, 0.01 * v, "speed (mm/s)");
        let distance = DELAY_S * v + v * v / (2.0 * MM_PER_S2);
        let by = stop.distance.length().as_mm() - distance;
        assert!(by.abs() < 3.0 * stop.uncertainty.as_mm(), "step {}: {by} mm", stop.step);
        off += by / 9.0;
        // A tape and a poll of 65 ms, which is 19 ms at its speed.
        let uncertainty = 5.0_f64.hypot(0.019 * v);
        assert_near(stop.uncertainty.as_mm(), uncertainty, 0.15 * uncertainty, "uncertainty (mm)");
        assert_near(stop.time.unwrap().as_s(), DELAY_S + v / MM_PER_S2, 0.02, "time (s)");
    }
    assert_near(off, 0.0, 5.0, "mean error (mm)");
}

#[test]
fn the_ramp_of_a_decoder_is_its_speeds_over_its_time() {
    for [from, to] in [[4, 14], [0, 8], [14, 4], [8, 0]] {
        let found =
            model().ramp_acceleration(SpeedStep::new(from).unwrap(), SpeedStep::new(to).unwrap()).unwrap();
        let expected = if to > from { MM_PER_S2 } else { -MM_PER_S2 };
        let [value, uncertainty] = [found.value, found.uncertainty].map(|a| a.as_mm_per_s2());
        assert!(
            (value - expected).abs() < uncertainty && uncertainty < 25.0,
            "{value} ± {uncertainty} mm/s²"
        );
    }
    // What does not change is no ramp.
    assert!(model().ramp_acceleration(step(8), step(8)).is_none());
}
