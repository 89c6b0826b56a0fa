//! Bytes that are lost, added or never come: noticed, said, and the line brought back into step; coils are released and
//! trains commanded to stop whatever happens.

use footplate_core::{Command, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::marklin_serial::{BYTE_TIME, Interface, Message, Pace, Settings};
use footplate_wire::{CommandError, Confirmation, LinkNotice, Session, Transmit};
use proptest::prelude::{Just, Strategy, any, prop_assert, prop_oneof, proptest};

use crate::marklin_serial_bench::{Bench, ms, reverse, speed, turnout};

fn coil_times(bench: &Bench) -> Vec<TimeSpan> {
    let held = |(_, from, until): &(TurnoutId, Timestamp, Option<Timestamp>)| {
        until.expect("a coil that was never released") - *from
    };
    bench.station.coils.iter().map(held).collect()
}

/// What turnouts need and coils bear.
fn are_safe(held: &[TimeSpan]) -> bool {
    held.iter().all(|held| (TimeSpan::from_ms(100)..=TimeSpan::from_ms(500)).contains(held))
}

#[test]
fn every_solenoid_is_released_in_time_however_many_turnouts_follow() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(300));
    for number in 1..=18 {
        bench.say(turnout(number));
    }
    bench.say(speed(24, 8));
    bench.run_for(8_000);
    assert_eq!(bench.station.coils.len(), 18);
    assert!(are_safe(&coil_times(&bench)), "{:?}", coil_times(&bench));
    assert_eq!(bench.station.steps[&TrainId(24)], 8);
}

#[test]
fn a_solenoid_is_released_through_lost_replies_and_at_the_end() {
    for lost in 0..40 {
        let mut bench = Bench::with_cts();
        bench.run_until(ms(300));
        bench.say(turnout(11));
        bench.lose_to_host(&[lost, lost + 1]);
        bench.run_for(40);
        bench.session.close(bench.now);
        bench.run_for(1_000);
        assert!(are_safe(&coil_times(&bench)), "{:?}", coil_times(&bench));
        assert!(!bench.station.power);
    }
}

/// Nothing answers a release, so that one that is lost is not noticed: every reply may come whole. On a line that has lost a
/// byte it is repeated.
#[test]
fn a_solenoid_is_released_although_one_byte_or_two_to_the_station_are_lost() {
    for lost in 0..40 {
        for apart in 0..4 {
            let mut bench = Bench::with_cts();
            bench.run_until(ms(300));
            bench.lose_to_host(&[0]);
            bench.run_for(500);
            bench.say(turnout(11));
            bench.lose_to_station(&[lost, lost + apart]);
            bench.run_for(2_000);
            let held = coil_times(&bench);
            assert!(held.iter().all(|held| *held <= TimeSpan::from_ms(500)), "{lost}, {apart}: {held:?}");
        }
    }
}

#[test]
fn a_lost_byte_of_a_command_is_noticed_and_the_command_said_again() {
    for place in 0..2 {
        let mut bench = Bench::with_cts();
        bench.run_until(ms(303));
        // Given a line on which the next byte of a command is lost,
        let request_was_sent = 1;
        bench.say(speed(24, 9));
        bench.run_for(0);
        let in_transit = usize::from(bench.written.last().is_some_and(|(_, byte)| *byte == 25));
        bench.lose_to_station(&[place + request_was_sent - 1 - in_transit.min(place)]);
        bench.run_for(2_000);
        // then the train is told in the end.
        assert_eq!(bench.station.steps.get(&TrainId(24)), Some(&9), "byte {place}: {:?}", bench.notices);
    }
}

#[test]
fn a_turn_that_may_be_lost_is_not_said_again_but_said_to_people() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(303));
    bench.say(reverse(24));
    let before = bench.written.len();
    while bench.written[before..].iter().all(|(_, byte)| *byte != 133) {
        bench.run_for(1);
    }
    bench.lose_to_host(&[0]);
    bench.run_for(2_000);
    assert_eq!(bench.station.turned[&TrainId(24)], 1);
    assert!(bench.notices.contains(&LinkNotice::ReverseInDoubt(TrainId(24))));
}

#[test]
fn a_short_reply_is_dropped_and_the_interval_grows() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(300));
    bench.lose_to_host(&[13]);
    bench.station.input(3, true);
    bench.run_for(25);
    let closed = bench.now;
    bench.station.input(50, true);
    bench.run_for(1_000);
    assert!(bench.notices.iter().any(|n| matches!(n, LinkNotice::ReplyLost { expected: 10, found: 9 })));
    let [(read, interval)] = bench.reports(50)[..] else { panic!("{:?}", bench.events) };
    assert!(read - interval < closed && closed <= read);
    assert!(interval > TimeSpan::from_ms(100), "the lost reply tells nothing: {interval:?}");
}

#[test]
fn bytes_that_nobody_asked_for_make_no_report_and_are_said() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(300));
    // Given a byte of noise at every phase of the poll, and inputs that are all open,
    for phase in 0..60 {
        bench.station.babble(bench.now + TimeSpan::from_ms(phase), &[0x10]);
        bench.run_for(700);
    }
    // then what was shifted by it is not believed, and the line goes on.
    let noticed =
        |n: &LinkNotice| matches!(n, LinkNotice::UnexpectedBytes { .. } | LinkNotice::ReplyLost { .. });
    assert!(bench.notices.iter().filter(|n| noticed(n)).count() >= 60, "{:?}", bench.notices.len());
    assert_eq!(bench.events, []);
    bench.station.input(5, true);
    bench.run_for(200);
    assert_eq!(bench.reports(5).len(), 1);
}

#[test]
fn a_line_that_garbles_many_replies_is_not_relied_on_until_it_is_clean() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(300));
    // Given one stray byte, and then three within five seconds,
    bench.station.babble(bench.now, &[0x10]);
    bench.run_for(6_000);
    assert_eq!(bench.notices.iter().filter(|n| **n == LinkNotice::Garbled).count(), 0);
    for _ in 0..3 {
        bench.station.babble(bench.now, &[0x10]);
        bench.run_for(1_000);
    }
    let since = bench.notices.iter().position(|n| *n == LinkNotice::Garbled).expect("said");
    // then the station answers again, for control, once the line was clean for three seconds.
    assert!(!bench.notices[since..].contains(&LinkNotice::Answers), "{:?}", bench.notices);
    bench.run_for(2_500);
    assert!(bench.notices[since..].contains(&LinkNotice::Answers), "{:?}", bench.notices);
}

#[test]
fn a_station_that_was_off_receives_its_reset_mode_again() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(300));
    bench.station.cable.cut = true;
    bench.run_for(3_000);
    bench.station.cable.cut = false;
    let before = bench.station.messages.len();
    bench.run_for(1_000);
    assert_eq!(bench.notices.last(), Some(&LinkNotice::Answers));
    let messages: Vec<Message> =
        bench.station.messages[before..].iter().map(|(_, message)| *message).collect();
    let is_read = |message: &Message| message.modules_read().next().is_some();
    let answered = messages.iter().position(is_read).expect("a read");
    assert!(messages[answered..].contains(&Message::ResetMode { on: true }), "{messages:?}");
}

#[test]
fn a_station_that_says_nothing_is_said_to_be_silent_and_greeted_when_it_is_back() {
    for settings in [Settings::with_cts(5), Settings::timed(5, Pace::CAREFUL), Settings::with_cts(31)] {
        let mut bench = Bench::new(settings);
        bench.run_until(ms(1_000));
        assert_eq!(bench.notices, [LinkNotice::Answers]);
        bench.station.cable.cut = true;
        bench.run_until(ms(3_700));
        let silent = bench.notices.iter().find(|n| matches!(n, LinkNotice::Silent { .. }));
        assert!(silent.unwrap().to_string().contains("check its power"), "{:?}", bench.notices);
        bench.station.cable.cut = false;
        bench.station.heard.clear();
        bench.run_until(ms(6_000));
        assert_eq!(bench.notices.last(), Some(&LinkNotice::Answers), "{settings:?}");
    }
}

#[test]
fn a_hand_shake_that_stays_down_is_said_and_nothing_is_written() {
    let mut session = Interface::new(ms(0), Settings::with_cts(5)).unwrap();
    session.handle_cts(ms(0), false);
    while let Some(at) = session.next_timeout() {
        session.handle_timeout(at);
    }
    let Some(Transmit::Notice(notice)) = session.poll_output() else { panic!("nothing was said") };
    assert!(notice.to_string().contains("timed mode"), "{notice}");
    assert_eq!(session.poll_output(), None);
}

#[test]
fn closing_stops_every_train_that_was_ever_driven() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(300));
    for train in [24, 58, 74] {
        bench.say(speed(train, 8));
    }
    bench.run_for(500);
    bench.say(speed(24, 0));
    bench.say(turnout(3));
    bench.say(speed(79, 12));
    bench.run_for(30);
    bench.session.close(bench.now);
    bench.run_for(700);
    assert!(bench.station.steps.values().all(|step| *step == 0), "{:?}", bench.station.steps);
    assert!(!bench.station.power);
    assert!(are_safe(&coil_times(&bench)), "{:?}", coil_times(&bench));
    let Some(LinkNotice::Closed(closing)) = bench.notices.last() else { panic!("not closed") };
    assert!(closing.is_complete() && closing.confirmation == Confirmation::HandShake);
    assert_eq!(closing.commanded_to_stop.len(), 4);
    assert_eq!(bench.session.handle_command(bench.now, speed(24, 3)), Err(CommandError::Closed));
    let written = bench.written.len();
    bench.run_for(5_000);
    assert_eq!(bench.written.len(), written, "a closed session writes nothing");
}

#[test]
fn what_could_not_be_said_at_the_end_is_named() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(300));
    bench.say(speed(24, 8));
    bench.run_for(200);
    bench.session.handle_cts(bench.now, false);
    bench.session.close(bench.now);
    bench.run_for(10);
    let closing = bench.session.closing();
    assert_eq!((closing.commanded_to_stop, closing.not_commanded), (vec![], vec![TrainId(24)]));
    assert!(bench.session.closing().to_string().contains("NOT commanded to stop and possibly running: 24"));
}

/// What a program and a line can do to a session.
#[derive(Debug, Clone)]
enum Deed {
    Hear(Vec<u8>),
    Cts(bool),
    Say(Command),
    Hold(Option<i64>),
    Watch(Option<u16>),
    Wait(i64),
    Timeout,
    Close,
}

fn deeds() -> impl Strategy<Value = Deed> {
    let commands = prop_oneof![
        (0_u16..90, 0_u8..16).prop_map(|(train, step)| Command::Speed {
            train: TrainId(train),
            step: SpeedStep::new(step).unwrap()
        }),
        (0_u16..90).prop_map(|train| Command::Reverse { train: TrainId(train) }),
        (0_u16..260, any::<bool>())
            .prop_map(|(number, curved)| Command::Turnout { turnout: TurnoutId(number), curved }),
        any::<bool>().prop_map(|on| if on { Command::PowerOn } else { Command::PowerOff }),
    ];
    prop_oneof![
        3 => proptest::collection::vec(any::<u8>(), 0..70).prop_map(Deed::Hear),
        3 => any::<bool>().prop_map(Deed::Cts),
        4 => commands.prop_map(Deed::Say),
        1 => proptest::option::of(-100_i64..1_000).prop_map(Deed::Hold),
        1 => proptest::option::of(any::<u16>()).prop_map(Deed::Watch),
        8 => (0_i64..400_000).prop_map(Deed::Wait),
        6 => Just(Deed::Timeout),
        1 => Just(Deed::Close),
    ]
}

/// A session without a station, and the rules that its bytes have to keep.
struct Witness {
    session: Interface,
    now: Timestamp,
    /// When the last byte was written.
    wrote: Option<Timestamp>,
    /// Whole messages with the time of their last bit.
    messages: Vec<(Timestamp, Message)>,
    /// The first byte of a message that waits for its second.
    first: Vec<u8>,
    heard_since_request: usize,
    /// The request that is in transit or being answered: until when at most, and how many bytes answer it.
    asked: Option<(Timestamp, usize)>,
}

impl Witness {
    fn take(&mut self) {
        while let Some(output) = self.session.poll_output() {
            let Transmit::Byte(byte) = output else { continue };
            if let Some((until, expected)) = self.asked {
                let over = self.now >= until || self.heard_since_request >= expected;
                assert!(over, "byte {byte} at {:?} while a reply is awaited", self.now);
            }
            assert!(self.wrote.is_none_or(|at| self.now - at >= BYTE_TIME), "two bytes at once");
            self.wrote = Some(self.now);
            self.first.push(byte);
            self.asked = None;
            if let Some((message, _)) = Message::decode(&self.first) {
                let expected = message.modules_read().count() * 2;
                let span = BYTE_TIME + TimeSpan::from_us(4_870 * expected as i64) + TimeSpan::from_ms(20);
                self.asked = (expected > 0).then_some((self.now + span, expected));
                self.heard_since_request = 0;
                self.messages.push((self.now + BYTE_TIME, message));
                self.first.clear();
            }
        }
    }

    fn wait_until(&mut self, end: Timestamp) {
        self.take();
        while let Some(at) = self.session.next_timeout().filter(|at| *at <= end) {
            self.now = self.now.max(at);
            self.session.handle_timeout(self.now);
            let next = self.session.next_timeout();
            assert!(next.is_none_or(|next| next > self.now), "no progress at {:?}", self.now);
            self.take();
        }
        self.now = self.now.max(end);
    }

    fn suffer(&mut self, deed: Deed) {
        match deed {
            Deed::Hear(bytes) => {
                if self.asked.is_some_and(|_| self.wrote.is_some_and(|at| at + BYTE_TIME <= self.now)) {
                    self.heard_since_request += bytes.len();
                }
                self.session.handle_bytes(self.now, &bytes);
            }
            Deed::Cts(up) => self.session.handle_cts(self.now, up),
            Deed::Say(command) => {
                let _ = self.session.handle_command(self.now, command);
            }
            Deed::Hold(span) => {
                self.session.hold_line(span.map(|span| self.now + TimeSpan::from_ms(span)));
            }
            Deed::Watch(sensor) => self.session.watch(sensor.map(SensorId)),
            Deed::Wait(us) => self.wait_until(self.now + TimeSpan::from_us(us)),
            Deed::Timeout => self.session.handle_timeout(self.now),
            Deed::Close => self.session.close(self.now),
        }
        self.take();
    }
}

proptest! {
    #[test]
    fn whatever_happens_two_polls_are_never_in_flight_and_coils_are_released(
        deeds in proptest::collection::vec(deeds(), 0..120),
        pace in prop_oneof![Just(Pace::Cts), Just(Pace::FAST), Just(Pace::CAREFUL)],
        modules in 1_u8..=31,
    ) {
        let session = Interface::new(ms(0), Settings::timed(modules, pace)).unwrap();
        let mut witness = Witness {
            session,
            now: ms(0),
            wrote: None,
            messages: Vec::new(),
            first: Vec::new(),
            heard_since_request: 0,
            asked: None,
        };
        // CTS is the station's; one that stays down lets nothing pass, coils included.
        witness.session.handle_cts(ms(0), true);
        for deed in deeds {
            if matches!(deed, Deed::Cts(_)) {
                witness.suffer(Deed::Cts(false));
                witness.suffer(Deed::Wait(1_000));
                witness.suffer(Deed::Cts(true));
            } else {
                witness.suffer(deed);
            }
        }
        witness.suffer(Deed::Close);
        let end = witness.now + TimeSpan::from_ms(60_000);
        witness.wait_until(end);
        prop_assert!(witness.session.closing().is_complete());

        prop_assert!(witness.first.is_empty(), "half a command was left on the line");
        let mut powered = None;
        for (at, message) in witness.messages {
            match message {
                Message::Turnout { .. } => {
                    prop_assert!(powered.is_none(), "a turnout before the last coil was released");
                    powered = Some(at);
                }
                Message::SolenoidOff => {
                    if let Some(since) = powered.take() {
                        let held = at - since;
                        prop_assert!(held >= TimeSpan::from_ms(100), "{held:?}");
                        prop_assert!(held <= TimeSpan::from_ms(500), "{held:?}");
                    }
                }
                _ => {}
            }
        }
        prop_assert!(powered.is_none());
    }
}
