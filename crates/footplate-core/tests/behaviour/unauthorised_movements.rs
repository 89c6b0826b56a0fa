//! What no session drives is noticed, and stops the trains that could meet it.

use footplate_core::control::{Notice, Order, Refusal};
use footplate_core::{Command, SpeedStep};

use crate::toy_railway::step;
use crate::watching::{FIRST, SECOND, Watched};

#[test]
fn what_no_session_drives_stops_trains_until_an_operator_says_that_the_track_is_clear() {
    let mut watched = Watched::two();
    watched.go(FIRST, 8);
    watched.run(6.0);
    let is_raised = |watched: &Watched| {
        watched.notices.iter().any(|notice| matches!(notice, Notice::UnauthorisedMovement { .. }))
    };
    let [one, other] = ["B2", "A2"].map(|name| watched.world.layout.sensor_named(name).expect("a sensor"));
    // A detection by itself may be spurious,
    watched.world.close(one);
    watched.run(6.0);
    assert!(!is_raised(&watched), "{:#?}", watched.notices);
    // one at the next sensor is a movement: a train that could meet it stops and stays.
    let before = watched.commanded.len();
    watched.world.close(other);
    assert!(watched.run_until(10.0, is_raised), "{:#?}", watched.notices);
    // A train at rest may have missed its stop: it is commanded again.
    for train in [FIRST, SECOND] {
        let stop = Command::Speed { train, step: SpeedStep::STAND };
        assert!(watched.commanded[before..].iter().any(|(_, command)| *command == stop), "{train}");
    }
    watched.run(5.0);
    assert!(watched.world.trains.iter().all(|train| train.speed_mm_per_s < 1.0));
    let order = Order::Speed { train: FIRST, step: step(5) };
    let refused = watched.dog.order(watched.world.now, order);
    assert_eq!(refused, Err(Refusal::TrackNotClear));
    watched.run(60.0);
    assert!(watched.dog.has_danger());
    watched.dog.switch_power(watched.world.now, true);
    watched.go(FIRST, 5);
}

#[test]
fn no_train_starts_while_sensors_report_at_random_and_for_three_seconds_after() {
    let mut watched = Watched::two();
    watched.run(10.0);
    let said = |watched: &Watched, what: &Notice| watched.notices.iter().any(|notice| notice == what);
    for name in ["E1", "E2", "C1", "C2"] {
        assert!(!said(&watched, &Notice::Noise), "{:#?}", watched.notices);
        let sensor = watched.world.layout.sensor_named(name).expect("a sensor");
        watched.world.close(sensor);
        watched.run(0.5);
    }
    assert!(said(&watched, &Notice::Noise), "{:#?}", watched.notices);
    let order = Order::Speed { train: FIRST, step: step(5) };
    assert_eq!(watched.dog.order(watched.world.now, order), Err(Refusal::Noise));
    watched.run(2.0);
    assert!(!said(&watched, &Notice::NoiseOver), "{:#?}", watched.notices);
    watched.run(1.0);
    assert!(said(&watched, &Notice::NoiseOver), "{:#?}", watched.notices);
    assert!(watched.dog.order(watched.world.now, order).is_ok());
}

#[test]
fn stops_are_repeated_as_long_as_sensors_report_at_random() {
    // Given a train that runs,
    let mut watched = Watched::two();
    watched.go(FIRST, 3);
    watched.run(1.0);
    // when there is noise,
    for name in ["E1", "E2", "C1", "C2"] {
        let sensor = watched.world.layout.sensor_named(name).expect("a sensor");
        watched.world.close(sensor);
        watched.run(0.1);
    }
    assert!(watched.notices.contains(&Notice::Noise), "{:#?}", watched.notices);
    let before = watched.commanded.len();
    watched.run(2.7);
    // then its stop is commanded again every 0.3 s, also after the two repeats of any alarm: one that is garbled may be step 8.
    assert!(!watched.notices.contains(&Notice::NoiseOver), "{:#?}", watched.notices);
    let stop = Command::Speed { train: FIRST, step: SpeedStep::STAND };
    let stops = watched.commanded[before..].iter().filter(|(_, command)| *command == stop);
    assert_eq!(stops.count(), 8, "{:?}", watched.commanded);
}
