//! What the lines of a LocoNet server come to: what it is, how soon the command station answers, and what detectors report.

use std::collections::BTreeMap;
use std::io::Write;

use footplate_wire::loconet::{Line, Lines, Message, SENSOR_DELAY_SHORTEST, SentReport, Settings, SlotUse};

use super::answers::{Answers, Sensors, Waiting, write_noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// The figures of a bus.
pub(super) struct LocoNetFigures {
    settings: Settings,
    version: Option<String>,
    /// Whether a command station has answered.
    has_station: bool,
    answers: Answers,
    /// Locomotives in slots, and whether a throttle uses each.
    slots: BTreeMap<u8, (u16, SlotUse)>,
    sensors: Sensors,
    /// Messages of this program that the server could not put on the bus.
    refused: usize,
    unread: usize,
}

impl LocoNetFigures {
    pub(super) fn of(passed: &[Passed], settings: &Settings) -> Self {
        let (mut said, mut heard) = (Lines::default(), Lines::default());
        let mut waiting: Waiting<u8> = Waiting::default();
        let mut figures = Self {
            settings: *settings,
            version: None,
            has_station: false,
            answers: Answers::default(),
            slots: BTreeMap::new(),
            sensors: Sensors::default(),
            refused: 0,
            unread: 0,
        };
        for one in passed {
            match *one {
                Passed::Written(at, byte) => {
                    if let Some(Ok(Line::Send(Message::ReadSlot { slot }))) = said.push(byte).map(Line::read)
                    {
                        waiting.asked(slot, at);
                    }
                }
                Passed::Heard(at, byte) => {
                    match heard.push(byte).map(|text| (text.len(), Line::read(text))) {
                        Some((_, Ok(Line::Receive(message)))) => {
                            if let Message::Slot(data) = message {
                                waiting.answered(&data.slot, at);
                            }
                            figures.take(message);
                        }
                        Some((_, Ok(Line::Version(version)))) => figures.version = Some(version),
                        Some((_, Ok(Line::Sent(SentReport::Error)))) => figures.refused += 1,
                        Some((length, Err(_))) => figures.unread += length,
                        _ => {}
                    }
                }
            }
        }
        figures.unread += heard.take_unread();
        figures.answers = waiting.finish();
        figures
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Slot(data) => {
                self.has_station = true;
                if data.slot > 0 && data.slot_use() != SlotUse::Free {
                    self.slots.insert(data.slot, (data.address, data.slot_use()));
                }
            }
            Message::Input { number, is_occupied } => self.sensors.heard(number, is_occupied),
            _ => {}
        }
    }
}

impl StationFigures for LocoNetFigures {
    fn check(&self) -> Result<(), &'static str> {
        self.has_station.then_some(()).ok_or(
            "no command station has answered on LocoNet; check that it has power and is connected to the server's interface",
        )
    }

    fn answers(&self) -> &Answers {
        &self.answers
    }

    fn json(&self) -> serde_json::Value {
        let slots = self.slots.iter().map(|(slot, (address, slot_use))| {
            serde_json::json!({ "slot": slot, "address": address, "in_use": *slot_use == SlotUse::InUse })
        });
        let mut json = serde_json::json!({
            "server": self.version,
            "slots": slots.collect::<Vec<_>>(),
            "refused_messages": self.refused,
            "unread_bytes": self.unread,
        });
        self.sensors.add_to(&mut json);
        json
    }

    fn write_station(&self, output: &mut dyn Write) -> std::io::Result<()> {
        writeln!(output, "server        {}", self.version.as_deref().unwrap_or("does not say what it is"))?;
        for (slot, (address, slot_use)) in &self.slots {
            let used = if *slot_use == SlotUse::InUse { "used by a throttle" } else { "not in use" };
            writeln!(output, "locomotive    {address} in slot {slot}, {used}")?;
        }
        Ok(())
    }

    fn write_reports(&self, output: &mut dyn Write) -> std::io::Result<()> {
        let [count, occupied, reports] = self.sensors.counts();
        writeln!(output, "sensors       {count}, {occupied} occupied, {reports} reports")?;
        let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), self.settings.sensor_delay.as_ms());
        writeln!(output, "delay         of reports taken to be {from:.1} to {to:.0} ms (sensor-delay)")?;
        if self.refused > 0 {
            writeln!(output, "bus           refused {} messages", self.refused)?;
        }
        write_noise(self.unread, output)
    }
}
