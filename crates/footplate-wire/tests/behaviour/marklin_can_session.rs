//! The session with a Central Station: its order, its repeats, what it makes of reports, and its end.

use footplate_core::{Command, Event, EventKind, Report, SensorId, SpeedStep, TimeSpan, TrainId, TurnoutId};
use footplate_wire::marklin_can::{
    Client, Direction, Frame, Framing, LocomotiveProtocol, Message, Settings, Transport, Uid,
};
use footplate_wire::{CommandError, LinkNotice, ReportedFunctions, Session};

use crate::desk::{Station, T24, T58, function, ms, speed};

/// The hash of a real track box, which the published formula does not yield.
const FOREIGN: u16 = 0x9346;
/// A station that answers as real ones do.
pub(crate) struct Central {
    transport: Transport,
    /// What was written that is no frame.
    texts: Vec<String>,
    /// Whether the station leaves a request without an answer.
    pub(crate) ignores: fn(&Message) -> bool,
}

impl Central {
    fn encoded(&self, message: Message, is_response: bool) -> Vec<u8> {
        let frame = message.frame(is_response, FOREIGN);
        match self.transport {
            Transport::Network => frame.encode().to_vec(),
            Transport::Adapter => (frame.to_text() + "\r").into_bytes(),
        }
    }
}

impl Station for Central {
    type Written = Message;
    const ANSWER: TimeSpan = TimeSpan::from_ms(4);

    fn hear(&mut self, bytes: Vec<u8>) -> (Vec<Message>, Vec<Vec<u8>>) {
        let mut framing = Framing::new(self.transport);
        let frames: Vec<Frame> = bytes.iter().filter_map(|byte| framing.push(*byte)).collect();
        let [frame] = frames[..] else {
            self.texts.push(String::from_utf8(bytes).unwrap());
            return (Vec::new(), Vec::new());
        };
        let message = Message::of(&frame);
        if frame.is_response || (self.ignores)(&message) {
            return (vec![message], Vec::new());
        }
        let bytes = answers(message).into_iter().flat_map(|answer| self.encoded(answer, true));
        (vec![message], vec![bytes.collect()])
    }
}

pub(crate) type Desk = crate::desk::Desk<Client, Central>;

/// As a station answers on which one locomotive runs backwards and input 4 is occupied.
fn answers(message: Message) -> Vec<Message> {
    match message {
        Message::Ping => vec![Message::Participant { uid: Uid(0x4746_81D4), version: (1, 39), kind: 0x10 }],
        Message::ModulePoll { modules, .. } => (1..=modules)
            .map(|module| Message::ModuleState {
                uid: Uid::ALL,
                module,
                inputs: if module == 1 { 8 } else { 0 },
            })
            .collect(),
        Message::Direction { uid, direction: None } => {
            let direction = Some(Direction::of(uid != Uid(24)));
            vec![Message::Direction { uid, direction }]
        }
        Message::Speed { uid, speed: None } => vec![Message::Speed { uid, speed: Some(0) }],
        Message::File(_) | Message::Start(_) => vec![],
        message => vec![message],
    }
}

impl Desk {
    pub(crate) fn new(settings: Settings) -> Self {
        let station = Central { transport: settings.transport, texts: Vec::new(), ignores: |_| false };
        Self::with(Client::new(ms(0), settings), station)
    }

    pub(crate) fn opened() -> Self {
        let mut desk = Self::new(Settings { modules: 2, ..Settings::default() });
        desk.run_until(ms(2_000));
        desk.written.clear();
        desk
    }

    pub(crate) fn hear(&mut self, message: Message, is_response: bool) {
        let bytes = self.station.encoded(message, is_response);
        self.client.handle_bytes(self.now, &bytes);
    }

    /// What was written but for polls.
    pub(crate) fn messages(&self) -> Vec<Message> {
        let messages = self.written.iter().map(|(_, message)| *message);
        messages.filter(|message| !matches!(message, Message::ModulePoll { .. })).collect()
    }

    fn input(&mut self, input: u16, was_occupied: bool, is_occupied: bool, lasted: u16) {
        let change =
            footplate_wire::marklin_can::InputChange { was_occupied, is_occupied, lasted: Some(lasted) };
        self.hear(Message::Input { device: 0, input, change: Some(change) }, true);
    }
}

pub(crate) fn drives(address: u32, speed: u16) -> Message {
    Message::Speed { uid: Uid(address), speed: Some(speed) }
}

#[test]
fn a_station_is_asked_who_is_there_then_for_its_states() {
    let mut desk = Desk::new(Settings { modules: 2, ..Settings::default() });
    desk.run_until(ms(3_000));
    let asked: Vec<Message> = desk.written.iter().map(|(_, message)| *message).take(4).collect();
    let poll = Message::ModulePoll { uid: Uid::ALL, modules: 2 };
    assert_eq!(asked, [Message::Ping, poll, Message::Go(Uid::ALL), Message::File(*b"loks\0\0\0\0")]);
    let identity = "a track box (Gleisbox), number 474681D4, version 1.39".to_owned();
    let expected =
        [LinkNotice::Identified(identity), LinkNotice::HeldClosed(SensorId(3)), LinkNotice::Answers];
    assert_eq!(desk.notices, expected);
    assert_eq!(desk.events, [], "states at the opening are no events");
}

#[test]
fn an_adapter_is_opened_and_the_track_box_behind_it_is_started() {
    let mut desk = Desk::new(Settings { transport: Transport::Adapter, ..Settings::default() });
    desk.station.ignores = |message| matches!(message, Message::ModulePoll { .. } | Message::File(_));
    desk.run_until(ms(4_000));
    assert_eq!(desk.station.texts, ["\r\rC\rS5\rO\r"]);
    assert_eq!(desk.messages()[..2], [Message::Start(Uid::ALL), Message::Ping]);
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers), "it has no S88 modules and no list to give");
    // From then on it is asked whether it is there.
    let late = desk.written.iter().filter(|(at, message)| *at > 3_000 && *message == Message::Ping);
    assert!(late.count() >= 1);
}

#[test]
fn the_direction_is_read_back_and_then_absolute() {
    let mut desk = Desk::opened();
    for command in [speed(T24, 8), speed(T58, 9)] {
        desk.command(command);
    }
    desk.run_for(300);
    let asks = |uid| Message::Direction { uid: Uid(uid), direction: None };
    assert_eq!(desk.messages(), [asks(24), asks(58), drives(24, 571), drives(58, 642)]);
    desk.written.clear();
    for command in [speed(T24, 0), Command::Reverse { train: T24 }, speed(T24, 14)] {
        desk.command(command);
        desk.run_for(100);
    }
    // It ran backwards.
    let forward = Message::Direction { uid: Uid(24), direction: Some(Direction::Forward) };
    assert_eq!(desk.messages(), [drives(24, 0), forward, drives(24, 1000)]);
    let kinds: Vec<EventKind> = desk.events.iter().skip(2).map(|event| event.kind).collect();
    let step = |step| EventKind::Speed { train: T24, step: SpeedStep::new(step).unwrap() };
    assert_eq!(kinds, [step(0), EventKind::Reverse { train: T24 }, step(14)]);
}

#[test]
fn a_station_that_answers_no_questions_is_commanded_a_direction() {
    let mut desk = Desk::opened();
    desk.station.ignores = |message| matches!(message, Message::Direction { .. });
    desk.command(speed(T24, 8));
    desk.run_for(2_500);
    let forward = Message::Direction { uid: Uid(24), direction: Some(Direction::Forward) };
    assert!(
        desk.messages().contains(&forward) && desk.messages().contains(&drives(24, 571)),
        "{:?}",
        desk.written
    );
}

#[test]
fn a_station_that_tells_no_direction_is_commanded_the_one_of_the_session_before() {
    let mut desk = Desk::opened();
    desk.station.ignores = |message| matches!(message, Message::Direction { .. });
    desk.client.set_direction(T58, false);
    desk.command(speed(T58, 8));
    desk.run_for(2_500);
    let directions = |desk: &Desk| {
        let commanded = desk.messages().into_iter().filter_map(|message| match message {
            Message::Direction { uid: Uid(58), direction } => direction,
            _ => None,
        });
        commanded.collect::<Vec<_>>()
    };
    assert_eq!(directions(&desk).first(), Some(&Direction::Backward));
}

#[test]
fn a_station_that_is_off_is_asked_for_a_direction_until_it_answers() {
    let mut desk = Desk::opened();
    desk.station.ignores = |_| true;
    desk.command(speed(T24, 8));
    desk.run_for(5_000);
    let commands = |message: &Message| matches!(message, Message::Direction { direction: Some(_), .. });
    assert!(!desk.messages().iter().any(commands), "{:?}", desk.written);
    desk.station.ignores = |message| matches!(message, Message::File(_));
    desk.run_for(3_000);
    // It ran backwards, as the station says now.
    assert_eq!(desk.directions, [(T24, false)]);
    assert!(desk.messages().contains(&drives(24, 571)) && !desk.messages().iter().any(commands));
}

#[test]
fn what_is_not_confirmed_is_repeated_and_given_up_if_it_stops_nothing() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.station.ignores = |message| matches!(message, Message::Speed { .. });
    desk.written.clear();
    desk.command(speed(T24, 9));
    desk.run_for(3_000);
    let times = |desk: &Desk, message| -> Vec<i64> {
        desk.written.iter().filter(|(_, other)| *other == message).map(|(at, _)| *at).collect()
    };
    let repeats = times(&desk, drives(24, 642));
    assert_eq!(repeats.len(), 4, "{:?}", desk.written);
    assert!(repeats.windows(2).all(|pair| pair[1] - pair[0] == 250), "{repeats:?}");
    assert!(desk.notices.contains(&LinkNotice::Unconfirmed(speed(T24, 9))));
    desk.command(speed(T24, 0));
    desk.run_for(2_000);
    let stops = times(&desk, drives(24, 0));
    assert!(stops.len() >= 18 && stops[1] - stops[0] == 100, "{stops:?}");
}

#[test]
fn a_confirmation_that_is_rounded_to_the_steps_of_a_decoder_counts() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.station.ignores = |message| matches!(message, Message::Speed { .. });
    desk.written.clear();
    desk.command(speed(T24, 9));
    desk.run_for(10);
    desk.hear(drives(24, 645), true);
    desk.run_for(1_000);
    assert_eq!(desk.messages(), [drives(24, 642)]);
}

#[test]
fn a_report_is_dated_by_the_network_the_cycle_and_the_time_it_carries() {
    let mut desk = Desk::opened();
    desk.station.ignores = |message| matches!(message, Message::ModulePoll { .. });
    let began = desk.now;
    desk.input(17, false, true, 0);
    // The same datagram again, one without the response bit, one of input 4 that was occupied from the start.
    desk.input(17, false, true, 0);
    desk.input(4, true, false, 300);
    desk.run_for(1);
    let Event { time, kind: EventKind::Sensor(Report { sensor, poll_interval }) } = desk.events[0] else {
        panic!("{:?}", desk.events)
    };
    assert_eq!((desk.events.len(), sensor), (1, SensorId(16)));
    // 0.52 ms on the bus and 17 × 0.167 ms on the way to the station; then up to 100 ms, and what a network may take.
    assert_eq!(began - time, TimeSpan::from_us(520 + 2_839));
    assert_eq!(poll_interval, Some(TimeSpan::from_us(100_000 + 20_000 - 520)));
    // It became free after 0.50 s and occupied 2.00 s later; both reports were quick. The third is held up by 15 ms.
    desk.run_for(499);
    desk.input(17, true, false, 50);
    desk.run_for(2_015);
    desk.input(17, false, true, 200);
    desk.run_for(1);
    let Event { kind: EventKind::Sensor(report), .. } = desk.events[1] else { panic!("{:?}", desk.events) };
    assert!(report.poll_interval.unwrap() < TimeSpan::from_ms(120) - TimeSpan::from_us(5_000), "{report:?}");
}

#[test]
fn a_report_that_was_lost_is_made_up_for_by_asking() {
    let mut desk = Desk::opened();
    desk.station.ignores = |message| matches!(message, Message::ModulePoll { .. });
    desk.hear(Message::ModuleState { uid: Uid::ALL, module: 2, inputs: 1 }, true);
    desk.run_for(1);
    let Event { kind: EventKind::Sensor(report), .. } = desk.events[0] else { panic!("{:?}", desk.events) };
    assert_eq!(report.sensor, SensorId(16));
    assert!(report.poll_interval.unwrap() > TimeSpan::from_ms(900), "since it was asked before: {report:?}");
}

#[test]
fn a_turnouts_coil_is_powered_for_200_ms_one_turnout_after_the_other() {
    let mut desk = Desk::opened();
    for (number, curved) in [(5, false), (6, true)] {
        desk.command(Command::Turnout { turnout: TurnoutId(number), curved });
    }
    desk.run_for(900);
    let coil = |uid, position, current| Message::Accessory { uid: Uid(uid), position, current, time: None };
    assert_eq!(
        desk.messages(),
        [coil(0x3004, 1, 1), coil(0x3004, 1, 0), coil(0x3005, 0, 1), coil(0x3005, 0, 0)]
    );
    let at: Vec<i64> = desk
        .written
        .iter()
        .filter(|(_, message)| matches!(message, Message::Accessory { .. }))
        .map(|(at, _)| *at)
        .collect();
    assert_eq!(at[1] - at[0], 200, "{at:?}");
    // Somebody else throws one.
    desk.events.clear();
    desk.hear(coil(0x3006, 0, 1), true);
    desk.run_for(1);
    let thrown = EventKind::Turnout { turnout: TurnoutId(7), curved: true };
    assert_eq!(desk.events.iter().map(|event| event.kind).collect::<Vec<_>>(), [thrown]);
}

#[test]
fn pings_of_others_are_answered_and_echoes_are_not() {
    let mut desk = Desk::opened();
    desk.hear(Message::Ping, false);
    desk.run_for(1);
    assert!(matches!(desk.messages()[..], [Message::Participant { kind: 0xFFE0, .. }]), "{:?}", desk.written);
    desk.written.clear();
    let own = footplate_wire::marklin_can::hash_of(Settings::default().uid.0);
    desk.client.handle_bytes(desk.now, &Message::Ping.frame(false, own).encode());
    desk.run_for(1);
    assert_eq!(desk.messages(), []);
}

#[test]
fn another_throttle_is_noticed_when_asking_confirms_it() {
    let mut desk = Desk::opened();
    desk.command(speed(T58, 8));
    desk.run_for(200);
    desk.written.clear();
    // An old confirmation and a real change look alike: the station is asked.
    desk.hear(drives(58, 900), true);
    desk.run_for(100);
    assert!(desk.messages().contains(&Message::Speed { uid: Uid(58), speed: None }));
    assert!(
        desk.notices.contains(&LinkNotice::OtherThrottle { train: T58, reversed: false }),
        "{:?}",
        desk.notices
    );
    desk.hear(Message::Stop(Uid::ALL), true);
    desk.run_for(1);
    assert!(desk.notices.contains(&LinkNotice::PowerLost));
}

#[test]
fn silence_is_noticed_and_everything_asked_again_after_it() {
    let mut desk = Desk::opened();
    desk.command(speed(T58, 8));
    desk.run_for(200);
    desk.station.ignores = |_| true;
    desk.run_for(4_000);
    let silent = |notice: &LinkNotice| matches!(notice, LinkNotice::Silent { .. });
    assert_eq!(desk.notices.iter().filter(|notice| silent(notice)).count(), 1, "{:?}", desk.notices);
    desk.station.ignores = |message| matches!(message, Message::File(_));
    desk.run_for(3_000);
    // It says that 58 stands, which was commanded to run: it was switched off and on.
    assert!(
        desk.notices.contains(&LinkNotice::Restarted)
            || desk.notices.contains(&LinkNotice::OtherThrottle { train: T58, reversed: false }),
        "{:?}",
        desk.notices
    );
    assert!(desk.notices.contains(&LinkNotice::Answers));
}

#[test]
fn the_end_is_confirmed_by_the_station() {
    let mut desk = Desk::opened();
    desk.drive_two();
    desk.client.close(desk.now);
    desk.run_for(500);
    assert_eq!(desk.messages(), [drives(24, 0), drives(58, 0), Message::Stop(Uid::ALL)]);
    let closing = desk.client.closing();
    assert!(closing.is_complete(), "{closing}");
    assert_eq!(desk.client.handle_command(desk.now, speed(T24, 3)), Err(CommandError::Closed));
}

#[test]
fn a_train_that_was_never_driven_here_is_stopped_at_the_end_if_that_was_commanded() {
    let mut desk = Desk::new(Settings::default());
    desk.command(speed(T24, 0));
    let closing = desk.close(500);
    assert_eq!((closing.is_complete(), closing.commanded_to_stop), (true, vec![T24]));
    assert!(desk.messages().contains(&drives(24, 0)));
    // The list has not been read: its number may be another.
    let at = |message| desk.messages().iter().position(|written| *written == message);
    assert!(at(Message::Halt(Uid::ALL)) < at(Message::Stop(Uid::ALL)), "{:?}", desk.messages());
    assert!(at(Message::Halt(Uid::ALL)).is_some(), "{:?}", desk.messages());
}

#[test]
fn what_was_not_confirmed_at_the_end_is_named() {
    let mut desk = Desk::opened();
    desk.drive_two();
    desk.station.ignores = |message| *message == drives(58, 0);
    let closing = desk.close(5_000);
    assert!(!closing.is_complete() && closing.power_off, "{closing}");
    assert_eq!((closing.commanded_to_stop, closing.not_commanded), (vec![T24], vec![T58]));
}

#[test]
fn the_end_on_a_line_from_which_nothing_is_heard_stops_trains_at_once_and_takes_the_power() {
    let mut desk = Desk::opened();
    desk.drive_two();
    desk.station.ignores = |_| true;
    let began = (desk.now - ms(0)).as_ns() / 1_000_000;
    desk.client.handle_reopened(desk.now);
    desk.client.close(desk.now);
    desk.run_for(3_000);
    let first =
        |message| desk.written.iter().find(|(_, other)| *other == message).expect("it is written").0 - began;
    assert!(first(drives(24, 0)) <= 20 && first(drives(58, 0)) <= 20, "{:?}", desk.written);
    assert!(first(Message::Stop(Uid::ALL)) <= 1_510, "{:?}", desk.written);
    assert!(!desk.client.closing().is_complete());
}

#[test]
fn noise_is_called_noise_once() {
    let mut desk = Desk::opened();
    desk.assert_noise(40, &[0xFF; 7], "15731");
}

#[test]
fn what_the_station_does_not_know_is_refused() {
    let mut desk = Desk::new(Settings { locomotives: LocomotiveProtocol::Dcc, ..Settings::default() });
    desk.assert_refused(&[
        (speed(TrainId(0), 3), "train 0 has no address here; addresses are 1 to 10239"),
        (speed(T24, 15), "step 15 is beyond the decoder; steps are 0 to 14"),
        (
            Command::Turnout { turnout: TurnoutId(321), curved: true },
            "turnout 321 has no address here; addresses are 1 to 320",
        ),
    ]);
}

#[test]
fn functions_are_switched_one_by_one() {
    let mut desk = Desk::opened();
    desk.command(function(T24, 0, true));
    desk.command(function(T24, 28, false));
    desk.run_for(600);
    let switched = |function, value| Message::Function { uid: Uid(24), function, value: Some(value) };
    let functions: Vec<Message> =
        desk.messages().into_iter().filter(|message| matches!(message, Message::Function { .. })).collect();
    assert_eq!(functions, [switched(0, 1), switched(28, 0)], "both are confirmed");
    assert_eq!(desk.events, []);
    assert_eq!(desk.functions[&T24], ReportedFunctions { known: 1 | 1 << 28, on: 1 });
    // The station confirms what another throttle asked for; of F3 nothing was known, so that it is no change.
    for (function, value) in [(3, 0), (0, 0)] {
        let message = Message::Function { uid: Uid(24), function, value: Some(value) };
        let heard = desk.station.encoded(message, true);
        desk.client.handle_bytes(desk.now, &heard);
        desk.run_for(10);
    }
    let functions = ReportedFunctions { known: 1 | 1 << 3 | 1 << 28, on: 0 };
    assert_eq!(desk.functions[&T24], functions);
    assert_eq!(desk.notices.last(), Some(&LinkNotice::OtherFunctions { train: T24, functions }));
}
