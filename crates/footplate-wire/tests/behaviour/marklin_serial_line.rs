//! Polls and commands share the line: each report says since when its input may have been closed, commands go first,
//! and nothing is written that the interface would not take.

use footplate_core::{
    Command, DecoderSteps, EventKind, FunctionNumber, SensorId, SpeedStep, TimeSpan, TrainId,
};
use footplate_wire::Session;
use footplate_wire::marklin_serial::{BYTE_TIME, Interface, Pace, Settings};
use proptest::prelude::{prop_assert, prop_assert_eq, proptest};

use crate::marklin_serial_bench::{Bench, HandShake, ms, reverse, speed};

#[test]
fn the_line_opens_with_what_brings_the_interface_into_step() {
    // Given an interface that waits for the second byte of anything,
    for waiting in [vec![], vec![10], vec![34]] {
        let mut bench = Bench::with_cts();
        bench.station.heard = waiting;
        bench.run_for(300);
        // then the power is on, no coil is, and sensors are read.
        assert!(bench.station.power);
        assert!(bench.station.coils.iter().all(|(_, _, released)| released.is_some()));
        let said = bench.said();
        assert!(said.contains(&"reset mode on".to_owned()), "{said:?}");
        assert!(said.iter().filter(|said| *said == "read modules 1 to 5").count() >= 3, "{said:?}");
    }
}

#[test]
fn no_bus_has_no_modules() {
    for modules in [0, 32, 255] {
        assert!(Interface::new(ms(0), Settings::with_cts(modules)).is_err());
    }
}

#[test]
fn nothing_is_written_that_the_interface_would_not_take() {
    for (pace, hand_shake) in [
        (Pace::Cts, HandShake::Edges),
        (Pace::Cts, HandShake::TooShort),
        (Pace::CAREFUL, HandShake::Edges),
        (Pace::FAST, HandShake::TooShort),
    ] {
        let mut bench = Bench::new(Settings::timed(5, pace));
        bench.station.hand_shake = hand_shake;
        for step in 1..=14 {
            bench.say(speed(24, step));
            bench.say(speed(58, step));
            bench.run_for(330);
        }
        assert_eq!(bench.station.violations, []);
        assert_eq!(bench.station.steps, [(TrainId(24), 14), (TrainId(58), 14)].into());
        assert!(bench.notices.iter().all(|notice| !notice.to_string().contains("lost")));
    }
}

#[test]
fn a_poll_of_five_modules_comes_every_sixty_milliseconds() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(10_000));
    // The published figures are 55 to 60 ms on the wire and 60 to 100 ms in whole programs.
    let polls = bench.said().iter().filter(|said| *said == "read modules 1 to 5").count();
    assert!((150..=182).contains(&polls), "{polls} polls in ten seconds");
}

#[test]
fn a_watched_input_is_read_four_times_as_often_and_the_others_not_forgotten() {
    let mut bench = Bench::with_cts();
    bench.session.watch(Some(SensorId(40)));
    bench.run_until(ms(1_000));
    let before = bench.said().len();
    bench.run_until(ms(11_000));
    let said = bench.said().split_off(before);
    let count = |what: &str| said.iter().filter(|said| *said == what).count();
    assert!(count("read module 3") >= 420, "{} of the watched module", count("read module 3"));
    assert!((17..=21).contains(&count("read modules 1 to 5")), "{} of all", count("read modules 1 to 5"));

    // An input elsewhere is reported with the interval that its module was really left alone.
    bench.station.input(70, true);
    let closed = bench.now;
    bench.run_for(1_000);
    let [(read, interval)] = bench.reports(70)[..] else { panic!("one closure, one report") };
    assert!(read - interval < closed && closed <= read);
    assert!(interval < TimeSpan::from_ms(600));
}

proptest! {
    #[test]
    fn an_input_closed_within_the_poll_interval_before_its_report(
        closes_us in proptest::collection::vec(5_000_i64..400_000, 1..12),
        lasts_us in 100_i64..200_000,
        watched in 0_u16..160,
        lost in proptest::collection::vec(0_usize..300, 0..6),
    ) {
        let mut bench = Bench::with_cts();
        bench.session.watch(Some(SensorId(watched)));
        bench.run_for(400);
        bench.lose_to_host(&lost);
        let mut closures = Vec::new();
        for wait_us in closes_us {
            bench.run_until(bench.now + TimeSpan::from_us(wait_us));
            bench.station.input(33, true);
            closures.push(bench.now);
            bench.run_until(bench.now + TimeSpan::from_us(lasts_us));
            bench.station.input(33, false);
        }
        bench.run_for(2_000);
        let reports = bench.reports(33);
        // Closures between two readings are one to the interface, and one of a lost reply is gone; but no report is
        // without its closure.
        for (read, interval) in &reports {
            let inside = |closed: &&_| *read - *interval < **closed && **closed <= *read;
            prop_assert!(closures.iter().any(|closed| inside(&closed)), "{reports:?} {closures:?}");
        }
        if lost.is_empty() {
            prop_assert!(!reports.is_empty());
        }
        prop_assert_eq!(bench.station.violations.len(), 0);
    }

    #[test]
    fn a_held_line_is_free_when_the_command_comes(at_ms in 700_i64..1_500, ahead_ms in 100_i64..400) {
        let mut bench = Bench::with_cts();
        bench.run_until(ms(at_ms - ahead_ms));
        bench.session.hold_line(Some(ms(at_ms)));
        // The last bit is to leave at the time that was held.
        bench.run_until(ms(at_ms) - BYTE_TIME - BYTE_TIME - TimeSpan::from_us(1_700));
        bench.say(speed(24, 8));
        bench.run_for(100);
        let left = bench.events.iter().find(|event| matches!(event.kind, EventKind::Speed { .. })).unwrap();
        prop_assert!((left.time - ms(at_ms)).abs() < TimeSpan::from_ms(1), "{:?}", left.time - ms(at_ms));
        // And before the hold and after it, sensors are read.
        let polled = |from, to| bench.station.messages.iter().any(|(at, m)| {
            (from..to).contains(at) && !m.modules_read().is_empty()
        });
        prop_assert!(polled(ms(at_ms - 100), ms(at_ms)) && polled(ms(at_ms), bench.now));
    }
}

#[test]
fn a_hold_without_its_command_ends_by_itself() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(500));
    bench.session.hold_line(Some(ms(600)));
    bench.run_until(ms(1_000));
    let after = bench.station.messages.iter().filter(|(at, _)| *at > ms(610)).count();
    assert!(after >= 5, "{after} polls after the hold");
}

#[test]
fn a_hold_that_is_taken_back_lets_polls_go_on_at_once() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(500));
    bench.session.hold_line(Some(ms(5_000)));
    // No read fits into what is left.
    bench.run_until(ms(5_000) - TimeSpan::from_ms(25));
    bench.session.hold_line(None);
    bench.run_for(10);
    assert_eq!(bench.written.last().map(|(at, byte)| (*at >= ms(4_975), *byte)), Some((true, 133)));
}

#[test]
fn a_command_is_recorded_when_its_last_bit_has_left() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(505));
    bench.say(speed(24, 8));
    bench.say(reverse(58));
    bench.run_for(300);
    let entries: Vec<_> = bench.events.iter().map(|event| (event.time, event.kind)).collect();
    let arrived: Vec<_> =
        bench.station.messages.iter().filter(|(_, m)| m.modules_read().is_empty()).collect();
    let [.., (drive_at, _), (reverse_at, _)] = arrived[..] else {
        panic!("two commands should have arrived")
    };
    let step = SpeedStep::new(8).unwrap();
    assert_eq!(
        entries,
        [
            (*drive_at, EventKind::Speed { train: TrainId(24), step }),
            (*reverse_at, EventKind::Reverse { train: TrainId(58) })
        ]
    );
    // At the worst they waited for one poll.
    assert!(*drive_at - ms(505) < TimeSpan::from_ms(75), "{:?}", *drive_at - ms(505));
}

#[test]
fn stops_and_power_off_pass_all_that_waits() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(505));
    for train in 1..=40 {
        bench.say(speed(train, 8));
    }
    bench.say(speed(50, 0));
    bench.say(Command::PowerOff);
    bench.run_for(150);
    let said = bench.said();
    let place = |what: &str| said.iter().position(|said| said == what).unwrap();
    assert!(place("stop") < place("train 50 step 0 light on"));
    assert!(place("train 50 step 0 light on") < place("train 2 step 8 light on"));
}

#[test]
fn what_the_interface_does_not_know_is_refused_at_once() {
    let mut bench = Bench::with_cts();
    let refused = bench.session.handle_command(bench.now, speed(81, 3)).unwrap_err();
    assert_eq!(refused.to_string(), "train 81 has no address here; addresses are 1 to 80");
    let refused = bench.session.handle_command(bench.now, speed(24, 15)).unwrap_err();
    assert_eq!(refused.to_string(), "step 15 is beyond the decoder; steps are 0 to 14");
    let refused = bench.session.set_decoder(TrainId(24), DecoderSteps::All).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "train 24 has 126 speed steps, and this station commands 14: leave out its steps, or use another station"
    );
    assert_eq!(bench.session.set_decoder(TrainId(24), DecoderSteps::Fourteen), Ok(()));
}

#[test]
fn functions_keep_the_speed_and_speeds_keep_the_light() {
    let mut bench = Bench::with_cts();
    bench.run_for(300);
    let switch = |number, on| {
        let function = FunctionNumber::new(number).unwrap();
        Command::Function { train: TrainId(24), function, on }
    };
    let wanted = [
        speed(24, 8),
        switch(0, false),
        switch(1, true),
        switch(4, true),
        speed(24, 9),
        reverse(24),
        switch(0, true),
    ];
    for command in wanted {
        bench.say(command);
        bench.run_for(300);
    }
    let said = bench.said();
    let to_train: Vec<&str> =
        said.iter().map(String::as_str).filter(|said| said.starts_with("train")).collect();
    let expected = [
        "train 24 step 8 light on",
        "train 24 step 8 light off",
        "train 24 f1 on f2 off f3 off f4 off",
        "train 24 f1 on f2 off f3 off f4 on",
        "train 24 step 9 light off",
        "train 24 reverse light off",
        "train 24 step 0 light on",
    ];
    assert_eq!(to_train, expected);
    assert_eq!(bench.events.iter().filter(|event| matches!(event.kind, EventKind::Speed { .. })).count(), 2);
    let refused = bench.session.handle_command(bench.now, switch(5, true)).unwrap_err();
    assert_eq!(refused.to_string(), "F5 cannot be switched over this link; functions are F0 to F4");
}

#[test]
fn a_line_without_a_hand_shake_begins_by_itself_and_one_with_it_waits() {
    for (pace, begins) in [(Pace::CAREFUL, true), (Pace::FAST, true), (Pace::Cts, false)] {
        let mut session = Interface::new(ms(0), Settings::timed(5, pace)).unwrap();
        for _ in 0..10 {
            let Some(at) = session.next_timeout().filter(|at| *at < ms(1_000)) else { break };
            session.handle_timeout(at);
        }
        assert_eq!(session.poll_output().is_some(), begins, "{pace:?}");
        session.handle_cts(ms(1_000), true);
        assert!(begins || session.poll_output().is_some(), "{pace:?}");
    }
}
