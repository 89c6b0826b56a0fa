//! The session with JMRI: its opening, its throttles, and what it does when a connection ends or another client interferes.

use std::collections::BTreeMap;

use footplate_core::{Command, DecoderSteps, EventKind, SensorId, SpeedStep, TimeSpan, TrainId, TurnoutId};
use footplate_wire::dcc_ex::Throttle;
use footplate_wire::jmri::{Client, Reply, Request, Settings, ThrottleMessage};
use footplate_wire::{CommandError, LinkNotice, ReportedFunctions, Session};

use crate::desk::{Station, T24, T58, function, ms, speed};

/// JMRI as its sources describe it.
pub(crate) struct Jmri {
    systems: Vec<(&'static str, Option<&'static str>, bool)>,
    /// Whether the track has power; `None` if the hardware does not say.
    power: Option<bool>,
    sensors: BTreeMap<&'static str, bool>,
    throttles: BTreeMap<String, (Throttle, bool, u32)>,
    turnouts: BTreeMap<String, bool>,
    /// How many locomotives its hardware drives.
    room: usize,
    answers: bool,
}

impl Jmri {
    fn whole(&self, name: &str) -> Reply {
        let (throttle, forward, functions) = self.throttles[name];
        Reply::Throttle(ThrottleMessage {
            name: name.to_owned(),
            address: name.parse().ok(),
            throttle: Some(throttle),
            forward: Some(forward),
            functions: ReportedFunctions::all(functions),
            ..ThrottleMessage::default()
        })
    }

    fn state(&self, name: &str) -> Reply {
        Reply::Sensor { name: name.to_owned(), active: self.sensors.get(name).copied() }
    }

    fn power_of(&self, (system, prefix, is_default): (&str, Option<&str>, bool)) -> Reply {
        let on = self.power.filter(|_| is_default);
        Reply::Power { system: system.to_owned(), prefix: prefix.map(str::to_owned), is_default, on }
    }

    fn obey(&mut self, request: &Request) -> Vec<Reply> {
        match request {
            Request::Ping => vec![Reply::Pong],
            Request::Powers => {
                vec![Reply::List(self.systems.iter().map(|system| self.power_of(*system)).collect())]
            }
            Request::Power { system, on } => {
                self.power = self.power.map(|_| *on);
                let wanted = |(name, _, is_default): &&(&str, Option<&str>, bool)| {
                    system.as_ref().map_or(*is_default, |system| system == name)
                };
                self.systems.iter().find(wanted).map(|system| self.power_of(*system)).into_iter().collect()
            }
            Request::Sensors => {
                vec![Reply::List(self.sensors.keys().map(|name| self.state(name)).collect())]
            }
            Request::Sensor { name } => vec![self.state(name)],
            Request::Turnout { name, thrown } if name.starts_with("LT") => {
                self.turnouts.insert(name.clone(), *thrown);
                vec![Reply::Turnout { name: name.clone(), thrown: Some(*thrown) }]
            }
            Request::Turnout { name, .. } => {
                vec![Reply::Error { code: 404, message: format!("turnout {name} not found") }]
            }
            Request::Throttle(message) => {
                let is_new = !self.throttles.contains_key(&message.name);
                if is_new && self.throttles.len() >= self.room {
                    return vec![Reply::Error { code: 512, message: "no throttle".to_owned() }];
                }
                // Orders in the message that asks for a throttle are lost where the hardware takes its time.
                let state =
                    self.throttles.entry(message.name.clone()).or_insert((Throttle::Speed(0), true, 0));
                if !is_new {
                    state.0 = message.throttle.unwrap_or(state.0);
                    state.1 = message.forward.unwrap_or(state.1);
                    state.2 = state.2 & !message.functions.known | message.functions.on;
                }
                vec![self.whole(&message.name)]
            }
        }
    }
}

impl Station for Jmri {
    type Written = Request;
    const ANSWER: TimeSpan = TimeSpan::from_ms(4);

    fn hear(&mut self, bytes: Vec<u8>) -> (Vec<Request>, Vec<Vec<u8>>) {
        let text = String::from_utf8(bytes).unwrap();
        let request = Request::read(text.trim_end()).unwrap().unwrap();
        let answers = if self.answers { self.obey(&request) } else { vec![] };
        (vec![request], answers.into_iter().map(|reply| reply.text().into_bytes()).collect())
    }
}

pub(crate) type Desk = crate::desk::Desk<Client, Jmri>;

impl Desk {
    pub(crate) fn new(settings: Settings) -> Self {
        let station = Jmri {
            systems: vec![("LocoNet", Some("L"), true), ("Internal", Some("I"), false)],
            power: Some(false),
            sensors: BTreeMap::from([
                ("ISCLOCKRUNNING", true),
                ("LS1", false),
                ("LS4", true),
                ("LS99", true),
            ]),
            throttles: BTreeMap::new(),
            turnouts: BTreeMap::new(),
            room: 10,
            answers: true,
        };
        Self::with(Client::new(ms(0), settings), station)
    }

    fn opened() -> Self {
        let mut desk = Self::new(Settings { last_sensor: 80, ..Settings::default() });
        desk.run_until(ms(1_000));
        assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers), "{:?}", desk.written);
        desk.written.clear();
        desk.notices.clear();
        desk
    }

    fn hear(&mut self, reply: &Reply) {
        self.client.handle_bytes(self.now, reply.text().as_bytes());
    }

    /// What was written but for signs of life.
    fn requests(&self) -> Vec<Request> {
        let requests = self.written.iter().map(|(_, request)| request.clone());
        requests.filter(|request| *request != Request::Ping).collect()
    }

    fn drives(&self) -> Vec<(u16, Throttle, bool)> {
        let drive = |request: &Request| match request {
            Request::Throttle(message) => Some((message.address?, message.throttle?, message.forward?)),
            _ => None,
        };
        self.requests().iter().filter_map(drive).collect()
    }
}

#[test]
fn the_systems_the_power_and_the_sensors_of_the_layout_are_asked_for() {
    let mut desk = Desk::new(Settings { last_sensor: 80, ..Settings::default() });
    desk.hear(&Reply::Hello { version: "5.14".to_owned(), railroad: "Attic".to_owned() });
    desk.run_until(ms(1_000));
    let sensor = |name: &str| Request::Sensor { name: name.to_owned() };
    let power = Request::Power { system: Some("LocoNet".to_owned()), on: true };
    // Not for the internal sensor, and not for the one beyond the layout.
    assert_eq!(desk.requests(), [Request::Powers, power, Request::Sensors, sensor("LS1"), sensor("LS4")]);
    let expected = [
        LinkNotice::Identified("JMRI 5.14, Attic".to_owned()),
        LinkNotice::HeldClosed(SensorId(3)),
        LinkNotice::Answers,
    ];
    assert_eq!(desk.notices, expected);
    assert!(desk.events.is_empty() && desk.station.power == Some(true));
}

#[test]
fn another_system_than_the_default_can_be_meant_and_a_prefix_that_is_not_stated() {
    let of_prefix = |prefix: &str| Settings { prefix: Some(prefix.to_owned()), ..Settings::default() };
    let mut desk = Desk::new(of_prefix("I"));
    desk.run_until(ms(1_000));
    assert!(desk.requests().contains(&Request::Power { system: Some("Internal".to_owned()), on: true }));
    let mut desk = Desk::new(of_prefix("L"));
    desk.station.systems = vec![("LocoNet", None, true)];
    desk.run_until(ms(1_000));
    assert!(desk.requests().contains(&Request::Sensor { name: "LS1".to_owned() }), "{:?}", desk.requests());
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
}

#[test]
fn trains_run_where_jmri_does_not_know_the_power() {
    let mut desk = Desk::new(Settings::default());
    desk.station.power = None;
    desk.run_until(ms(1_000));
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
    desk.client.close(desk.now);
    desk.run_for(5_000);
    assert!(!desk.client.closing().power_off, "JMRI has not confirmed that");
}

#[test]
fn a_throttle_is_asked_for_before_a_train_is_driven() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(100);
    let Some(Request::Throttle(first)) = desk.requests().first().cloned() else { panic!("a throttle") };
    assert_eq!(
        (first.name.as_str(), first.address, first.throttle, first.asks),
        ("24", Some(24), None, true)
    );
    // Eight fourteenths of 126 steps.
    assert_eq!(desk.drives(), [(24, Throttle::Speed(72), true)]);
    let step = SpeedStep::new(8).unwrap();
    assert!(matches!(desk.events[..], [event] if event.kind == EventKind::Speed { train: T24, step }));
    desk.client.set_decoder(T58, DecoderSteps::All).unwrap();
    desk.command(speed(T58, 63));
    desk.command(Command::Reverse { train: T24 });
    desk.run_for(200);
    assert!(desk.drives().contains(&(58, Throttle::Speed(63), true)), "{:?}", desk.drives());
    assert_eq!(desk.station.throttles["24"], (Throttle::Speed(0), false, 0));
    assert!(desk.notices.is_empty(), "{:?}", desk.notices);
}

#[test]
fn functions_are_switched_and_those_of_others_noticed() {
    let mut desk = Desk::opened();
    desk.command(function(T24, 3, true));
    desk.run_for(100);
    assert_eq!(desk.station.throttles["24"].2, 8);
    assert_eq!(desk.functions[&T24], ReportedFunctions::all(8));
    let light = ReportedFunctions { known: 1, on: 1 };
    desk.hear(&Reply::Throttle(ThrottleMessage {
        name: "24".to_owned(),
        functions: light,
        ..ThrottleMessage::default()
    }));
    desk.run_for(10);
    let functions = ReportedFunctions::all(9);
    assert_eq!(desk.notices, [LinkNotice::OtherFunctions { train: T24, functions }]);
}

#[test]
fn another_throttle_is_noticed() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(100);
    desk.station.throttles.insert("24".to_owned(), (Throttle::Speed(20), false, 0));
    let faster = ThrottleMessage {
        name: "24".to_owned(),
        throttle: Some(Throttle::Speed(20)),
        ..ThrottleMessage::default()
    };
    desk.hear(&Reply::Throttle(faster));
    desk.run_for(100);
    assert_eq!(desk.notices, [LinkNotice::OtherThrottle { train: T24, reversed: true }]);
}

#[test]
fn turnouts_are_named_by_their_system_and_a_missing_one_is_said_once() {
    let mut desk = Desk::opened();
    desk.command(Command::Turnout { turnout: TurnoutId(7), curved: true });
    desk.run_for(100);
    assert_eq!(desk.station.turnouts, BTreeMap::from([("LT7".to_owned(), true)]));
    // Another client closes it again.
    desk.hear(&Reply::Turnout { name: "LT7".to_owned(), thrown: Some(false) });
    desk.run_for(10);
    let turnout = TurnoutId(7);
    let kinds: Vec<EventKind> = desk.events.iter().map(|event| event.kind).collect();
    let expected =
        [EventKind::Turnout { turnout, curved: true }, EventKind::Turnout { turnout, curved: false }];
    assert_eq!(kinds, expected);
    let mut desk = Desk::new(Settings { prefix: Some("X".to_owned()), ..Settings::default() });
    desk.run_until(ms(1_000));
    desk.notices.clear();
    desk.command(Command::Turnout { turnout, curved: false });
    desk.run_for(5_000);
    let message = "turnout XT7 not found".to_owned();
    assert_eq!(desk.notices, [LinkNotice::Refused(message)]);
    assert_eq!(desk.written.iter().filter(|(_, one)| matches!(one, Request::Turnout { .. })).count(), 1);
}

#[test]
fn a_report_reaches_back_over_the_delays_of_the_hardware() {
    let mut desk = Desk::opened();
    desk.run_until(ms(5_000));
    for active in [true, true, false, true] {
        desk.hear(&Reply::Sensor { name: "LS1".to_owned(), active: Some(active) });
        desk.hear(&Reply::Sensor { name: "IS1".to_owned(), active: Some(active) });
    }
    desk.run_for(10);
    let reports = desk.reports();
    assert_eq!(reports.len(), 2, "{reports:?}");
    assert_eq!(reports[0], (4_997, 0, 77), "3 ms at least; up to 80 ms in all");
}

#[test]
fn hardware_without_a_throttle_for_a_train_is_named_once() {
    let mut desk = Desk::opened();
    desk.station.room = 1;
    desk.command(speed(T24, 8));
    desk.run_for(100);
    desk.command(speed(T58, 8));
    desk.run_for(3_000);
    assert_eq!(desk.notices, [LinkNotice::Refused("no throttle".to_owned())]);
    // As soon as there is one it drives.
    desk.station.room = 2;
    desk.run_for(1_000);
    assert_eq!(desk.station.throttles["58"].0, Throttle::Speed(72));
}

#[test]
fn after_a_lost_connection_trains_are_at_rest_and_face_as_they_were_commanded() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.command(Command::Reverse { train: T24 });
    desk.command(speed(T24, 8));
    desk.run_for(300);
    assert_eq!(desk.station.throttles["24"], (Throttle::Speed(72), false, 0));
    // JMRI was started again: it takes every locomotive to face forward.
    desk.station.throttles.clear();
    desk.written.clear();
    desk.client.handle_reopened(desk.now);
    desk.run_for(500);
    // It passes on what changes, and so not a speed of 0, while its hardware drives on.
    assert_eq!(desk.drives(), [(24, Throttle::EmergencyStop, false)]);
    desk.run_for(500);
    assert_eq!(desk.station.throttles["24"], (Throttle::EmergencyStop, false, 0));
    desk.command(speed(T24, 5));
    desk.run_for(100);
    assert_eq!(desk.station.throttles["24"], (Throttle::Speed(45), false, 0));
    assert_eq!(desk.notices, [LinkNotice::Answers]);
    // A throttle that has obeyed is stopped as usual.
    desk.command(speed(T24, 0));
    desk.run_for(100);
    assert_eq!(desk.station.throttles["24"], (Throttle::Speed(0), false, 0));
}

#[test]
fn silence_is_noticed_and_all_states_are_read_again() {
    let mut desk = Desk::opened();
    desk.command(speed(T24, 8));
    desk.run_for(200);
    desk.station.answers = false;
    desk.run_for(2_500);
    assert!(matches!(desk.notices[..], [LinkNotice::Silent { bytes: 0, .. }]), "{:?}", desk.notices);
    desk.station.answers = true;
    desk.written.clear();
    desk.run_for(1_500);
    assert_eq!(desk.notices.last(), Some(&LinkNotice::Answers));
    assert!(desk.requests().contains(&Request::Powers), "{:?}", desk.requests());
}

#[test]
fn lost_power_is_noticed_unless_it_was_asked_for() {
    let mut desk = Desk::opened();
    let off = |system: &str| Reply::Power {
        system: system.to_owned(),
        prefix: None,
        is_default: true,
        on: Some(false),
    };
    desk.hear(&off("Internal"));
    desk.run_for(10);
    assert!(desk.notices.is_empty(), "the power of another system");
    desk.hear(&off("LocoNet"));
    desk.run_for(10);
    assert_eq!(desk.notices, [LinkNotice::PowerLost]);
}

#[test]
fn the_end_stops_every_train_then_the_power() {
    let mut desk = Desk::opened();
    for train in [T24, T58] {
        desk.command(speed(train, 8));
    }
    desk.run_for(200);
    desk.written.clear();
    desk.client.close(desk.now);
    desk.run_for(1_000);
    assert!(desk.station.throttles.values().all(|(throttle, ..)| *throttle == Throttle::Speed(0)));
    assert_eq!(desk.station.power, Some(false));
    let closing = desk.client.closing();
    assert!(closing.is_complete() && closing.commanded_to_stop == [T24, T58], "{closing}");
}

#[test]
fn the_end_over_a_new_connection_takes_the_power_at_once() {
    // Throttles have to be asked for first, and a guardian hears no answers. JMRI may have said nothing over the connection before, either.
    for connections in 1..=2 {
        let mut desk = Desk::opened();
        desk.command(speed(T24, 8));
        desk.run_for(200);
        desk.station.answers = false;
        for _ in 0..connections {
            desk.run_for(300);
            desk.client.handle_reopened(desk.now);
        }
        desk.written.clear();
        let ended = desk.now;
        desk.client.close(desk.now);
        desk.run_for(100);
        let off = Request::Power { system: Some("LocoNet".to_owned()), on: false };
        let at = desk.written.iter().find(|(_, request)| *request == off).map(|(at, _)| *at);
        let at = ms(at.expect("no power"));
        assert!(at - ended < TimeSpan::from_ms(20), "{connections}: {:?}", desk.written);
    }
}

#[test]
fn what_jmri_has_not_is_refused_at_once() {
    let mut desk = Desk::opened();
    for train in [TrainId(0), TrainId(10_240)] {
        let refused = desk.client.handle_command(desk.now, speed(train, 4));
        assert_eq!(refused, Err(CommandError::Train { train, addresses: (1, 10_239) }));
    }
    let beyond = desk.client.handle_command(desk.now, speed(T24, 15));
    assert!(matches!(beyond, Err(CommandError::Step { highest: 14, .. })), "{beyond:?}");
}
