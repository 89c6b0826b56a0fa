//! The session with a LocoNet server: its order, its slots, and what it does when something is lost or taken away.

use std::collections::BTreeMap;

use footplate_core::control::LinkNews;
use footplate_core::{Command, EventKind, SensorId, TimeSpan, TrainId, TurnoutId};
use footplate_wire::loconet::{
    Client, FunctionGroup, FunctionPacket, Line, Lines, Message, Settings, SlotData, SlotUse,
};
use footplate_wire::{CommandError, LinkNotice, ReportedFunctions, Session};

use crate::desk::{Station, T24, T58, function, ms, speed};

/// A server and a command station that answer as the protocols say.
pub(crate) struct Server {
    pub(crate) slots: BTreeMap<u8, SlotData>,
    pub(crate) power: bool,
    occupied: Vec<u16>,
    /// How many slots there are.
    room: u8,
    /// Messages that the server cannot put on the bus, by their count.
    loses: fn(usize) -> bool,
    /// Whether the server answers, whether the command station has power, and whether the server echoes.
    answers: bool,
    pub(crate) is_on: bool,
    echoes: bool,
    count: usize,
}

impl Server {
    fn slot(&self, slot: u8) -> SlotData {
        let track = SlotData::track_bits(self.power, false);
        let free = SlotData {
            slot,
            status: 3,
            address: 0,
            speed: 0,
            forward: true,
            functions: 0,
            track,
            rest: [0; 3],
        };
        SlotData { track, ..self.slots.get(&slot).copied().unwrap_or(free) }
    }

    fn obey(&mut self, message: Message) -> Vec<Message> {
        match message {
            Message::PowerOn => self.power = true,
            Message::PowerOff => self.power = false,
            Message::StopAll => self.slots.values_mut().for_each(|slot| slot.speed = 1),
            Message::Speed { slot, speed } => {
                self.slots.entry(slot).and_modify(|of| of.speed = speed);
            }
            Message::Direction { slot, forward, functions } => {
                let sound = FunctionGroup::Sound.mask();
                self.slots.entry(slot).and_modify(|of| {
                    (of.forward, of.functions) = (forward, functions | of.functions & sound);
                });
            }
            Message::Sound { slot, functions } => {
                let others = FunctionGroup::Direction.mask();
                self.slots.entry(slot).and_modify(|of| of.functions = functions | of.functions & others);
            }
            Message::Functions(_) => return vec![Message::LongAck { opcode: 0x6D, code: 0x7F }],
            Message::Locomotive { address } => {
                let known = self.slots.values().find(|slot| slot.address == address).map(|slot| slot.slot);
                let Some(slot) =
                    known.or_else(|| (1..=self.room).find(|slot| !self.slots.contains_key(slot)))
                else {
                    return vec![Message::LongAck { opcode: 0x3F, code: 0 }];
                };
                let data = SlotData { address, ..self.slot(slot) };
                self.slots.entry(slot).or_insert(data.used_as(SlotUse::Common));
                return vec![Message::Slot(self.slot(slot))];
            }
            Message::MoveSlots { from, to } if from == to => {
                let used = self.slot(from).used_as(SlotUse::InUse);
                self.slots.insert(from, used);
                return vec![Message::Slot(self.slot(from))];
            }
            Message::ReadSlot { slot } => return vec![Message::Slot(self.slot(slot))],
            Message::Switch { address: 1_017, closed: true, .. } => {
                let occupied = self.occupied.iter();
                return occupied
                    .map(|number| Message::Input { number: *number, is_occupied: true })
                    .collect();
            }
            _ => {}
        }
        vec![]
    }
}

impl Station for Server {
    type Written = Message;
    const ANSWER: TimeSpan = TimeSpan::from_ms(6);

    fn hear(&mut self, bytes: Vec<u8>) -> (Vec<Message>, Vec<Vec<u8>>) {
        let mut lines = Lines::default();
        let read: Vec<Line> =
            bytes.iter().filter_map(|byte| lines.push(*byte).map(|line| Line::read(line).unwrap())).collect();
        let [Line::Send(message)] = read[..] else { unreachable!("{read:?}") };
        self.count += 1;
        if !self.answers {
            return (vec![message], vec![]);
        }
        if (self.loses)(self.count) {
            return (vec![message], vec![b"SENT ERROR Did not receive echo\r\n".to_vec()]);
        }
        let echo = self.echoes.then_some(message).into_iter();
        let mut answer: String = echo.map(|message| Line::Receive(message).text()).collect();
        answer.push_str("SENT OK\r\n");
        let heard = if self.is_on { self.obey(message) } else { vec![] };
        answer.extend(heard.into_iter().map(|message| Line::Receive(message).text()));
        (vec![message], vec![answer.into_bytes()])
    }
}

pub(crate) type Desk = crate::desk::Desk<Client, Server>;

impl Desk {
    pub(crate) fn new(settings: Settings) -> Self {
        let station = Server {
            slots: BTreeMap::new(),
            power: false,
            occupied: vec![4],
            room: 10,
            loses: |_| false,
            answers: true,
            is_on: true,
            echoes: true,
            count: 0,
        };
        Self::with(Client::new(ms(0), settings), station)
    }

    pub(crate) fn opened() -> Self {
        let mut desk = Self::new(Settings::default());
        desk.run_until(ms(3_000));
        assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers), "{:?}", desk.written);
        desk.written.clear();
        desk.notices.clear();
        desk
    }

    fn hear(&mut self, message: Message) {
        self.client.handle_bytes(self.now, Line::Receive(message).text().as_bytes());
    }

    /// What was written that changes something.
    fn commands(&self) -> Vec<Message> {
        let messages = self.written.iter().map(|(_, message)| *message);
        messages.filter(|message| !matches!(message, Message::ReadSlot { .. })).collect()
    }
}

fn drives(slot: u8, speed: u8) -> Message {
    Message::Speed { slot, speed }
}

#[test]
fn the_station_is_asked_for_its_state_and_detectors_for_theirs() {
    let mut desk = Desk::new(Settings::default());
    desk.client.handle_bytes(ms(0), b"VERSION LbServer 0.1a\r\n");
    desk.run_until(ms(3_000));
    let messages: Vec<Message> = desk.written.iter().map(|(_, message)| *message).collect();
    assert_eq!(
        messages[..3],
        [Message::ReadSlot { slot: 0 }, Message::PowerOn, Message::ReadSlot { slot: 0 }]
    );
    let asked = |closed| (1_017..=1_020).map(move |address| Message::Switch { address, closed, on: false });
    assert!(messages[3..11].iter().copied().eq(asked(true).chain(asked(false))), "{messages:?}");
    let expected = [
        LinkNotice::Identified("LbServer 0.1a".to_owned()),
        LinkNotice::HeldClosed(SensorId(3)),
        LinkNotice::Answers,
    ];
    assert_eq!(desk.notices, expected);
    assert!(desk.events.is_empty() && desk.station.power);
}

#[test]
fn a_train_gets_a_slot_before_it_is_driven() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(300);
    let acquired = [Message::Locomotive { address: 24 }, Message::MoveSlots { from: 1, to: 1 }];
    assert_eq!(desk.commands(), [&acquired[..], &[drives(1, 73)]].concat());
    assert_eq!(
        desk.station.slots[&1].speed, 73,
        "eight fourteenths of 126 steps, and one for the emergency stop"
    );
    assert!(
        matches!(desk.events[..], [event] if event.kind == EventKind::Speed { train: T24, step: footplate_core::SpeedStep::new(8).unwrap() })
    );
}

#[test]
fn reversing_stops_first_and_keeps_the_functions() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(300);
    desk.station.slots.entry(1).and_modify(|slot| slot.functions = 0x11);
    desk.run_for(1_500);
    desk.written.clear();
    desk.command(Command::Reverse { train: T24 });
    desk.command(speed(T24, 4));
    desk.run_for(400);
    let reversed = Message::Direction { slot: 1, forward: false, functions: 0x11 };
    assert_eq!(desk.commands(), [drives(1, 0), reversed, drives(1, 37)]);
    // They were switched elsewhere.
    let functions = ReportedFunctions { known: SlotData::FUNCTIONS, on: 0x11 };
    assert_eq!(desk.notices, [LinkNotice::OtherFunctions { train: T24, functions }]);
}

#[test]
fn a_decoder_of_126_steps_is_driven_in_each_of_them() {
    let mut desk = Desk::opened();
    desk.client.set_decoder(T24, footplate_core::DecoderSteps::All).unwrap();
    desk.command(speed(T24, 63));
    desk.run_for(500);
    assert!(desk.commands().contains(&drives(1, 64)), "{:?}", desk.commands());
}

#[test]
fn a_stop_waits_for_one_request_at_most_and_is_written_until_the_station_has_it() {
    let mut desk = Desk::opened();
    for train in [T24, T58] {
        desk.command(speed(train, 8));
    }
    desk.run_for(500);
    for step in 1..=14 {
        desk.command(speed(T58, step));
        desk.command(speed(TrainId(100 + u16::from(step)), 3));
    }
    desk.written.clear();
    let asked = desk.now;
    desk.command(speed(T24, 0));
    desk.run_for(100);
    let (at, _) = desk.written.iter().find(|(_, message)| *message == drives(1, 0)).expect("a stop");
    assert!(ms(*at) - asked < TimeSpan::from_ms(40), "{:?}", desk.written);

    desk.station.loses = |count| !count.is_multiple_of(12);
    desk.command(speed(T58, 0));
    desk.run_for(30_000);
    assert_eq!(desk.station.slots[&2].speed, 0);
}

#[test]
fn a_server_without_echoes_and_one_that_fails_now_and_then_are_worked_with() {
    let mut desk = Desk::opened();
    desk.station.echoes = false;
    desk.station.loses = |count| count.is_multiple_of(3);
    desk.command(Command::Turnout { turnout: TurnoutId(7), curved: true });
    desk.command(speed(T24, 5));
    desk.run_for(5_000);
    assert_eq!(desk.station.slots[&1].speed, 46);
    let thrown = |on| Message::Switch { address: 7, closed: false, on };
    let switched: Vec<(i64, Message)> = desk
        .written
        .iter()
        .copied()
        .filter(|(_, message)| matches!(message, Message::Switch { .. }))
        .collect();
    let on: Vec<i64> = switched.iter().filter(|(_, of)| *of == thrown(true)).map(|(at, _)| *at).collect();
    let off: Vec<i64> = switched.iter().filter(|(_, of)| *of == thrown(false)).map(|(at, _)| *at).collect();
    assert!(off.last().unwrap() - on.last().unwrap() >= 150, "{switched:?}");
}

#[test]
fn a_release_that_the_server_could_not_send_is_repeated() {
    let mut desk = Desk::opened();
    desk.command(Command::Turnout { turnout: TurnoutId(7), curved: true });
    desk.run_for(100);
    desk.station.loses = |_| true;
    desk.run_for(100);
    desk.station.loses = |_| false;
    desk.run_for(1_000);
    let thrown = |on| Message::Switch { address: 7, closed: false, on };
    assert_eq!(desk.commands(), [thrown(true), thrown(false), thrown(false)]);
}

#[test]
fn turnouts_of_others_are_entered_and_own_ones_once() {
    let mut desk = Desk::opened();
    desk.command(Command::Turnout { turnout: TurnoutId(7), curved: true });
    desk.run_for(400);
    desk.hear(Message::Switch { address: 7, closed: true, on: true });
    desk.hear(Message::Switch { address: 7, closed: true, on: false });
    desk.run_for(100);
    let thrown: Vec<EventKind> = desk.events.iter().map(|event| event.kind).collect();
    let turnout = TurnoutId(7);
    let expected =
        [EventKind::Turnout { turnout, curved: true }, EventKind::Turnout { turnout, curved: false }];
    assert_eq!(thrown, expected);
}

#[test]
fn a_report_reaches_back_over_the_delay_of_the_bus() {
    let mut desk = Desk::opened();
    desk.run_until(ms(5_000));
    for is_occupied in [true, true, false, true] {
        desk.hear(Message::Input { number: 12, is_occupied });
    }
    desk.run_for(10);
    let reports = desk.reports();
    assert_eq!(reports.len(), 2, "{reports:?}");
    assert_eq!(reports[0], (4_997, 11, 37), "2.4 ms on the bus; up to 40 ms in all");
}

#[test]
fn another_throttle_is_noticed() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(300);
    desk.station.obey(drives(1, 20));
    desk.hear(drives(1, 20));
    desk.run_for(300);
    assert_eq!(desk.notices, [LinkNotice::OtherThrottle { train: T24, reversed: false }]);
    assert_eq!(desk.notices[0].news(), Some(LinkNews::OtherThrottle { train: T24 }));
}

#[test]
fn a_station_without_a_free_slot_is_named_once() {
    let mut desk = Desk::opened();
    desk.station.room = 1;
    desk.command(speed(T24, 8));
    desk.run_for(300);
    desk.command(speed(T58, 8));
    desk.run_for(3_000);
    assert_eq!(desk.notices, [LinkNotice::NoSlot(T58)]);
    // As soon as one is free it drives.
    desk.station.room = 2;
    desk.run_for(1_000);
    assert_eq!(desk.station.slots[&2].speed, 73);
}

#[test]
fn slots_are_refreshed_before_the_station_gives_them_away() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(180_000);
    let refreshed = desk.written.iter().filter(|(_, message)| *message == drives(1, 73)).count();
    assert!((3..=4).contains(&refreshed), "{refreshed}");
    assert!(desk.notices.is_empty(), "{:?}", desk.notices);
}

#[test]
fn a_station_that_was_restarted_gets_everything_again() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(300);
    desk.command(Command::Reverse { train: T24 });
    desk.command(speed(T24, 8));
    desk.run_for(600);
    desk.station.slots.clear();
    desk.station.power = false;
    desk.written.clear();
    desk.run_for(4_000);
    assert!(desk.notices.contains(&LinkNotice::Restarted), "{:?}", desk.notices);
    assert!(desk.station.power);
    let slot = desk.station.slots[&1];
    assert_eq!((slot.address, slot.speed, slot.forward), (24, 0, false), "it stands, in its own direction");
    assert!(!desk.notices.contains(&LinkNotice::ReverseInDoubt(T24)), "{:?}", desk.notices);
}

#[test]
fn silence_and_noise_are_reported_with_what_to_check() {
    let mut desk = Desk::opened();
    desk.station.answers = false;
    desk.run_for(4_000);
    let [LinkNotice::Silent { bytes: 0, check, .. }] = desk.notices[..] else { panic!("{:?}", desk.notices) };
    assert!(check.contains("LbServer"));
    desk.station.answers = true;
    desk.run_for(4_000);
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
    desk.notices.clear();
    // A server without a command station behind it returns what it is sent.
    desk.station.is_on = false;
    desk.run_for(4_000);
    let silent = |notice: &&LinkNotice| matches!(notice, LinkNotice::Silent { .. });
    assert_eq!(desk.notices.iter().filter(silent).count(), 1, "{:?}", desk.notices);
    desk.station.is_on = true;
    desk.run_for(4_000);
    desk.notices.clear();
    for _ in 0..20 {
        desk.client.handle_bytes(desk.now, b"HTTP/1.1 400 Bad Request\r\n");
    }
    desk.run_for(100);
    let unreadable = |notice: &&LinkNotice| matches!(notice, LinkNotice::Unreadable { .. });
    assert_eq!(desk.notices.iter().filter(unreadable).count(), 1, "{:?}", desk.notices);
}

#[test]
fn the_end_is_confirmed_by_the_station() {
    let mut desk = Desk::opened();
    for train in [T24, T58] {
        desk.command(speed(train, 8));
    }
    desk.run_for(500);
    desk.written.clear();
    let closing = desk.close(1_000);
    assert!(closing.is_complete(), "{closing}");
    assert_eq!(desk.commands(), [drives(1, 0), drives(2, 0), Message::PowerOff]);
    assert!(matches!(desk.notices.last(), Some(LinkNotice::Closed(_))));
    assert_eq!(desk.client.next_timeout(), None);
    assert_eq!(desk.client.handle_command(desk.now, speed(T24, 1)), Err(CommandError::Closed));
}

#[test]
fn a_train_that_was_never_driven_here_is_stopped_at_the_end_if_that_was_commanded() {
    let mut desk = Desk::new(Settings::default());
    desk.station.obey(Message::Locomotive { address: 24 });
    desk.station.obey(drives(1, 90));
    desk.command(speed(T24, 0));
    desk.client.close(desk.now);
    desk.run_for(2_000);
    assert_eq!(desk.written[1].1, Message::StopAll, "{:?}", desk.written);
    assert_eq!(desk.station.slots[&1].speed, 0);
    assert!(!desk.station.power && desk.client.closing().is_complete(), "{}", desk.client.closing());
}

#[test]
fn what_the_bus_has_no_address_for_is_refused() {
    let mut desk = Desk::opened();
    let mut refuse = |command| desk.client.handle_command(ms(3_000), command).unwrap_err();
    assert!(matches!(refuse(speed(TrainId(9_984), 1)), CommandError::Train { addresses: (1, 9_983), .. }));
    assert!(matches!(refuse(speed(T24, 15)), CommandError::Step { highest: 14, .. }));
    let turnout = Command::Turnout { turnout: TurnoutId(2_049), curved: true };
    assert!(matches!(refuse(turnout), CommandError::Turnout { addresses: (1, 2_048), .. }));
}

#[test]
fn functions_keep_the_direction_and_one_another() {
    let mut desk = Desk::opened();
    desk.command(Command::Reverse { train: T24 });
    desk.run_for(600);
    for (number, on) in [(0, true), (2, true), (4, true), (2, false)] {
        desk.command(function(T24, number, on));
    }
    desk.run_for(1_000);
    let slot = desk.station.slots[&1];
    assert_eq!((slot.forward, slot.functions), (false, 0x11), "F0 and F4");
    desk.command(Command::Reverse { train: T24 });
    desk.run_for(600);
    let slot = desk.station.slots[&1];
    assert_eq!((slot.forward, slot.functions), (true, 0x11));
}

#[test]
fn functions_from_f5_are_in_the_slot_and_from_f9_in_packets_that_keep_one_another() {
    let mut desk = Desk::opened();
    for (number, on) in [(0, true), (5, true), (8, true), (5, false), (6, true)] {
        desk.command(function(T24, number, on));
    }
    desk.run_for(1_000);
    assert_eq!(desk.station.slots[&1].functions, 1 | 1 << 6 | 1 << 8);
    desk.written.clear();
    desk.command(function(T24, 9, true));
    desk.run_for(200);
    desk.command(function(T24, 12, true));
    desk.command(function(T24, 28, true));
    desk.run_for(500);
    let packet = |group, functions| Message::Functions(FunctionPacket { address: 24, group, functions });
    let expected = [
        packet(FunctionGroup::F9To12, 1 << 9),
        packet(FunctionGroup::F9To12, 1 << 9 | 1 << 12),
        packet(FunctionGroup::F21To28, 1 << 28),
    ];
    assert_eq!(desk.commands(), expected, "each once: the station accepts them");
    assert!(desk.notices.is_empty(), "{:?}", desk.notices);
    // The slot confirms F0 to F8, an accepted packet its own group; nothing is known of F13 to F20.
    let known = 0x1FFF | 0xFF << 21;
    let on = 1 | 1 << 6 | 1 << 8 | 1 << 9 | 1 << 12 | 1 << 28;
    assert_eq!(desk.functions[&T24], ReportedFunctions { known, on });
    // Another throttle switches F5: its slot is read again.
    let sound = Message::Sound { slot: 1, functions: 0xF << 5 };
    desk.station.obey(sound);
    desk.hear(sound);
    desk.run_for(300);
    let functions = ReportedFunctions { known, on: on | 0xF << 5 };
    assert_eq!(desk.notices, [LinkNotice::OtherFunctions { train: T24, functions }]);
}
