//! Trains in danger come back into service, or wait where creeping is not permitted.

use footplate_core::control::{Alarm, LinkNews, Notice, Order, Refusal, Reservation};
use footplate_core::track::Leg;
use footplate_core::tracking::PathPoint;
use footplate_core::{Command, Length, SensorId, SpeedStep, TimeSpan, TurnoutId};

use crate::watching::{FIRST, SECOND, Watched};

#[test]
fn a_train_stopped_in_the_instant_of_its_start_is_recovered() {
    // Its start is confirmed after its stop was commanded, and does not revoke it.
    let mut watched = Watched::one();
    watched.go(FIRST, 8);
    watched.dog.distrust(watched.world.now, FIRST);
    assert!(watched.run_until(120.0, |watched| watched.recovered().is_some()), "{:?}", watched.notices);
}

#[test]
fn the_first_train_asked_waits_for_the_answer() {
    let mut watched = Watched::asking();
    let asked = |notice: &Notice| matches!(notice, Notice::AsksToCreep { train: FIRST });
    assert_eq!(watched.notices.iter().filter(|notice| asked(notice)).count(), 1);
    assert!(watched.world.trains[0].speed_mm_per_s < 1.0);
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    assert!(watched.run_until(120.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
}

/// A train under a dispatcher that was located and runs to be measured again.
fn measured_again() -> Watched {
    let mut watched = Watched::asking();
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    let is_located =
        |watched: &Watched| watched.notices.iter().any(|notice| matches!(notice, Notice::Located { .. }));
    assert!(watched.run_until(60.0, is_located), "{:#?}", watched.notices);
    watched.run(1.0);
    watched
}

#[test]
fn a_train_lost_again_on_reserved_track_does_not_creep_on() {
    let mut watched = measured_again();
    let from = watched.commanded.len();
    // when its position is lost,
    watched.dog.lose(watched.world.now, FIRST);
    watched.run(0.5);
    // then it reverses towards the sensor that it ran over, instead of creeping on into track that may end.
    let first = watched.commanded.get(from).map(|(_, command)| *command);
    assert_eq!(first, Some(Command::Speed { train: FIRST, step: SpeedStep::STAND }));
    assert!(watched.run_until(10.0, |watched| {
        watched.commanded.iter().skip(from).any(|(_, command)| matches!(command, Command::Reverse { .. }))
    }));
}

#[test]
fn a_train_whose_rear_is_on_points_that_it_pushed_over_does_not_creep_back() {
    for lies in [Some(Leg::Straight), Some(Leg::Curved), None] {
        // Given a train under a dispatcher, and turnout 2, whose points it trails 200 mm before D1, set for its leg or not, or in an
        // unknown position, because the station was silent when they were to move,
        let mut watched = Watched::asking();
        watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
        assert!(watched.run_until(200.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
        watched.run(5.0);
        let throw = Order::Turnout { turnout: TurnoutId(2), curved: lies != Some(Leg::Straight) };
        if lies.is_none() {
            watched.dog.handle_link(watched.world.now, LinkNews::Silent);
            watched.dog.order(watched.world.now, throw).expect("a turnout");
            watched.run(1.0);
            watched.dog.handle_link(watched.world.now, LinkNews::Answers);
            watched.run(1.0);
        }
        watched.go(FIRST, 4);
        let [a1, d1] = [0, 6].map(SensorId);
        let reaches = |watched: &mut Watched, sensor: SensorId| {
            let passes = watched.world.passes.len();
            watched.run_until(120.0, |watched| {
                watched.world.passes.iter().skip(passes).any(|(_, at, _)| *at == sensor)
            })
        };
        assert!(reaches(&mut watched, a1), "{:#?}", watched.notices);
        if lies.is_some() {
            watched.dog.order(watched.world.now, throw).expect("a turnout");
            watched.run(1.0);
        }
        assert_eq!(watched.dog.driver().turnouts().get(TurnoutId(2)), lies);
        let from = watched.commanded.len();
        assert!(reaches(&mut watched, d1), "{:#?}", watched.notices);
        watched.run(0.2);
        // when its position is lost just behind D1,
        watched.dog.lose(watched.world.now, FIRST);
        watched.run(8.0);
        watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
        watched.run(12.0);
        // then it reverses only if the points lie for the leg that it came from.
        let reverses = |(_, command): &(_, Command)| matches!(command, Command::Reverse { .. });
        let is_reversed = watched.commanded.iter().skip(from).any(reverses);
        assert_eq!(is_reversed, lies == Some(Leg::Straight), "{lies:?}: {:#?}", watched.notices);
    }
}

#[test]
fn a_train_that_sets_out_backward_is_stopped_by_the_sensor_behind_it() {
    // Given a train whose decoder lost its direction, and another that runs,
    let mut watched = Watched::two();
    watched.world.turn_around(FIRST);
    watched.go(FIRST, 8);
    // when the sensor behind it reports it,
    let passed = |watched: &Watched| !watched.world.passes.is_empty();
    assert!(watched.run_until(20.0, passed));
    let (at, sensor, _) = watched.world.passes[0];
    // then the train is known to run there, and stops: no second report is needed, and no other train is suspected.
    assert!(watched.run_until(2.0, |watched| watched.alarm().is_some()), "{:#?}", watched.notices);
    assert_eq!(watched.alarm(), Some(Alarm::Elsewhere(sensor)));
    assert!(watched.world.now - at < TimeSpan::from_ms(300));
    watched.run(5.0);
    assert!(watched.world.trains[0].speed_mm_per_s < 1.0);
    assert!(watched.dog.is_in_danger(FIRST));
}

#[test]
fn a_train_that_was_turned_does_not_resume_its_order() {
    for is_turned in [false, true] {
        // Given a train that runs,
        let mut watched = Watched::one();
        watched.go(FIRST, 8);
        watched.run(12.0);
        // when it is turned by hand, or only no longer trusted,
        if is_turned {
            watched.world.turn_around(FIRST);
        } else {
            watched.dog.distrust(watched.world.now, FIRST);
        }
        assert!(watched.run_until(200.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
        watched.run(3.0);
        // then its order is cancelled if its direction is another than the one for which it was given.
        let is_resumed = watched.notices.iter().any(|notice| matches!(notice, Notice::Resumed { .. }));
        let is_cancelled = watched.notices.iter().any(|notice| matches!(notice, Notice::Cancelled { .. }));
        assert_eq!((is_resumed, is_cancelled), (!is_turned, is_turned), "{:#?}", watched.notices);
    }
}

#[test]
fn a_turned_train_that_is_held_for_another_one_does_not_resume_its_order_either() {
    // Given a train that was turned by hand while it ran, and another one in danger just before it is back in service,
    let mut watched = Watched::with_another_at("E1", 300.0);
    watched.go(FIRST, 8);
    watched.run(12.0);
    watched.world.turn_around(FIRST);
    let is_measured = |watched: &Watched| {
        watched.notices.iter().any(|notice| matches!(notice, Notice::SpeedMeasured { .. }))
    };
    assert!(watched.run_until(200.0, is_measured), "{:#?}", watched.notices);
    watched.dog.distrust(watched.world.now, SECOND);
    // when it is back before the other one is,
    assert!(watched.run_until(200.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
    assert!(!watched.dog.is_in_danger(FIRST) && watched.dog.is_in_danger(SECOND), "{:#?}", watched.notices);
    // then its order is cancelled, and does not wait for the other one's recovery.
    let is_cancelled = |notice: &Notice| matches!(notice, Notice::Cancelled { train, .. } if *train == FIRST);
    assert!(watched.notices.iter().any(is_cancelled), "{:#?}", watched.notices);
    assert!(watched.dog.is_held(FIRST));
}

#[test]
fn a_train_that_a_person_places_is_searched_no_more() {
    // Given a train that creeps to be located,
    let mut watched = Watched::asking();
    watched.dog.lose(watched.world.now, FIRST);
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    let creeps = |watched: &Watched| watched.world.trains[0].speed_mm_per_s > 20.0;
    assert!(watched.run_until(60.0, creeps), "{:#?}", watched.notices);
    // when a person says where it is,
    let node = watched.world.layout.node_named("D1").expect("a node");
    let at = PathPoint { node, distance: Length::from_mm(100.0) };
    watched.dog.place(watched.world.now, FIRST, at, Length::from_mm(3.0));
    // then it stops, and is at the operator's disposal.
    watched.run(8.0);
    assert!(watched.world.trains[0].speed_mm_per_s < 1.0, "{:#?}", watched.notices);
    assert!(!watched.dog.is_held(FIRST));
}

#[test]
fn a_train_that_a_person_places_while_it_is_measured_stops_and_waits_to_be_measured_again() {
    let mut watched = measured_again();
    let from = watched.commanded.len();
    // when a person says where it is, as of a train at rest,
    let node = watched.world.layout.node_named("D1").expect("a node");
    let at = PathPoint { node, distance: Length::from_mm(100.0) };
    watched.dog.place(watched.world.now, FIRST, at, Length::from_mm(3.0));
    watched.run(8.0);
    // then it is stopped at once, and asks again before it moves.
    let commanded: Vec<Command> = watched.commanded.iter().skip(from).map(|(_, command)| *command).collect();
    let stop = Command::Speed { train: FIRST, step: SpeedStep::STAND };
    assert!(!commanded.is_empty() && commanded.iter().all(|command| *command == stop), "{commanded:?}");
    assert!(watched.world.trains[0].speed_mm_per_s < 1.0, "{:#?}", watched.notices);
    let asked = watched.notices.iter().filter(|notice| matches!(notice, Notice::AsksToCreep { .. })).count();
    assert_eq!(asked, 2, "{:#?}", watched.notices);
}

#[test]
fn a_train_that_reversed_to_be_located_faces_as_before() {
    // Given a lost train that creeps back over the track that it came from,
    let mut watched = Watched::asking();
    watched.dog.lose(watched.world.now, FIRST);
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    // when it is measured and back in service,
    let is_recovered = |watched: &Watched| {
        watched.notices.iter().any(|notice| matches!(notice, Notice::Recovered { train: FIRST, .. }))
    };
    assert!(watched.run_until(200.0, is_recovered), "{:#?}", watched.notices);
    // then it has reversed twice, and an order that waited for it goes on in its direction.
    let reversed = watched.commanded.iter().filter(|(_, command)| matches!(command, Command::Reverse { .. }));
    assert_eq!(reversed.count(), 2);
    assert!(watched.dog.driver().locate(FIRST, watched.world.now).is_some());
    assert!(watched.world.trains[0].speed_mm_per_s < 1.0);
}

#[test]
fn a_turnout_that_was_to_move_while_the_station_was_silent_is_unknown() {
    for (silent_after_s, leg) in [(10.0, Some(Leg::Curved)), (1.5, None)] {
        let mut watched = Watched::one();
        let throw = Order::Turnout { turnout: TurnoutId(1), curved: true };
        watched.dog.order(watched.world.now, throw).expect("no train is on it");
        watched.run(silent_after_s);
        watched.dog.handle_link(watched.world.now, LinkNews::Silent);
        assert_eq!(watched.dog.driver().turnouts().get(TurnoutId(1)), leg, "{silent_after_s} s");
        // Commanded again, it is known.
        watched.dog.handle_link(watched.world.now, LinkNews::Answers);
        watched.dog.order(watched.world.now, throw).expect("no train is on it");
        watched.run(1.0);
        assert_eq!(watched.dog.driver().turnouts().get(TurnoutId(1)), Some(Leg::Curved));
    }
}

/// A train that creeps to be located, and how many commands there were by then.
fn creeping() -> (Watched, usize) {
    let mut watched = Watched::asking();
    watched.dog.lose(watched.world.now, FIRST);
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    let creeps = |watched: &Watched| watched.world.train().speed_mm_per_s > 20.0;
    assert!(watched.run_until(60.0, creeps), "{:#?}", watched.notices);
    let so_far = watched.commanded.len();
    (watched, so_far)
}

/// Nothing has made the train move since, and a person is asked to help.
fn stays_at_rest(watched: &Watched, since: usize) {
    let moves = |command: &Command| match command {
        Command::Speed { step, .. } => *step > SpeedStep::STAND,
        Command::Reverse { .. } => true,
        _ => false,
    };
    let moved = watched.commanded.iter().skip(since).find(|(_, command)| moves(command));
    assert_eq!(moved, None, "{:#?}", watched.notices);
    let asks = |notice: &&Notice| matches!(notice, Notice::NeedsOperator { train: FIRST, .. });
    assert_eq!(watched.notices.iter().filter(asks).count(), 1);
    assert!(watched.world.train().speed_mm_per_s < 1.0);
}

#[test]
fn no_recovery_goes_on_by_itself_after_an_emergency_stop() {
    let (mut watched, since) = creeping();
    watched.dog.switch_power(watched.world.now, false);
    // Longer than it waits before it raises its step.
    watched.run(20.0);
    watched.dog.switch_power(watched.world.now, true);
    watched.run(60.0);
    stays_at_rest(&watched, since);
}

#[test]
fn a_recovery_that_an_operator_stops_does_not_go_on_by_itself() {
    let (mut watched, since) = creeping();
    let stop = Order::Speed { train: FIRST, step: SpeedStep::STAND };
    watched.dog.order(watched.world.now, stop).expect("a stop is always taken");
    watched.run(80.0);
    stays_at_rest(&watched, since);
}

#[test]
fn an_operators_stop_also_holds_a_train_that_only_waits_to_be_located() {
    // Given a lost train that has asked to creep and waits,
    let mut watched = Watched::asking();
    watched.dog.lose(watched.world.now, FIRST);
    let asks = |watched: &Watched| {
        watched.notices.iter().any(|notice| matches!(notice, Notice::AsksToCreep { train: FIRST, .. }))
    };
    assert!(watched.run_until(60.0, asks), "{:#?}", watched.notices);
    let since = watched.commanded.len();
    // when an operator stops it, and it is permitted to creep,
    let stop = Order::Speed { train: FIRST, step: SpeedStep::STAND };
    watched.dog.order(watched.world.now, stop).expect("a stop is always taken");
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    watched.run(40.0);
    // then it stays at rest.
    stays_at_rest(&watched, since);
}

#[test]
fn a_train_that_is_lost_while_the_power_is_off_waits_for_an_operator() {
    let mut watched = Watched::asking();
    watched.dog.switch_power(watched.world.now, false);
    watched.run(20.0);
    watched.dog.lose(watched.world.now, FIRST);
    let since = watched.commanded.len();
    watched.dog.switch_power(watched.world.now, true);
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    watched.run(60.0);
    stays_at_rest(&watched, since);
}

#[test]
fn no_train_runs_on_by_itself_after_a_short_circuit() {
    // Given a train that runs,
    let mut watched = Watched::one();
    watched.go(FIRST, 8);
    watched.run(6.0);
    let since = watched.commanded.len();
    // when the track loses its power, and an operator switches it on again,
    watched.dog.handle_link(watched.world.now, LinkNews::PowerLost);
    assert!(!watched.dog.is_powered());
    watched.run(5.0);
    watched.dog.switch_power(watched.world.now, true);
    let powered = |watched: &Watched| watched.notices.iter().any(|notice| matches!(notice, Notice::PowerOn));
    assert!(watched.run_until(30.0, powered), "{:#?}", watched.notices);
    // then the power returns only when the train is commanded to stand.
    let commands = watched.commanded.iter().skip(since).map(|(_, command)| *command);
    let order: Vec<Command> =
        commands.filter(|command| !matches!(command, Command::Function { .. })).collect();
    let stand =
        order.iter().position(|command| *command == Command::Speed { train: FIRST, step: SpeedStep::STAND });
    let on = order.iter().position(|command| *command == Command::PowerOn);
    assert!(stand < on && on.is_some(), "{order:?}");
}

#[test]
fn a_refused_order_ends_no_danger() {
    // Given the only train, whose recovery was given up by an emergency stop,
    let (mut watched, since) = creeping();
    watched.dog.switch_power(watched.world.now, false);
    watched.run(20.0);
    // when it is to run without power,
    let run = Order::Speed { train: FIRST, step: SpeedStep::new(5).expect("a step") };
    assert_eq!(watched.dog.order(watched.world.now, run), Err(Refusal::NoPower));
    // then it stays in danger, and with power does not start by itself.
    assert!(watched.dog.is_in_danger(FIRST));
    watched.dog.switch_power(watched.world.now, true);
    watched.run(20.0);
    stays_at_rest(&watched, since);
    // Ordered again, it runs: over a sensor it will be located.
    watched.dog.order(watched.world.now, run).expect("an operator sees to it");
    assert!(!watched.dog.is_in_danger(FIRST));
}

#[test]
fn a_creeping_train_stops_while_the_line_is_silent() {
    let (mut watched, since) = creeping();
    watched.dog.handle_link(watched.world.now, LinkNews::Silent);
    watched.run(15.0);
    let runs = |(_, command): &(_, Command)| matches!(command, Command::Speed { step, .. } if *step > SpeedStep::STAND);
    assert!(!watched.commanded.iter().skip(since).any(runs), "{:#?}", watched.commanded);
    assert!(watched.world.train().speed_mm_per_s < 1.0);
}

#[test]
fn a_permission_to_creep_ends_with_the_danger_that_it_was_for() {
    // Given a lost train that asked to creep, and was placed before it was permitted to,
    let mut watched = Watched::one();
    watched.dog.ask_before_creeping();
    watched.go(FIRST, 8);
    watched.run(6.0);
    watched.dog.lose(watched.world.now, FIRST);
    watched.run(8.0);
    let node = watched.world.layout.node_named("D1").expect("a node");
    let at = PathPoint { node, distance: Length::from_mm(100.0) };
    watched.dog.place(watched.world.now, FIRST, at, Length::from_mm(3.0));
    watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
    // when it is lost again,
    watched.dog.lose(watched.world.now, FIRST);
    let since = watched.commanded.len();
    watched.run(30.0);
    // then it asks again, and does not creep before that is answered.
    let asked = watched.notices.iter().filter(|notice| matches!(notice, Notice::AsksToCreep { .. })).count();
    assert_eq!(asked, 2, "{:#?}", watched.notices);
    let creeps = |(_, command): &(_, Command)| matches!(command, Command::Speed { step, .. } if *step > SpeedStep::STAND);
    assert!(!watched.commanded.iter().skip(since).any(creeps));
}

#[test]
fn a_train_whose_decoder_reports_zero_has_stalled_before_any_sensor_can_tell() {
    // Given a decoder that reports 0.315 a mm/s, twice a second, for some laps,
    let mut watched = Watched::one();
    watched.go(FIRST, 8);
    let report = |watched: &mut Watched, number: u16| {
        watched.dog.handle_link(watched.world.now, LinkNews::ReportedSpeed { train: FIRST, number });
        watched.run(0.5);
    };
    for _ in 0..80 {
        let number = (0.315 * watched.world.train().speed_mm_per_s).round() as u16;
        report(&mut watched, number);
    }
    assert_eq!(watched.alarm(), None, "{:#?}", watched.notices);
    // when it stalls just behind a sensor, nearly three seconds before the next one,
    let passes = watched.world.passes.len();
    assert!(watched.run_until(10.0, |watched| watched.world.passes.len() > passes));
    watched.run(0.2);
    watched.world.trains[0].wheels = 0.0;
    let stalled = watched.world.now;
    // then a second of zeros is enough.
    while watched.alarm().is_none() && watched.world.now - stalled < TimeSpan::from_s(10.0) {
        report(&mut watched, 0);
    }
    assert_eq!(watched.alarm(), Some(Alarm::Stalled));
    let within = watched.world.now - stalled;
    assert!(within <= TimeSpan::from_s(1.6) && within >= TimeSpan::from_s(1.0), "{within:?}");
}
