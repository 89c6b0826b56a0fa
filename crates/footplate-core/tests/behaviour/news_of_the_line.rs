//! What is heard of the line: a silent station, a line that garbles data, another throttle.

use footplate_core::control::{Alarm, LinkNews, Machine, Notice, Order, Outcome, Refusal};
use footplate_core::track::Leg;
use footplate_core::{Command, Event, EventKind, Report, SensorId, SpeedStep, TurnoutId};

use crate::toy_railway::step;
use crate::watching::{FIRST, Watched};

#[test]
fn after_a_silent_station_every_train_is_located_again() {
    let mut watched = Watched::one();
    watched.go(FIRST, 9);
    watched.run(8.0);
    watched.dog.handle_link(watched.world.now, LinkNews::Silent);
    watched.run(4.0);
    assert_eq!(watched.alarm(), Some(Alarm::LinkSilent));
    assert_eq!(
        watched.dog.order(watched.world.now, Order::Speed { train: FIRST, step: step(5) }),
        Err(Refusal::InDanger { train: FIRST })
    );
    watched.dog.handle_link(watched.world.now, LinkNews::Answers);
    assert!(watched.run_until(120.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
    assert_eq!(watched.recovered(), Some(Outcome::AsBefore));
}

#[test]
fn stops_are_repeated_as_long_as_the_line_is_not_to_be_relied_on() {
    // Given a train that runs when its line begins to garble data,
    let mut watched = Watched::one();
    watched.go(FIRST, 9);
    watched.run(8.0);
    let before = watched.commanded.len();
    watched.dog.handle_link(watched.world.now, LinkNews::Silent);
    watched.run(3.1);
    // then its stop is commanded at once and every 0.3 s after that: the last of a few may be garbled to another step,
    let stop = Command::Speed { train: FIRST, step: SpeedStep::STAND };
    let stops = |watched: &Watched, from: usize| {
        watched.commanded[from..].iter().filter(|(_, command)| *command == stop).count()
    };
    assert_eq!(stops(&watched, before), 10, "{:?}", watched.commanded);
    // and three times more once the station answers.
    let before = watched.commanded.len();
    watched.dog.handle_link(watched.world.now, LinkNews::Answers);
    watched.run(3.1);
    assert_eq!(stops(&watched, before), 3, "{:?}", watched.commanded);
}

#[test]
fn a_train_that_another_throttle_has_driven_is_stopped_and_located_again() {
    // Given a train that runs at step 9, when another throttle changes its speed,
    let mut watched = Watched::one();
    watched.go(FIRST, 9);
    watched.run(8.0);
    watched.dog.handle_link(watched.world.now, LinkNews::OtherThrottle { train: FIRST });
    watched.run(0.1);
    // then its place is no longer known, and it stops.
    assert_eq!(watched.alarm(), Some(Alarm::Lost));
    let stop = Command::Speed { train: FIRST, step: SpeedStep::STAND };
    assert_eq!(watched.commanded.last().map(|(_, command)| *command), Some(stop));
    assert!(watched.run_until(120.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
    assert_eq!(watched.recovered(), Some(Outcome::AsBefore));
    let truth = watched.world.trains[0].at;
    let located = watched.dog.driver().locate(FIRST, watched.world.now).expect("located");
    let edge = watched.world.layout.edge(truth.edge).expect("on the layout");
    assert_eq!(located.at.node, edge.from);
    assert!((located.at.distance - truth.offset).as_mm().abs() < 40.0, "{located:?}, really {truth:?}");
}

#[test]
fn a_turnout_that_seems_to_lie_otherwise_while_the_line_garbles_data_is_unknown_after_it() {
    // Given a train behind turnout 1, whose straight leg leads to B and whose other leg to C, as far,
    let mut watched = Watched::one();
    watched.go(FIRST, 9);
    watched.run(5.45);
    assert_eq!(watched.dog.driver().turnouts().get(TurnoutId(1)), Some(Leg::Straight));
    // when noise makes a report of C while replies are garbled,
    watched.dog.handle_link(watched.world.now, LinkNews::Silent);
    let (time, sensor) = (watched.world.now, SensorId(4));
    let report = EventKind::Sensor(Report { sensor, poll_interval: None });
    watched.dog.handle_event(time, &Event { time, kind: report });
    watched.run(0.1);
    let is_mismatch = |notice: &Notice| matches!(notice, Notice::TurnoutMismatch { curved: true, .. });
    assert!(watched.notices.iter().any(is_mismatch), "{:#?}", watched.notices);
    // then that counts no longer once the line is clean: a person who places the train next to it may mean either leg.
    watched.dog.handle_link(watched.world.now, LinkNews::Answers);
    assert_eq!(watched.dog.driver().turnouts().get(TurnoutId(1)), None);
}
