//! What the frames of a Märklin CAN bus come to: who is on it, how soon commands are confirmed, and what inputs report.

use std::collections::BTreeMap;
use std::io::Write;

use footplate_core::TimeSpan;
use footplate_wire::marklin_can::{Client, Framing, ListedLocomotive, Message, kind_in_words};

use super::answers::{Answers, Sensors, Waiting, write_noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// The figures of a bus.
pub(super) struct CanFigures {
    /// The cycle of inputs that reports are dated with.
    scan: TimeSpan,
    /// The locomotives of the station's list.
    listed: Vec<ListedLocomotive>,
    /// Devices that identified themselves: number, version and kind.
    participants: BTreeMap<u32, ((u8, u8), u16)>,
    answers: Answers,
    inputs: Sensors,
    /// Reports that say how long the state before lasted.
    timed: usize,
    unread: usize,
}

/// A kind of request whose answer differs from all other frames.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Ping,
    Modules,
    Power,
}

impl CanFigures {
    /// The figures of what passed in a session.
    pub(super) fn of(passed: &[Passed], session: &Client) -> Self {
        let settings = session.settings();
        let mut figures = Self {
            scan: settings.scan,
            listed: session.listed_locomotives().to_vec(),
            participants: BTreeMap::new(),
            answers: Answers::default(),
            inputs: Sensors::default(),
            timed: 0,
            unread: 0,
        };
        let (mut said, mut heard) = (Framing::new(settings.transport), Framing::new(settings.transport));
        let mut waiting: Waiting<Kind> = Waiting::default();
        for one in passed {
            match *one {
                Passed::Written(at, byte) => {
                    let frame = said.push(byte).filter(|frame| !frame.is_response);
                    if let Some(kind) = frame.and_then(|frame| kind_of(Message::of(&frame))) {
                        waiting.asked(kind, at);
                    }
                }
                Passed::Heard(at, byte) => {
                    let Some(frame) = heard.push(byte).filter(|frame| frame.is_response) else { continue };
                    let message = Message::of(&frame);
                    if let Some(kind) = kind_of(message) {
                        waiting.answered(&kind, at);
                    }
                    figures.take(message);
                }
            }
        }
        figures.unread = heard.take_unread();
        figures.answers = waiting.finish();
        figures
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Participant { uid, version, kind } => {
                self.participants.insert(uid.0, (version, kind));
            }
            Message::ModuleState { module, inputs, .. } => {
                for bit in 0..u16::BITS as u16 {
                    let input = (u16::from(module.max(1)) - 1) * u16::BITS as u16 + bit + 1;
                    self.inputs.is(input, inputs & 1 << bit != 0);
                }
            }
            Message::Input { input, change: Some(change), .. } => {
                self.inputs.is(input, change.is_occupied);
                self.inputs.reported(change.is_occupied && !change.was_occupied);
                self.timed += usize::from(change.is_occupied && change.lasted.is_some_and(|ticks| ticks > 0));
            }
            _ => {}
        }
    }
}

impl StationFigures for CanFigures {
    fn check(&self) -> Result<(), &'static str> {
        (!self.participants.is_empty()).then_some(()).ok_or(
            "no participant on the CAN bus has named itself; check the station's address, or the adapter and its cable",
        )
    }

    fn answers(&self) -> &Answers {
        &self.answers
    }

    fn json(&self) -> serde_json::Value {
        let participants = self.participants.iter().map(|(uid, ((major, minor), kind))| {
            serde_json::json!({
                "number": format!("{uid:08X}"),
                "version": format!("{major}.{minor}"),
                "kind": kind_in_words(*kind),
            })
        });
        let locomotives = self.listed.iter().map(|listed| {
            serde_json::json!({ "number": listed.uid.0, "address": listed.address, "name": listed.name })
        });
        let [inputs, occupied, reports] = self.inputs.counts();
        serde_json::json!({
            "participants": participants.collect::<Vec<_>>(),
            "locomotives": locomotives.collect::<Vec<_>>(),
            "sensors": inputs,
            "occupied": occupied,
            "reports": reports,
            "reports_with_time": self.timed,
            "unread_bytes": self.unread,
        })
    }

    fn write_station(&self, output: &mut dyn Write) -> std::io::Result<()> {
        for (uid, ((major, minor), kind)) in &self.participants {
            writeln!(
                output,
                "on the bus    {}, number {uid:08X}, version {major}.{minor}",
                kind_in_words(*kind)
            )?;
        }
        for ListedLocomotive { uid, address, name } in &self.listed {
            writeln!(output, "locomotive    {address}: {name}, number {:#06x}", uid.0)?;
        }
        Ok(())
    }

    fn write_reports(&self, output: &mut dyn Write) -> std::io::Result<()> {
        let ([count, occupied, reports], timed) = (self.inputs.counts(), self.timed);
        writeln!(
            output,
            "sensors       {count}, {occupied} occupied, {reports} reports, {timed} with their time"
        )?;
        let scan = self.scan.as_ms();
        writeln!(output, "cycle         of sensors taken to be {scan:.0} ms, as set in the station (scan)")?;
        write_noise(self.unread, output)
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
