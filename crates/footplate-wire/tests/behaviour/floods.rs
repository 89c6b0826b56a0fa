//! A flood of messages that are well formed and mean nothing does not keep a session from its work, and leaves no more behind than one
//! entry for each address.

use footplate_core::{Command, SpeedStep, TimeSpan, Timestamp};
use footplate_wire::{LinkNotice, Session, Transmit, dcc_ex, jmri, loconet, marklin_can, z21};

use crate::desk::{T24, ms};

/// Messages in a flood, as many as a station on a fast network can send in a second.
const MESSAGES: u32 = 100_000;

/// Any number after another (Marsaglia's xorshift).
fn next(state: &mut u32) -> u32 {
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    *state
}

/// Lets a flood come down on a session within a second; returns how many notices it made of it, and what it wrote when it was then
/// commanded to stop a train and to end.
fn flooded(mut session: impl Session, message: impl Fn(&mut u32) -> Vec<u8>) -> (usize, Vec<u8>) {
    let (mut state, mut notices, mut written) = (0x9E37_79B9, 0, Vec::new());
    let mut now = ms(0);
    for _ in 0..MESSAGES {
        now += TimeSpan::from_us(10);
        session.handle_bytes(now, &message(&mut state));
        while let Some(output) = session.poll_output() {
            notices += usize::from(matches!(output, Transmit::Notice(notice) if !is_of_one(&notice)));
        }
    }
    let stop = Command::Speed { train: T24, step: SpeedStep::STAND };
    session.handle_command(now, stop).expect("a command");
    session.close(now);
    let end: Timestamp = now + TimeSpan::from_ms(3_000);
    while let Some(at) = session.next_timeout().filter(|at| *at <= end) {
        session.handle_timeout(at);
        while let Some(output) = session.poll_output() {
            if let Transmit::Message(bytes) = output {
                written.extend(bytes);
            }
        }
    }
    (notices, written)
}

/// Whether a notice is of one sensor: each may have one.
const fn is_of_one(notice: &LinkNotice) -> bool {
    matches!(notice, LinkNotice::HeldClosed(_))
}

fn holds(written: &[u8], part: &[u8]) -> bool {
    written.windows(part.len()).any(|window| window == part)
}

#[test]
fn a_board_that_talks_without_end_is_stopped() {
    let (notices, written) = flooded(dcc_ex::Client::new(ms(0), dcc_ex::Settings::default()), |state| {
        let [kind, first, second] = [next(state), next(state), next(state)];
        match kind % 4 {
            0 => format!("<Q {}>", first % 32_768),
            1 => format!("<H {} {}>", first % 32_768, second % 2),
            2 => format!("<l {} 0 {} 0>", first % 10_240, second % 256),
            _ => format!("<p{} MAIN>", second % 2),
        }
        .into_bytes()
    });
    assert!(notices < 100_000, "{notices}");
    assert!(holds(&written, b"<0>"), "{}", String::from_utf8_lossy(&written));
}

#[test]
fn a_z21_that_talks_without_end_is_stopped() {
    let (notices, written) = flooded(z21::Client::new(ms(0), z21::Settings::default()), |state| {
        let [kind, first, second] = [next(state), next(state), next(state)];
        let mut datagram = Vec::new();
        match kind % 3 {
            0 => z21::Reply::Feedback { group: 0, inputs: [first as u8; 10] },
            1 => z21::Reply::Turnout {
                address: first as u16,
                position: z21::TurnoutPosition::Output { second: second % 2 == 0 },
            },
            _ => z21::Reply::Power { on: second % 2 == 0 },
        }
        .write(&mut datagram);
        datagram
    });
    assert!(notices < 100_000, "{notices}");
    assert!(holds(&written, &[0x21, 0x80, 0xa1]), "{written:02x?}");
}

#[test]
fn a_can_bus_that_talks_without_end_is_stopped() {
    let settings = marklin_can::Settings { modules: 2, ..marklin_can::Settings::default() };
    let (notices, written) = flooded(marklin_can::Client::new(ms(0), settings), |state| {
        let [kind, first, second] = [next(state), next(state), next(state)];
        let uid = marklin_can::Uid(first);
        let message = match kind % 3 {
            0 => marklin_can::Message::Participant { uid, version: (1, 0), kind: second as u16 },
            1 => marklin_can::Message::Accessory { uid, position: second as u8 & 1, current: 1, time: None },
            _ => marklin_can::Message::ModuleState { uid, module: 1, inputs: second as u16 },
        };
        message.frame(true, 0x4711).encode().to_vec()
    });
    // Each participant is named, up to 255 of them.
    assert!(notices <= 300, "{notices}");
    // Speed 0 of Motorola locomotive 24.
    assert!(holds(&written, &[0x00, 0x00, 0x00, 0x18, 0x00, 0x00]), "{written:02x?}");
}

#[test]
fn a_bus_that_talks_without_end_is_stopped() {
    let (notices, written) = flooded(loconet::Client::new(ms(0), loconet::Settings::default()), |state| {
        let [kind, first, second] = [next(state), next(state), next(state)];
        let message = match kind % 3 {
            0 => loconet::Message::Input { number: first as u16 % 4_096 + 1, is_occupied: second % 2 == 0 },
            1 => loconet::Message::Switch {
                address: first as u16 % 2_048 + 1,
                closed: second % 2 == 0,
                on: true,
            },
            _ => loconet::Message::Speed { slot: first as u8 & 0x7F, speed: second as u8 & 0x7F },
        };
        loconet::Line::Receive(message).text().into_bytes()
    });
    assert!(notices < 10, "{notices}");
    assert!(
        holds(&written, b"SEND 85 7A") && holds(&written, b"SEND 82 7D"),
        "{}",
        String::from_utf8_lossy(&written)
    );
}

#[test]
fn jmri_that_talks_without_end_is_stopped() {
    let (notices, written) = flooded(jmri::Client::new(ms(0), jmri::Settings::default()), |state| {
        let [kind, first, second] = [next(state), next(state), next(state)];
        let name = |letter: char| format!("L{letter}{}", first % 65_536);
        match kind % 4 {
            0 => jmri::Reply::Sensor { name: name('S'), active: Some(second % 2 == 0) },
            1 => jmri::Reply::Turnout { name: name('T'), thrown: Some(second % 2 == 0) },
            2 => jmri::Reply::Error { code: 404, message: "no such thing".to_owned() },
            _ => jmri::Reply::Throttle(jmri::ThrottleMessage {
                name: (first % 10_240).to_string(),
                forward: Some(second % 2 == 0),
                ..jmri::ThrottleMessage::default()
            }),
        }
        .text()
        .into_bytes()
    });
    assert!(notices < 10, "{notices}");
    assert!(holds(&written, br#""data":{"state":4}"#), "{}", String::from_utf8_lossy(&written));
}
