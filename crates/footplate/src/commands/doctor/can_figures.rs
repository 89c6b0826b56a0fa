//! What the frames of a Märklin CAN bus come to: who is on it, how soon commands are confirmed, and what inputs report.

use std::collections::BTreeMap;

use footplate_wire::marklin_can::{Client, Framing, ListedLocomotive, Message, Settings, kind_in_words};
use serde_json::json;

use super::answers::{Sensors, Waiting, noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// A kind of request whose answer differs from all other frames.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Ping,
    Modules,
    Power,
}

/// The figures of what passed in a session.
pub(super) fn figures_of(passed: &[Passed], session: &Client) -> StationFigures {
    let Settings { transport, scan, .. } = *session.settings();
    let (mut said, mut heard) = (Framing::new(transport), Framing::new(transport));
    let mut waiting: Waiting<Kind> = Waiting::default();
    // Devices that identified themselves: number, version and kind.
    let mut participants: BTreeMap<u32, ((u8, u8), &str)> = BTreeMap::new();
    // Reports that say how long the state before lasted.
    let (mut inputs, mut timed) = (Sensors::default(), 0_usize);
    for one in passed {
        let message = match *one {
            Passed::Written(at, byte) => {
                let frame = said.push(byte).filter(|frame| !frame.is_response);
                if let Some(kind) = frame.and_then(|frame| kind_of(Message::of(&frame))) {
                    waiting.asked(kind, at);
                }
                continue;
            }
            Passed::Heard(at, byte) => {
                let Some(frame) = heard.push(byte).filter(|frame| frame.is_response) else { continue };
                let message = Message::of(&frame);
                if let Some(kind) = kind_of(message) {
                    waiting.answered(&kind, at);
                }
                message
            }
        };
        match message {
            Message::Participant { uid, version, kind } => {
                participants.insert(uid.0, (version, kind_in_words(kind)));
            }
            Message::ModuleState { module, inputs: states, .. } => {
                for bit in 0..u16::BITS as u16 {
                    let input = (u16::from(module.max(1)) - 1) * u16::BITS as u16 + bit + 1;
                    inputs.is(input, states & 1 << bit != 0);
                }
            }
            Message::Input { input, change: Some(change), .. } => {
                inputs.is(input, change.is_occupied);
                inputs.reported(change.is_occupied && !change.was_occupied);
                timed += usize::from(change.is_occupied && change.lasted.is_some_and(|ticks| ticks > 0));
            }
            _ => {}
        }
    }
    let unread = heard.take_unread();
    let devices = participants.iter().map(|(uid, ((major, minor), kind))| {
        json!({ "number": format!("{uid:08X}"), "version": format!("{major}.{minor}"), "kind": kind })
    });
    let listed = session.listed_locomotives();
    let locomotives = listed
        .iter()
        .map(|listed| json!({ "number": listed.uid.0, "address": listed.address, "name": listed.name }));
    let mut json = json!({
        "participants": devices.collect::<Vec<_>>(),
        "locomotives": locomotives.collect::<Vec<_>>(),
        "reports_with_time": timed,
        "unread_bytes": unread,
    });
    inputs.add_to(&mut json);
    let on_the_bus = participants.iter().map(|(uid, ((major, minor), kind))| {
        format!("on the bus    {kind}, number {uid:08X}, version {major}.{minor}")
    });
    let locomotives = listed.iter().map(|ListedLocomotive { uid, address, name }| {
        format!("locomotive    {address}: {name}, number {:#06x}", uid.0)
    });
    let ([count, occupied, reports], scan) = (inputs.counts(), scan.as_ms());
    let lines = [
        format!("sensors       {count}, {occupied} occupied, {reports} reports, {timed} with their time"),
        format!("cycle         of sensors taken to be {scan:.0} ms, as set in the station (scan)"),
    ];
    StationFigures {
        missing: participants.is_empty().then_some(
            "no participant on the CAN bus has named itself; check the station's address, or the adapter and its cable",
        ),
        answers: waiting.finish(),
        json,
        station: on_the_bus.chain(locomotives).collect(),
        reports: lines.into_iter().chain(noise(unread)).collect(),
    }
}

const fn kind_of(message: Message) -> Option<Kind> {
    match message {
        Message::Ping | Message::Participant { .. } => Some(Kind::Ping),
        Message::ModulePoll { .. } | Message::ModuleState { .. } => Some(Kind::Modules),
        Message::Go(_) | Message::Stop(_) => Some(Kind::Power),
        _ => None,
    }
}
