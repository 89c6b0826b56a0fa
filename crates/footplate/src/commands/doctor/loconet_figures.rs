//! What the lines of a LocoNet server come to: what it is, how soon the command station answers, and what detectors report.

use std::collections::BTreeMap;

use footplate_wire::loconet::{Line, Lines, Message, SENSOR_DELAY_SHORTEST, SentReport, Settings, SlotUse};

use super::answers::{Sensors, Waiting, noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// The figures of what passed.
pub(super) fn figures_of(passed: &[Passed], settings: &Settings) -> StationFigures {
    let (mut said, mut heard) = (Lines::default(), Lines::default());
    let mut waiting: Waiting<u8> = Waiting::default();
    let (mut version, mut sensors, mut unread) = (None, Sensors::default(), 0);
    // Whether a command station has answered, and the messages of this program that the server could not put on the bus.
    let (mut has_station, mut refused) = (false, 0);
    // Locomotives in slots, and whether a throttle uses each.
    let mut slots: BTreeMap<u8, (u16, bool)> = BTreeMap::new();
    for one in passed {
        match *one {
            Passed::Written(at, byte) => {
                if let Some(Ok(Line::Send(Message::ReadSlot { slot }))) = said.push(byte).map(Line::read) {
                    waiting.asked(slot, at);
                }
            }
            Passed::Heard(at, byte) => match heard.push(byte).map(|text| (text.len(), Line::read(text))) {
                Some((_, Ok(Line::Receive(Message::Slot(data))))) => {
                    waiting.answered(&data.slot, at);
                    has_station = true;
                    if data.slot > 0 && data.slot_use() != SlotUse::Free {
                        slots.insert(data.slot, (data.address, data.slot_use() == SlotUse::InUse));
                    }
                }
                Some((_, Ok(Line::Receive(Message::Input { number, is_occupied })))) => {
                    sensors.heard(number, is_occupied);
                }
                Some((_, Ok(Line::Version(said)))) => version = Some(said),
                Some((_, Ok(Line::Sent(SentReport::Error)))) => refused += 1,
                Some((length, Err(_))) => unread += length,
                _ => {}
            },
        }
    }
    unread += heard.take_unread();
    let listed = slots.iter().map(|(slot, (address, is_used))| {
        serde_json::json!({ "slot": slot, "address": address, "in_use": is_used })
    });
    let mut json = serde_json::json!({
        "server": version,
        "slots": listed.collect::<Vec<_>>(),
        "refused_messages": refused,
        "unread_bytes": unread,
    });
    sensors.add_to(&mut json);
    let server = format!("server        {}", version.as_deref().unwrap_or("does not say what it is"));
    let locomotives = slots.iter().map(|(slot, (address, is_used))| {
        let used = if *is_used { "used by a throttle" } else { "not in use" };
        format!("locomotive    {address} in slot {slot}, {used}")
    });
    let [count, occupied, reports] = sensors.counts();
    let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), settings.sensor_delay.as_ms());
    let lines = [
        format!("sensors       {count}, {occupied} occupied, {reports} reports"),
        format!("delay         of reports taken to be {from:.1} to {to:.0} ms (sensor-delay)"),
    ];
    let refusals = (refused > 0).then(|| format!("bus           refused {refused} messages"));
    StationFigures {
        missing: (!has_station).then_some(
            "no command station has answered on LocoNet; check that it has power and is connected to the server's interface",
        ),
        answers: waiting.finish(),
        json,
        station: [server].into_iter().chain(locomotives).collect(),
        reports: lines.into_iter().chain(refusals).chain(noise(unread)).collect(),
    }
}
