//! A train that is lifted and put elsewhere is stopped by one report there and one silent sensor, before it runs into
//! another train or off its track.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Alarm, LinkNews, Notice, Outcome, Reservation};
use footplate_core::{Command, SensorId};

use crate::watching::{FIRST, Watched};

/// A train that has run for 20 s, and `D1` reported it last so many seconds ago; it reaches `A1` 3.1 s after `D1`.
fn running_past_d1(since_s: f64) -> Watched {
    let mut watched = Watched::one();
    let passed = watched.world.layout.sensor_named("D1").expect("a sensor");
    watched.go(FIRST, 9);
    watched.run(20.0);
    let before = watched.world.passes.len();
    let passes = |watched: &Watched| watched.world.passes.iter().skip(before).any(|(_, at, _)| *at == passed);
    assert!(watched.run_until(15.0, passes));
    watched.run(since_s);
    watched
}

/// Puts the running train down beyond `E1`, on the siding whose end is 900 mm beyond `F1`, and waits for the alarm.
fn lifted_to_the_siding(past_e1_mm: f64) -> (Watched, SensorId) {
    let mut watched = running_past_d1(2.3);
    let layout = &watched.world.layout;
    let place = layout.landmark(&format!("E1+{past_e1_mm}mm")).expect("a place");
    let at = layout.locate(place, &watched.world.turnouts).expect("a place");
    let reports = layout.sensor_named("F1").expect("a sensor");
    watched.world.trains[0].at = at;
    assert!(watched.run_until(10.0, |watched| watched.alarm().is_some()), "{:#?}", watched.notices);
    (watched, reports)
}

#[test]
fn a_report_elsewhere_after_a_silent_sensor_stops_a_train_before_its_track_ends() {
    // Given a train that runs at 288 mm/s and is put down where a sensor reports it 2.4 s later,
    let (mut watched, sensor) = lifted_to_the_siding(100.0);
    // then that report stops it, not a second one: none comes before the track ends.
    assert_eq!(watched.alarm(), Some(Alarm::Elsewhere(sensor)), "{:#?}", watched.notices);
    watched.run(4.0);
    assert!(watched.world.trains[0].speed_mm_per_s < 1.0);
    assert!(!watched.world.trains[0].is_off_the_track);
    // It is searched over the track that it came from, not ahead.
    watched.run(100.0);
    assert!(!watched.world.trains[0].is_off_the_track, "{:#?}", watched.notices);
    assert!(watched.commanded.iter().any(|(_, command)| matches!(command, Command::Reverse { .. })));
}

#[test]
fn a_silent_sensor_after_a_report_elsewhere_stops_a_train_too() {
    // Given a train that is put down where a sensor reports it at once,
    let (mut watched, sensor) = lifted_to_the_siding(790.0);
    // then the sensor at which it is overdue stops it.
    assert_eq!(watched.alarm(), Some(Alarm::Elsewhere(sensor)), "{:#?}", watched.notices);
    watched.run(4.0);
    assert!(!watched.world.trains[0].is_off_the_track, "{:#?}", watched.notices);
}

/// `F1`, on the siding, reports without a train so many seconds after `D1` reported one, which `A1` misses.
fn spurious_and_missed(after_s: f64) -> Watched {
    let mut watched = running_past_d1(after_s);
    let [spurious, missed] =
        ["F1", "A1"].map(|name| watched.world.layout.sensor_named(name).expect("a sensor"));
    watched.world.close(spurious);
    watched.world.dead.insert(missed);
    watched.run(20.0);
    watched
}

#[test]
fn a_report_elsewhere_sooner_than_a_hand_can_move_a_train_is_not_of_it() {
    // When a sensor reports spuriously half a second after the train was detected, and the next one misses the train,
    let watched = spurious_and_missed(0.5);
    // then it runs on: no hand has put it on the siding in that time.
    assert_eq!(watched.alarm(), None, "{:#?}", watched.notices);
    // Were it there later, a hand may have.
    assert!(matches!(spurious_and_missed(2.4).alarm(), Some(Alarm::Elsewhere(_))));
}

#[test]
fn a_report_where_a_train_cannot_have_run_leaves_a_lost_train_to_a_person() {
    for name in ["C1", "A1"] {
        // Given a train under a dispatcher that the silence of the station stops between `D1` and `A1`,
        let mut watched = running_past_d1(1.0);
        watched.dog.ask_before_creeping();
        watched.dog.handle_link(watched.world.now, LinkNews::Silent);
        // when a sensor reports it as it stops, the next one or one that is 1.3 m away,
        let sensor = watched.world.layout.sensor_named(name).expect("a sensor");
        watched.world.dead.insert(sensor);
        watched.run(0.3);
        watched.world.close(sensor);
        watched.dog.handle_link(watched.world.now, LinkNews::Answers);
        watched.run(10.0);
        watched.dog.permit(watched.world.now, FIRST, Reservation::empty());
        watched.run(1.0);
        // then it creeps to be located from where it can be, and nowhere if that is not known.
        let creeps = watched.notices.iter().any(|notice| matches!(notice, Notice::Creeps { .. }));
        let asks = watched.notices.iter().any(|notice| matches!(notice, Notice::NeedsOperator { .. }));
        assert_eq!((creeps, asks), (name == "A1", name == "C1"), "{name}: {:#?}", watched.notices);
    }
}

#[test]
fn an_alarm_by_a_report_that_turns_out_to_be_spurious_ends_without_a_search() {
    let mut watched = Watched::one();
    watched.go(FIRST, 9);
    watched.run(20.0);
    // Given a report of the sensor ahead, half a second before the train comes,
    let due = |watched: &Watched| {
        watched.notices.iter().rev().find_map(|notice| match notice {
            Notice::Passed { next: Some(due), .. } => {
                Some((due.sensor, (due.time - watched.world.now).as_s()))
            }
            _ => None,
        })
    };
    assert!(
        watched.run_until(20.0, |watched| due(watched).is_some_and(|(_, left)| (0.5..0.6).contains(&left)))
    );
    let (sensor, _) = due(&watched).expect("a sensor");
    watched.world.close(sensor);
    assert!(watched.run_until(0.5, |watched| watched.alarm().is_some()), "{:#?}", watched.notices);
    assert_eq!(watched.alarm(), Some(Alarm::Untimely(sensor)));
    // when the train passes it while it stops,
    assert!(watched.run_until(8.0, |watched| watched.recovered().is_some()), "{:#?}", watched.notices);
    // then it is as before, was not searched, and goes on.
    assert_eq!(watched.recovered(), Some(Outcome::AsBefore));
    assert!(!watched.notices.iter().any(|notice| matches!(notice, Notice::Creeps { .. })));
    watched.run(5.0);
    assert!(watched.world.trains[0].speed_mm_per_s > 100.0);
}
