//! The session with a Z21: its order, its pace, and what it does when datagrams are lost, come twice or overtake one another.

use footplate_core::{Command, DecoderSteps, EventKind, SensorId, TrainId, TurnoutId};
use footplate_wire::z21::{
    Broadcasts, CanDetection, Feedback, FunctionSwitch, Lock, LocoNetDetection, LocomotiveState, RailCom,
    Reply, Request, Settings, Throttle, TurnoutPosition,
};
use footplate_wire::{CommandError, LinkNotice, ReportedFunctions, Session};

use crate::desk::{T24, T58, function, ms, speed};
use crate::z21_desk::{Desk, state};

fn drive(address: u16, throttle: Throttle, forward: bool) -> Request {
    Request::Drive { address, steps: DecoderSteps::All, throttle, forward }
}

#[test]
fn the_station_is_asked_what_it_is_and_told_what_to_tell() {
    let mut desk = Desk::new(Settings::default());
    desk.station.inputs[0] = 0x08;
    desk.run_until(ms(400));
    let wanted = Broadcasts(0x0000_0107);
    let requests: Vec<Request> = desk.written.iter().map(|(_, request)| *request).take(9).collect();
    let expected = [
        Request::SerialNumber,
        Request::Hardware,
        Request::LockCode,
        Request::SetBroadcasts(wanted),
        Request::Broadcasts,
        Request::Feedback { group: 0 },
        Request::Power { on: true },
        Request::Status,
        Request::Feedback { group: 0 },
    ];
    assert_eq!(requests, expected);
    assert_eq!(desk.station.told, wanted);
    let identity = "z21, firmware 1.42, serial number 82850".to_owned();
    let held = LinkNotice::HeldClosed(SensorId(3));
    assert_eq!(desk.notices, [LinkNotice::Identified(identity), held, LinkNotice::Answers]);
    assert_eq!(desk.events, [], "states at the opening are no events");
}

#[test]
fn the_opening_gets_through_whatever_is_lost() {
    let mut desk = Desk::new(Settings::default());
    // Two datagrams of three are lost.
    desk.station.loses = |count| !count.is_multiple_of(3);
    desk.run_until(ms(6_000));
    assert!(desk.notices.contains(&LinkNotice::Answers), "{:?}", desk.written);
    assert!(desk.station.told.has(Broadcasts::STATES) && desk.station.power);
}

#[test]
fn a_station_that_is_locked_and_one_that_reports_less_are_named() {
    let mut desk = Desk::new(Settings::default());
    desk.station.lock = Lock::Locked;
    desk.station.tells = Broadcasts(0x0000_0003);
    desk.run_until(ms(3_000));
    assert!(desk.notices.contains(&LinkNotice::Locked));
    let is_refused =
        |notice: &LinkNotice| matches!(notice, LinkNotice::BroadcastsRefused { missing: 0x104, .. });
    assert!(desk.notices.iter().any(is_refused), "{:?}", desk.notices);
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
    // It is not taken for one that was restarted.
    desk.run_for(20_000);
    assert!(!desk.notices.contains(&LinkNotice::Restarted));
}

#[test]
fn the_direction_is_read_back_and_then_absolute() {
    let mut desk = Desk::opened();
    for command in [speed(T24, 8), speed(T58, 9)] {
        desk.command(command);
    }
    desk.run_for(300);
    // 24 was left running backwards by whoever drove it before.
    let expected = [drive(24, Throttle::Step(72), false), drive(58, Throttle::Step(81), true)];
    assert_eq!(desk.commands(), expected);
    desk.written.clear();
    for command in [speed(T24, 0), Command::Reverse { train: T24 }, speed(T24, 8)] {
        desk.command(command);
        desk.run_for(100);
    }
    let expected = [
        drive(24, Throttle::Stop, false),
        drive(24, Throttle::Stop, true),
        drive(24, Throttle::Step(72), true),
    ];
    assert_eq!(desk.commands(), expected);
}

#[test]
fn a_decoder_of_other_steps_is_driven_in_its_own() {
    for (steps, step) in [(DecoderSteps::TwentyEight, 17), (DecoderSteps::All, 63)] {
        let mut desk = Desk::new(Settings { steps: DecoderSteps::Fourteen, ..Settings::default() });
        desk.run_until(ms(1_000));
        desk.client.set_decoder(T58, steps).unwrap();
        desk.command(speed(T58, step));
        desk.run_for(1_000);
        let throttle = Throttle::Step(step);
        let expected = Request::Drive { address: 58, steps, throttle, forward: true };
        assert_eq!(desk.commands().last(), Some(&expected));
    }
}

#[test]
fn each_number_of_steps_is_driven_in() {
    for (steps, step) in
        [(DecoderSteps::Fourteen, 8), (DecoderSteps::TwentyEight, 16), (DecoderSteps::All, 72)]
    {
        let mut desk = Desk::new(Settings { steps, ..Settings::default() });
        desk.run_until(ms(1_000));
        desk.command(speed(T58, 8));
        desk.run_for(1_000);
        let throttle = Throttle::Step(step);
        assert_eq!(
            desk.commands().last(),
            Some(&Request::Drive { address: 58, steps, throttle, forward: true })
        );
    }
}

#[test]
fn a_stop_goes_first_and_is_written_until_the_station_has_it() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.written.clear();
    // Eleven of twelve datagrams are lost from here on.
    desk.station.loses = |count| !count.is_multiple_of(12);
    for number in 1..=10 {
        desk.command(Command::Turnout { turnout: TurnoutId(number), curved: true });
    }
    desk.command(speed(T24, 0));
    desk.run_for(20);
    assert!(desk.commands().contains(&drive(24, Throttle::Stop, false)), "{:?}", desk.written);
    desk.run_for(8_000);
    assert_eq!(desk.station.locomotive(24).throttle, Throttle::Stop);
}

#[test]
fn a_stop_that_is_lost_once_is_written_again_after_a_tenth_of_a_second() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.written.clear();
    desk.station.count = 0;
    desk.station.loses = |count| count == 1;
    desk.command(speed(T24, 0));
    desk.run_for(500);
    let stops: Vec<i64> = desk
        .written
        .iter()
        .filter(|(_, request)| *request == drive(24, Throttle::Stop, false))
        .map(|(at, _)| *at)
        .collect();
    assert_eq!(stops.len(), 2, "{:?}", desk.written);
    assert_eq!(stops[1] - stops[0], 100);
    assert_eq!(desk.station.locomotive(24).throttle, Throttle::Stop);
    assert!(desk.notices.is_empty(), "one lost datagram is no news: {:?}", desk.notices);
}

#[test]
fn what_is_given_up_is_named() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.station.answers = false;
    desk.command(speed(T24, 9));
    desk.run_for(2_000);
    assert!(desk.notices.contains(&LinkNotice::Unconfirmed(speed(T24, 9))), "{:?}", desk.notices);
    desk.written.clear();
    desk.command(speed(T24, 0));
    desk.run_for(3_000);
    assert!(desk.commands().len() >= 25, "stops are never given up: {}", desk.commands().len());
}

#[test]
fn an_old_datagram_is_no_other_throttle() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.command(speed(T24, 0));
    desk.run_for(200);
    // What was said while it ran comes again, late, and the answer to the question puts it right.
    desk.hear(Reply::Locomotive(state(24, Throttle::Step(72), false)));
    desk.hear(Reply::Power { on: false });
    desk.run_for(500);
    assert_eq!(desk.notices, []);
    // But a throttle that goes on driving it is one.
    desk.station.locomotives.insert(24, state(24, Throttle::Step(40), true));
    desk.hear(Reply::Locomotive(state(24, Throttle::Step(40), true)));
    desk.station.power = false;
    desk.hear(Reply::Power { on: false });
    desk.run_for(500);
    assert!(
        desk.notices.contains(&LinkNotice::OtherThrottle { train: T24, reversed: true }),
        "{:?}",
        desk.notices
    );
    assert!(desk.notices.contains(&LinkNotice::PowerLost));
}

#[test]
fn a_sensor_is_an_event_with_the_span_of_its_delay() {
    let mut desk = Desk::opened();
    // Told by itself, between two questions.
    desk.run_until(ms(1_350));
    let inputs = |first: u8| Reply::Feedback { group: 0, inputs: [first, 0, 0, 0, 0, 0, 0, 0, 0, 0] };
    desk.station.inputs[0] = 0x20;
    let asked = desk.written.iter().map(|(at, _)| *at).max().unwrap();
    assert!(1_350 - asked > 20, "{asked}");
    desk.hear(inputs(0x20));
    desk.hear(inputs(0x20));
    desk.run_until(ms(2_000));
    assert_eq!(desk.reports(), [(1_349, 5, 39)]);
}

#[test]
fn a_sensor_whose_datagram_was_lost_is_found_by_asking() {
    let mut desk = Desk::opened();
    desk.run_until(ms(1_310));
    desk.station.inputs[9] = 0x80;
    desk.run_until(ms(2_000));
    let reports = desk.reports();
    let [(at, 79, width)] = reports[..] else { panic!("{reports:?}") };
    // It became occupied between the question that found it free and the one that found it occupied.
    assert!((1_310..=1_520).contains(&at) && (200..=260).contains(&width), "{reports:?}");
}

#[test]
fn datagrams_that_come_twice_or_in_another_order_make_no_second_train() {
    let mut desk = Desk::opened();
    let inputs = |first: u8| Reply::Feedback { group: 0, inputs: [first, 0, 0, 0, 0, 0, 0, 0, 0, 0] };
    desk.run_until(ms(1_310));
    desk.station.inputs[0] = 0x01;
    desk.hear(inputs(1));
    desk.run_for(5);
    desk.hear(inputs(0));
    desk.run_for(5);
    desk.hear(inputs(1));
    desk.run_for(700);
    desk.station.inputs[0] = 0;
    desk.hear(inputs(0));
    desk.run_for(20);
    desk.hear(inputs(1));
    desk.run_for(1_000);
    assert_eq!(desk.reports().len(), 1, "{:?}", desk.reports());
}

#[test]
fn detectors_on_loconet_are_heard_by_their_address() {
    let settings = Settings { feedback: Feedback::LocoNet, first_sensor: 17, ..Settings::default() };
    let mut desk = Desk::new(settings);
    desk.run_until(ms(1_000));
    assert!(desk.station.told.has(Broadcasts::LOCO_NET) && !desk.station.told.has(Broadcasts::R_BUS));
    desk.hear(Reply::LocoNet(LocoNetDetection { kind: 1, address: 20, info: 1 }));
    desk.hear(Reply::LocoNet(LocoNetDetection { kind: 1, address: 3, info: 1 }));
    desk.run_for(10);
    assert_eq!(desk.reports(), [(999, 3, 39)]);
}

#[test]
fn a_detector_on_the_can_bus_that_reports_by_itself_has_the_span_of_its_delay() {
    let mut desk = Desk::new(Settings { feedback: Feedback::Can, ..Settings::default() });
    desk.run_until(ms(1_000));
    let occupied =
        |value| Reply::Can(CanDetection { network: 0xd001, address: 1, port: 3, kind: 1, value, more: 0 });
    desk.hear(occupied(0x0100));
    desk.run_for(300);
    // The detectors are asked every 400 ms; this is far from both times.
    let asked =
        desk.written.iter().filter(|(_, request)| *request == Request::ALL_CAN).map(|(at, _)| *at).max();
    desk.run_until(ms(asked.unwrap() + 250));
    desk.hear(occupied(0x1100));
    desk.run_for(10);
    let [(_, 3, 39)] = desk.reports()[..] else { panic!("{:?}", desk.reports()) };
}

#[test]
fn turnouts_are_powered_one_after_the_other_and_let_go() {
    let mut desk = Desk::opened();
    for number in [5, 7] {
        desk.command(Command::Turnout { turnout: TurnoutId(number), curved: number == 7 });
    }
    desk.run_for(1_000);
    let set = |address, second, activate| Request::SetTurnout { address, second, activate, queue: false };
    // Straight is the second output; a release is written twice, because nothing confirms it.
    let expected = [
        set(4, true, true),
        set(4, true, false),
        set(4, true, false),
        set(6, false, true),
        set(6, false, false),
        set(6, false, false),
    ];
    assert_eq!(desk.commands(), expected);
    let times: Vec<i64> = desk
        .written
        .iter()
        .filter(|(_, request)| matches!(request, Request::SetTurnout { .. }))
        .map(|(at, _)| *at)
        .collect();
    assert!((100..=250).contains(&(times[1] - times[0])), "{times:?}");
    assert!(times[3] >= times[2], "{times:?}");
    // Another hand-set throws one.
    let position = TurnoutPosition::Output { second: false };
    desk.hear(Reply::Turnout { address: 4, position });
    desk.run_for(1);
    let thrown = EventKind::Turnout { turnout: TurnoutId(5), curved: true };
    assert_eq!(desk.events.last().map(|event| event.kind), Some(thrown));
}

#[test]
fn silence_is_noticed_and_everything_asked_again_after_it() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.station.answers = false;
    desk.run_for(2_500);
    let silent = |notice: &&LinkNotice| matches!(notice, LinkNotice::Silent { .. });
    assert_eq!(desk.notices.iter().filter(silent).count(), 1);
    let text = desk.notices.iter().find(silent).unwrap().to_string();
    assert!(text.contains("192.168.0.111"), "{text}");
    (desk.station.answers, desk.station.inputs[0]) = (true, 1);
    desk.written.clear();
    desk.run_for(1_000);
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
    assert!(desk.written.iter().any(|(_, request)| *request == Request::Locomotive { address: 24 }));
    assert!(!desk.notices.contains(&LinkNotice::Restarted), "{:?}", desk.notices);
    let [(_, 0, width)] = desk.reports()[..] else { panic!("{:?}", desk.reports()) };
    assert!(width > 2_000, "it became occupied at some time of the silence: {width} ms");
}

#[test]
fn a_station_that_was_restarted_is_recognised_by_what_it_forgot_and_trains_are_stopped() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.written.clear();
    desk.station.told = Broadcasts::NONE;
    desk.station.locomotives.clear();
    desk.run_for(6_000);
    assert!(desk.notices.contains(&LinkNotice::Restarted), "{:?}", desk.notices);
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
    // The direction that it had is written again.
    assert_eq!(desk.commands()[..2], [drive(24, Throttle::Stop, false), Request::Power { on: true }]);
    assert!(desk.station.told.has(Broadcasts::R_BUS));
}

#[test]
fn the_end_is_confirmed_by_the_station() {
    let mut desk = Desk::opened();
    desk.drive_two();
    let closing = desk.close(500);
    let expected =
        [drive(24, Throttle::Stop, false), drive(58, Throttle::Stop, true), Request::Power { on: false }];
    assert_eq!(desk.commands(), expected);
    assert_eq!(desk.written.last().map(|(_, request)| *request), Some(Request::LogOff));
    assert!(closing.is_complete(), "{closing}");
    let said = "commanded to stop: 24, 58; track power switched off; the station has confirmed it";
    assert_eq!(closing.to_string(), said);
    assert_eq!(desk.client.handle_command(desk.now, speed(T24, 3)), Err(CommandError::Closed));
}

#[test]
fn a_train_that_was_never_driven_here_is_stopped_at_the_end_if_that_was_commanded() {
    let mut desk = Desk::new(Settings::default());
    desk.station.locomotives.insert(24, state(24, Throttle::Step(72), false));
    desk.command(speed(T24, 0));
    let closing = desk.close(500);
    let expected = [Request::StopAll, drive(24, Throttle::Stop, false), Request::Power { on: false }];
    assert_eq!(desk.commands(), expected);
    assert_eq!((closing.is_complete(), closing.commanded_to_stop), (true, vec![T24]));
}

#[test]
fn the_end_gets_through_when_datagrams_are_lost_and_names_what_did_not() {
    let mut desk = Desk::opened();
    desk.drive_two();
    desk.station.loses = |count| !count.is_multiple_of(3);
    let closing = desk.close(3_000);
    assert!(closing.is_complete(), "{closing}");
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(500);
    desk.station.answers = false;
    let closing = desk.close(5_000);
    assert_eq!((closing.power_off, closing.not_commanded), (false, vec![T24]));
}

#[test]
fn noise_is_called_noise_once() {
    let mut desk = Desk::opened();
    desk.assert_noise(20, b"GET / HTTP/1.1", "UDP port 21105");
}

#[test]
fn what_the_station_does_not_know_is_refused() {
    let mut desk = Desk::opened();
    desk.assert_refused(&[
        (speed(TrainId(0), 3), "train 0 has no address here; addresses are 1 to 9999"),
        (speed(T24, 15), "step 15 is beyond the decoder; steps are 0 to 14"),
        (
            Command::Turnout { turnout: TurnoutId(2_049), curved: true },
            "turnout 2049 has no address here; addresses are 1 to 2048",
        ),
    ]);
}

#[test]
fn functions_are_switched_one_by_one_and_confirmed_by_the_state() {
    let mut desk = Desk::opened();
    for (number, on) in [(0, true), (28, true), (0, false)] {
        desk.command(function(T24, number, on));
        desk.run_for(200);
    }
    assert_eq!(desk.station.locomotive(24).functions, 1 << 28);
    // A lost datagram is repeated.
    desk.station.answers = false;
    desk.command(function(T24, 3, true));
    desk.run_for(50);
    desk.station.answers = true;
    desk.run_for(300);
    assert_eq!(desk.station.locomotive(24).functions, 1 << 28 | 1 << 3);
    let switched = Request::Function { address: 24, function: 3, switch: FunctionSwitch::On };
    assert_eq!(desk.written.iter().filter(|(_, request)| *request == switched).count(), 2);
    assert_eq!(desk.events, []);
    // Another throttle switches one: the station says so by itself.
    let functions = 1 << 28 | 1 << 2;
    desk.hear(Reply::Locomotive(LocomotiveState { functions, ..desk.station.locomotive(24) }));
    desk.run_for(20);
    assert_eq!(desk.functions[&T24], ReportedFunctions::all(functions));
    let said = desk.notices.iter().filter(|notice| matches!(notice, LinkNotice::OtherFunctions { .. }));
    let said: Vec<String> = said.map(ToString::to_string).collect();
    assert_eq!(said, ["another throttle switched functions of train 24; on now: F2, F28"]);
}

#[test]
fn a_speed_that_a_decoder_reports_is_passed_on_while_it_is_fresh() {
    let mut desk = Desk::opened();
    let report = |address, received, options, speed| {
        Reply::RailCom(RailCom { address, received, errors: 0, options, speed, quality: 0 })
    };
    desk.hear(report(24, 1, 0x01, 63));
    desk.command(speed(T24, 8));
    desk.run_for(300);
    for (received, options, speed) in
        [(2, 0x01, 63), (3, 0x01, 63), (4, 0x01, 64), (5, 0x00, 65), (6, 0x02, 3)]
    {
        desk.hear(report(24, received, options, speed));
    }
    desk.hear(report(58, 7, 0x01, 40));
    desk.run_for(500);
    // The last again, which is old, and a new one.
    desk.hear(report(24, 6, 0x02, 3));
    desk.hear(report(24, 8, 0x02, 3));
    desk.run_for(20);
    // Not before the train is driven, nor at once again, nor what is no speed, nor for a train that is not driven.
    assert_eq!(desk.speeds, [63, 64, 259, 259].map(|number| (T24, number)));
}
