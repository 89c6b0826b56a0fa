//! The session with a DCC-EX board: its order, its pace, and what it does when something is lost.

use footplate_core::{
    Command, DecoderSteps, Event, EventKind, Report, SensorId, SpeedStep, TimeSpan, TrainId, TurnoutId,
};
use footplate_wire::dcc_ex::{Settings, TurnoutRequests};
use footplate_wire::{CommandError, LinkNotice, ReportedFunctions, Session};

use crate::dcc_ex_desk::Desk;
use crate::desk::{T24, T58, function, ms, speed};

#[test]
fn a_network_board_is_asked_what_it_is_then_for_its_states() {
    let mut desk = Desk::new(Settings { turnouts: TurnoutRequests::Defined, ..Settings::default() });
    desk.run_until(ms(400));
    assert_eq!(desk.texts(), ["<s>", "<Q>", "<T>", "<1 MAIN>", "<#>"]);
    let identity = "DCC-EX V-5.6.0 / MEGA / STANDARD_MOTOR_SHIELD G-x".to_owned();
    let expected =
        [LinkNotice::Identified(identity), LinkNotice::HeldClosed(SensorId(3)), LinkNotice::Answers];
    assert_eq!(desk.notices, expected);
    assert_eq!(desk.events, [], "states at the opening are no events");
}

#[test]
fn nothing_is_written_before_the_banner_of_a_board_that_is_reset() {
    let mut desk = Desk::new(Settings { resets_on_open: true, ..Settings::default() });
    desk.command(speed(T24, 8));
    desk.run_until(ms(3_000));
    assert_eq!(desk.texts(), [""; 0]);
    desk.hear("boot\r\n<* License GPLv3 *>\n<iDCC-EX V-5.6.0 / MEGA / X G-x>\n");
    desk.run_for(300);
    assert_eq!(desk.texts(), ["<Q>", "<1 MAIN>", "<#>", "<t 24>", "<t 24>", "<t 24 72 0>"]);
    // A board that does not reset is asked after 6 s.
    let mut desk = Desk::new(Settings { resets_on_open: true, ..Settings::default() });
    desk.run_until(ms(7_000));
    assert_eq!(desk.written[0], (6_000, "<s>".to_owned()));
}

#[test]
fn the_direction_is_read_back_and_then_absolute() {
    let mut desk = Desk::opened();
    for command in [speed(T24, 8), speed(T58, 9)] {
        desk.command(command);
    }
    desk.run_for(300);
    assert_eq!(desk.texts(), ["<t 24>", "<t 58>", "<t 24>", "<t 58>", "<t 24 72 0>", "<t 58 81 1>"]);
    desk.written.clear();
    for command in [speed(T24, 0), Command::Reverse { train: T24 }, speed(T24, 8)] {
        desk.command(command);
        desk.run_for(100);
    }
    assert_eq!(desk.texts(), ["<t 24 0 0>", "<t 24 0 1>", "<t 24 72 1>"]);
    let kinds: Vec<EventKind> = desk.events.iter().skip(2).map(|event| event.kind).collect();
    let step = |step| EventKind::Speed { train: T24, step: SpeedStep::new(step).unwrap() };
    assert_eq!(kinds, [step(0), EventKind::Reverse { train: T24 }, step(8)]);
}

#[test]
fn a_direction_counts_once_enough_reports_agree() {
    let mut desk = Desk::opened();
    desk.station.answers.retain(|(request, _)| *request != "<t 24>");
    desk.command(speed(T24, 8));
    // `128`, forward at rest, without one of its digits, twice without the same; then twice whole.
    let (first, second, whole) = ("<l 24 0 28 0>\n", "<l 24 0 18 0>\n", "<l 24 0 128 0>\n");
    for (answer, drives) in [
        (second, false),
        (first, false),
        (first, false),
        (whole, false),
        (first, false),
        (whole, false),
        (whole, true),
    ] {
        desk.run_for(100);
        desk.hear(answer);
        desk.run_for(100);
        assert_eq!(desk.texts().contains(&"<t 24 72 1>"), drives, "{:?}", desk.texts());
    }
    assert!(!desk.texts().contains(&"<t 24 72 0>"));
}

#[test]
fn the_newest_speed_wins_and_a_stop_goes_first() {
    let mut desk = Desk::new(Settings { turnouts: TurnoutRequests::Accessory, ..Settings::default() });
    desk.run_until(ms(1_000));
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.written.clear();
    desk.station.answers.push(("<t 58 90 1>", "<l 58 1 219 0>\n"));
    // Twenty more speeds at once, a turnout, and a stop behind them.
    for step in 1..=10 {
        desk.command(speed(T58, step));
        desk.command(Command::Turnout { turnout: TurnoutId(step.into()), curved: true });
    }
    desk.command(speed(T24, 0));
    desk.run_for(2_000);
    let stop = desk.written.iter().position(|(_, text)| text == "<t 24 0 0>").unwrap();
    assert!(desk.written[stop].0 - desk.written[0].0 <= 30, "{:?}", desk.written);
    let driven: Vec<&str> = desk.texts().into_iter().filter(|text| text.starts_with("<t 58 ")).collect();
    assert!(driven.len() <= 3 && driven.last() == Some(&"<t 58 90 1>"), "{driven:?}");
    // No second holds more than 20 and the three that go at once.
    for (at, _) in &desk.written {
        let within = desk.written.iter().filter(|(other, _)| (*at..*at + 1_000).contains(other));
        assert!(within.count() <= 23);
    }
}

#[test]
fn what_is_not_answered_is_repeated_and_given_up_if_it_stops_nothing() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.station.answers.retain(|(request, _)| !request.starts_with("<t 24"));
    desk.written.clear();
    desk.command(speed(T24, 9));
    desk.run_for(3_000);
    let times: Vec<i64> =
        desk.written.iter().filter(|(_, text)| text == "<t 24 81 0>").map(|(at, _)| *at).collect();
    assert_eq!(times.len(), 4, "{:?}", desk.written);
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 250), "{times:?}");
    assert!(desk.notices.contains(&LinkNotice::Unconfirmed(speed(T24, 9))));
    desk.written.clear();
    desk.command(speed(T24, 0));
    desk.run_for(3_000);
    assert!(desk.texts().iter().filter(|text| **text == "<t 24 0 0>").count() >= 12, "{:?}", desk.written);
}

#[test]
fn a_sensor_is_an_event_with_the_span_that_was_measured() {
    let mut desk = Desk::opened();
    desk.run_for(100);
    desk.hear("<Q 5>\n<Q");
    desk.hear(" 0><Q 5>");
    desk.run_for(50);
    desk.hear("<q 5><q 3><Q 3>");
    desk.run_for(1);
    let reports: Vec<(i64, u16, Option<TimeSpan>)> = desk
        .events
        .iter()
        .filter_map(|event| match event.kind {
            EventKind::Sensor(Report { sensor, poll_interval }) => {
                Some(((event.time - ms(0)).as_ns() / 1_000, sensor.0, poll_interval))
            }
            _ => None,
        })
        .collect();
    // Heard at 1100 ms and at 1150 ms; 3.6 to 23.1 ms earlier it happened.
    let width = |us| Some(TimeSpan::from_us(us));
    assert_eq!(
        reports,
        [(1_096_400, 5, width(19_500)), (1_096_400, 0, width(19_500)), (1_146_400, 3, width(19_500))]
    );
}

#[test]
fn turnouts_that_are_defined_are_awaited_only_when_they_move() {
    let mut desk = Desk::new(Settings { turnouts: TurnoutRequests::Defined, ..Settings::default() });
    desk.station.answers.push(("<T 7 1>", "<H 7 1>\n"));
    desk.station.answers.push(("<T 8 1>", "<X>\n"));
    desk.run_until(ms(1_000));
    desk.written.clear();
    // 9 lies curved already, 7 answers, 8 is not defined.
    for number in [9, 7, 8] {
        desk.command(Command::Turnout { turnout: TurnoutId(number), curved: true });
    }
    desk.run_for(450);
    assert_eq!(desk.texts(), ["<T 9 1>", "<T 7 1>", "<T 8 1>"]);
    assert_eq!(
        desk.notices.last().map(ToString::to_string).as_deref(),
        Some(
            "the station has no turnout 8: define it there (<T 8 DCC address sub>), or leave out `turnouts=defined`"
        )
    );
}

#[test]
fn silence_is_noticed_and_everything_asked_again_after_it() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    let answers = std::mem::take(&mut desk.station.answers);
    desk.run_for(2_500);
    let silent = |notice: &LinkNotice| matches!(notice, LinkNotice::Silent { .. });
    assert_eq!(desk.notices.iter().filter(|notice| silent(notice)).count(), 1);
    let text = desk.notices.iter().find(|notice| silent(notice)).unwrap().to_string();
    assert!(text.contains("check its power, the cable and the port"), "{text}");
    // It answers again: states and the locomotive are asked for, and only then it is said to answer.
    (desk.station.answers, desk.written) = (answers, Vec::new());
    desk.station
        .answers
        .iter_mut()
        .filter(|(request, _)| *request == "<t 24>")
        .for_each(|(_, answer)| *answer = "<l 24 0 73 0>\n");
    desk.station
        .answers
        .iter_mut()
        .filter(|(request, _)| *request == "<Q>")
        .for_each(|(_, answer)| *answer = "<Q 0><q 5>");
    desk.run_for(800);
    for request in ["<Q>", "<1 MAIN>", "<#>", "<t 24>"] {
        assert!(desk.texts().contains(&request), "{request} in {:?}", desk.written);
    }
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
    // Sensor 0 became occupied at some time of the silence.
    let Some(Event { kind: EventKind::Sensor(report), .. }) = desk.events.last() else {
        panic!("{:?}", desk.events)
    };
    assert!(
        report.sensor == SensorId(0) && report.poll_interval.unwrap() > TimeSpan::from_ms(2_000),
        "{report:?}"
    );
}

#[test]
fn a_reset_stops_trains_and_writes_their_direction_again() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(3_000);
    desk.written.clear();
    desk.hear("<iDCC-EX V-5.6.0 / MEGA / X G-x>\n");
    desk.run_for(600);
    assert!(desk.notices.contains(&LinkNotice::Restarted));
    assert_eq!(desk.texts(), ["<t 24 0 0>", "<Q>", "<1 MAIN>", "<#>", "<t 24>"]);
}

#[test]
fn a_board_that_restarted_behind_a_network_is_recognised_by_what_it_forgot() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(500);
    desk.written.clear();
    desk.station
        .answers
        .iter_mut()
        .filter(|(request, _)| *request == "<t 24>")
        .for_each(|(_, answer)| *answer = "<l 24 -1 128 0>\n");
    desk.client.handle_reopened(desk.now);
    desk.run_for(1_000);
    assert!(desk.notices.contains(&LinkNotice::Restarted), "{:?}", desk.notices);
    assert_eq!(desk.texts()[..6], ["<s>", "<Q>", "<1 MAIN>", "<#>", "<t 24>", "<t 24 0 0>"]);
    // It lost everything else, too: it is asked again before it is said to answer.
    assert_eq!(desk.texts()[6..9], ["<Q>", "<1 MAIN>", "<#>"]);
    let restarted = desk.notices.iter().position(|notice| *notice == LinkNotice::Restarted);
    assert_eq!(desk.notices.get(restarted.unwrap() + 1), Some(&LinkNotice::Answers));
}

#[test]
fn another_throttle_is_noticed() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.hear("<l 24 0 201 0>\n");
    desk.hear("<p0 A>\n");
    desk.run_for(1);
    assert!(desk.notices.contains(&LinkNotice::OtherThrottle { train: T24, reversed: true }));
    assert!(desk.notices.contains(&LinkNotice::PowerLost));
}

#[test]
fn the_end_is_confirmed_by_the_board() {
    let mut desk = Desk::opened();
    desk.drive_two();
    desk.client.close(desk.now);
    desk.run_for(500);
    assert_eq!(desk.texts(), ["<t 24 0 0>", "<t 58 0 1>", "<0>"]);
    let closing = desk.client.closing();
    assert!(closing.is_complete(), "{closing}");
    assert_eq!(
        closing.to_string(),
        "commanded to stop: 24, 58; track power switched off; the station has confirmed it"
    );
    assert_eq!(desk.client.handle_command(desk.now, speed(T24, 3)), Err(CommandError::Closed));
}

#[test]
fn a_train_that_was_never_driven_here_is_stopped_at_the_end_if_that_was_commanded() {
    let mut desk = Desk::new(Settings::default());
    desk.command(speed(T24, 0));
    desk.client.close(desk.now);
    desk.run_for(500);
    let texts = desk.texts();
    let end = texts.iter().position(|text| *text == "<!>").expect("all locomotives are stopped");
    assert_eq!(texts[end..], ["<!>", "<t 24>", "<t 24>", "<t 24 0 0>", "<0>"]);
    let closing = desk.client.closing();
    assert_eq!((closing.is_complete(), closing.commanded_to_stop), (true, vec![T24]));
}

#[test]
fn all_locomotives_are_stopped_again_while_a_direction_is_unknown_at_the_end() {
    let mut desk = Desk::new(Settings::default());
    desk.station.answers.retain(|(request, _)| *request != "<t 24>");
    desk.command(speed(T24, 0));
    desk.client.close(desk.now);
    desk.run_for(800);
    let stops: Vec<&str> = desk.texts().into_iter().filter(|text| text.contains("<!>")).collect();
    assert_eq!(stops, ["<!>", "<!><t 24>", "<!><t 24>", "<!><t 24>"], "{:?}", desk.written);
}

#[test]
fn what_was_not_confirmed_at_the_end_is_named() {
    let mut desk = Desk::opened();
    desk.drive_two();
    desk.station.answers.retain(|(request, _)| *request != "<t 58 0 1>");
    let closing = desk.close(5_000);
    assert!(!closing.is_complete() && closing.power_off, "{closing}");
    assert_eq!((closing.commanded_to_stop, closing.not_commanded), (vec![T24], vec![T58]));
}

#[test]
fn noise_is_called_noise_once() {
    let mut desk = Desk::opened();
    desk.assert_noise(20, "\u{fffd}\u{fffd}xyz~~".as_bytes(), "115200 baud");
}

#[test]
fn what_the_board_does_not_know_is_refused() {
    let mut desk = Desk::opened();
    desk.assert_refused(&[
        (speed(TrainId(0), 3), "train 0 has no address here; addresses are 1 to 10239"),
        (speed(T24, 15), "step 15 is beyond the decoder; steps are 0 to 14"),
        (
            Command::Turnout { turnout: TurnoutId(2045), curved: true },
            "turnout 2045 has no address here; addresses are 1 to 2044",
        ),
    ]);
}

#[test]
fn a_decoder_of_126_steps_and_a_long_address_is_commanded_in_its_own_steps() {
    let (long, mut desk) = (TrainId(3_850), Desk::opened());
    let confirmed = [("<t 3850>", "<l 3850 1 128 0>\n"), ("<t 3850 63 1>", "<l 3850 1 192 0>\n")];
    desk.station.answers.extend(confirmed);
    desk.client.set_decoder(long, DecoderSteps::All).unwrap();
    desk.notices.clear();
    desk.command(speed(long, 63));
    desk.command(speed(T58, 9));
    desk.run_for(1_000);
    let expected = ["<t 3850>", "<t 58>", "<t 3850>", "<t 58>", "<t 3850 63 1>", "<t 58 81 1>"];
    assert_eq!(desk.texts()[..6], expected);
    assert_eq!(desk.notices, [], "the board confirms its own speed");
    desk.client.set_decoder(T58, DecoderSteps::TwentyEight).unwrap();
    let refused = desk.client.handle_command(desk.now, speed(T58, 29)).unwrap_err();
    assert_eq!(refused.to_string(), "step 29 is beyond the decoder; steps are 0 to 28");
    let refused = desk.client.set_decoder(TrainId(10_240), DecoderSteps::All).unwrap_err();
    assert_eq!(refused.to_string(), "train 10240 has no address here; addresses are 1 to 10239");
}

#[test]
fn a_function_is_switched_and_confirmed_and_is_no_event() {
    let mut desk = Desk::opened();
    desk.notices.clear();
    desk.station.answers.push(("<F 24 0 1>", "<l 24 0 0 1>\n"));
    desk.command(function(T24, 0, true));
    desk.run_for(400);
    assert_eq!(desk.texts(), ["<t 24>", "<t 24>", "<F 24 0 1>"], "confirmed at once");
    // The board does not answer a request that changes nothing: none is awaited.
    desk.station.answers.pop();
    desk.command(function(T24, 0, true));
    desk.run_for(400);
    assert_eq!(desk.texts()[3..].iter().filter(|text| **text != "<#>").count(), 1, "{:?}", desk.texts());
    assert_eq!((&desk.events[..], &desk.notices[..]), (&[][..], &[][..]));
    assert_eq!(desk.functions[&T24], ReportedFunctions::all(1));
    // Another throttle switches F0 off and F3 on: the board tells everybody.
    desk.client.handle_bytes(desk.now, b"<l 24 0 0 8>\n");
    desk.run_for(10);
    let functions = ReportedFunctions::all(8);
    assert_eq!(desk.functions[&T24], functions);
    assert_eq!(desk.notices, [LinkNotice::OtherFunctions { train: T24, functions }]);
}

#[test]
fn a_function_whose_answer_was_lost_is_asked_for() {
    let mut desk = Desk::opened();
    desk.command(function(T24, 28, true));
    desk.run_for(100);
    // The board obeyed, and its answer is lost.
    desk.station.answers.retain(|(request, _)| *request != "<t 24>");
    desk.station.answers.push(("<t 24>", "<l 24 0 0 268435456>\n"));
    desk.run_for(1_000);
    assert_eq!(desk.texts().into_iter().filter(|text| text.starts_with("<F 24 28 1>")).count(), 1);
    assert!(!desk.notices.iter().any(|notice| matches!(notice, LinkNotice::Unconfirmed(_))));
}
