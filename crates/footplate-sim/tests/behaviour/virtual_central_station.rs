//! The virtual Central Station answers as real ones were seen to, over every line, and its world does what it is asked.

use footplate_core::track::Layout;
use footplate_core::{Ratio, TimeSpan, Timestamp};
use footplate_sim::{CanSwitches, CanTransport, End, VirtualCentralStation};
use footplate_wire::marklin_can::{
    Direction, Frame, Framing, InputChange, Message, Transport, Uid, read_list,
};

use crate::yard::{TRAIN, one_train, two_loops};

/// A station in front of the two loops, with one train 100 mm behind S0 that leads with its nose.
fn station(layout: &Layout, switches: CanSwitches) -> VirtualCentralStation<'_> {
    VirtualCentralStation::new(one_train(layout, End::Nose), 7, switches)
}

/// The train's decoder is a registered one.
const UID: Uid = Uid(0x4000 + TRAIN.0 as u32);

/// Sends something and returns what comes back within a time, each with its time.
fn ask(station: &mut VirtualCentralStation<'_>, message: Message, within_ms: i64) -> Vec<(Timestamp, Frame)> {
    let frame = message.frame(false, 0x0300);
    let line = match station.transport() {
        CanTransport::Adapter => Transport::Adapter,
        CanTransport::Datagrams | CanTransport::Stream => Transport::Network,
    };
    match line {
        Transport::Network => station.write(3, &frame.encode()),
        Transport::Adapter => station.write(3, (frame.to_text() + "\r").as_bytes()),
    }
    let until = station.now() + TimeSpan::from_ms(within_ms);
    let (mut framing, mut heard) = (Framing::new(line), Vec::new());
    while let Some((_, bytes)) = station.advance(until) {
        heard.extend(bytes.iter().filter_map(|byte| framing.push(*byte)).map(|frame| (station.now(), frame)));
    }
    assert_eq!(framing.take_unread(), 0);
    heard
}

fn answers(station: &mut VirtualCentralStation<'_>, message: Message) -> Vec<Message> {
    let heard = ask(station, message, 50);
    assert!(heard.iter().all(|(_, frame)| frame.is_response));
    heard.iter().map(|(_, frame)| Message::of(frame)).collect()
}

#[test]
fn commands_are_confirmed_and_questions_answered_over_every_line() {
    let layout = two_loops();
    for (transport, is_split) in [
        (CanTransport::Datagrams, false),
        (CanTransport::Stream, false),
        (CanTransport::Stream, true),
        (CanTransport::Adapter, true),
    ] {
        let mut station = station(&layout, CanSwitches { transport, is_split, ..CanSwitches::default() });
        if transport == CanTransport::Adapter {
            station.write(0, b"\rC\rS5\rO\r");
        }
        let speed = |speed| Message::Speed { uid: UID, speed };
        let direction = |direction| Message::Direction { uid: UID, direction };
        assert_eq!(answers(&mut station, Message::Go(Uid::ALL)), [Message::Go(Uid::ALL)]);
        assert_eq!(answers(&mut station, speed(Some(500))), [speed(Some(500))]);
        assert_eq!(answers(&mut station, speed(None)), [speed(Some(500))]);
        assert_eq!(answers(&mut station, direction(None)), [direction(Some(Direction::Forward))]);
        assert_eq!(
            answers(&mut station, direction(Some(Direction::Toggled))),
            [direction(Some(Direction::Backward))]
        );
        assert_eq!(answers(&mut station, speed(None)), [speed(Some(0))], "a locomotive that is turned stops");
        let light = Message::Function { uid: UID, function: 0, value: Some(1) };
        assert_eq!(answers(&mut station, light), [light]);
        let question = Message::Function { uid: UID, function: 0, value: None };
        assert_eq!(answers(&mut station, question), [light]);
        let polled = answers(&mut station, Message::ModulePoll { uid: Uid::ALL, modules: 2 });
        assert_eq!(polled.len(), 2, "{polled:?}");
        let participants = answers(&mut station, Message::Ping).len();
        assert_eq!(participants, if transport == CanTransport::Adapter { 1 } else { 2 });
        assert_eq!(answers(&mut station, Message::Stop(Uid::ALL)), [Message::Stop(Uid::ALL)]);
        assert!(!station.world.is_powered());
    }
}

#[test]
fn an_adapter_passes_nothing_on_until_it_is_opened_at_the_right_rate() {
    let layout = two_loops();
    for (opening, is_passed) in [("", false), ("O\r", false), ("S4\rO\r", false), ("S5\rO\r", true)] {
        let mut station =
            station(&layout, CanSwitches { transport: CanTransport::Adapter, ..CanSwitches::default() });
        station.write(0, opening.as_bytes());
        let until = station.now() + TimeSpan::from_ms(10);
        while station.advance(until).is_some() {}
        station.write(0, (Message::Go(Uid::ALL).frame(false, 0x0300).to_text() + "\r").as_bytes());
        let until = station.now() + TimeSpan::from_ms(50);
        let mut said = Vec::new();
        while let Some((_, bytes)) = station.advance(until) {
            said.extend(bytes);
        }
        assert_eq!(station.world.is_powered(), is_passed, "{opening:?}");
        assert_eq!(said.contains(&0x07), !opening.contains('O'), "{opening:?}: {said:?}");
    }
}

#[test]
fn the_list_of_locomotives_names_the_trains() {
    let layout = two_loops();
    let mut station = station(&layout, CanSwitches::default());
    let heard = ask(&mut station, Message::File(*b"loks\0\0\0\0"), 500);
    let messages: Vec<Message> = heard.iter().map(|(_, frame)| Message::of(frame)).collect();
    let Message::StreamBegins { length, .. } = messages[1] else { panic!("{messages:?}") };
    let bytes = messages.iter().filter_map(|message| match message {
        Message::StreamGoesOn(bytes) => Some(*bytes),
        _ => None,
    });
    let stream: Vec<u8> = bytes.flatten().take(length as usize).collect();
    let list = read_list(&stream).expect("a whole list");
    assert_eq!(list.iter().map(|listed| (listed.uid, listed.address)).collect::<Vec<_>>(), [(UID, TRAIN.0)]);
}

#[test]
fn sensors_are_reported_within_a_cycle_with_the_time_since_the_change_before() {
    let layout = two_loops();
    let mut station =
        station(&layout, CanSwitches { transport: CanTransport::Stream, ..CanSwitches::default() });
    answers(&mut station, Message::Go(Uid::ALL));
    let heard = ask(&mut station, Message::Speed { uid: UID, speed: Some(800) }, 60_000);
    let changes = |is: bool| {
        heard.iter().filter_map(move |(at, frame)| match Message::of(frame) {
            Message::Input { input, change: Some(change), .. } if change.is_occupied == is => {
                Some((*at, input, change))
            }
            _ => None,
        })
    };
    let mut passes = station.world.truth().passes().iter();
    let mut count = 0;
    for (at, input, change) in changes(true) {
        let pass = passes.next().expect("a pass for each report");
        assert_eq!(pass.sensor.0 + 1, input);
        let delay = (at - pass.at).as_ms();
        // Up to a cycle of 100 ms, 18 bits of 0.167 ms, some milliseconds.
        assert!((0.9..112.0).contains(&delay), "input {input}: {delay} ms");
        assert!(!change.was_occupied);
        // The report of its becoming free follows, with how long it was occupied.
        let (free_at, _, freed) =
            changes(false).find(|(free, other, _)| *other == input && *free > at).unwrap();
        let lasted = f64::from(freed.lasted.unwrap()) * 10.0;
        assert!(((free_at - at).as_ms() - lasted).abs() < 15.0, "{lasted} ms");
        count += 1;
        if count > 15 {
            break;
        }
    }
    assert!(count > 15, "{count} reports");
}

#[test]
fn trains_run_on_without_commands_and_stop_when_it_is_switched_off() {
    let layout = two_loops();
    let mut station = station(&layout, CanSwitches::default());
    answers(&mut station, Message::Go(Uid::ALL));
    ask(&mut station, Message::Speed { uid: UID, speed: Some(600) }, 10_000);
    let odometer =
        |station: &VirtualCentralStation<'_>| station.world.truth().train(TRAIN).unwrap().odometer.as_mm();
    let before = odometer(&station);
    let later = station.now() + TimeSpan::from_s(5.0);
    while station.advance(later).is_some() {}
    assert!(odometer(&station) > before + 500.0);
    station.restart();
    assert!(!station.world.is_powered());
    assert_eq!(answers(&mut station, Message::Ping), [], "it starts");
    let later = station.now() + TimeSpan::from_s(6.0);
    while station.advance(later).is_some() {}
    let asked = Message::Speed { uid: UID, speed: None };
    assert_eq!(answers(&mut station, asked), [Message::Speed { uid: UID, speed: Some(0) }]);
    assert!(station.world.truth().train(TRAIN).unwrap().at_rest_since.is_some());
}

#[test]
fn the_quirks_that_were_reported_can_be_switched_on() {
    let layout = two_loops();
    let default = CanSwitches::default;
    let speed = Message::Speed { uid: UID, speed: Some(0) };
    let mut mute = station(&layout, CanSwitches { is_mute: true, ..default() });
    assert_eq!(answers(&mut mute, speed), []);
    assert_eq!(answers(&mut mute, Message::Ping).len(), 2);
    let mut bare = station(&layout, CanSwitches { answers_polls: false, has_list: false, ..default() });
    assert_eq!(answers(&mut bare, Message::ModulePoll { uid: Uid::ALL, modules: 2 }), []);
    assert_eq!(answers(&mut bare, Message::File(*b"loks\0\0\0\0")), []);
    let mut lossy = station(&layout, CanSwitches { lost: Ratio::from_percent(30.0), ..default() });
    let answered: usize = (0..100).map(|_| answers(&mut lossy, speed).len()).sum();
    assert!((35..=65).contains(&answered), "{answered} of 100, half on average");
    let mut twice = station(&layout, CanSwitches { duplicated: Ratio::from_percent(100.0), ..default() });
    assert_eq!(answers(&mut twice, speed).len(), 4);
    let of_input = |change| Message::Input { device: 0, input: 2, change };
    let state = answers(&mut bare, of_input(None));
    assert!(
        matches!(state[..], [Message::Input { change: Some(InputChange { is_occupied: false, .. }), .. }]),
        "{state:?}"
    );
}
