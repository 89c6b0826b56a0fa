//! What the frames of a Märklin CAN bus come to: who is on it, how soon commands are confirmed, and what contacts report.

use std::collections::BTreeMap;
use std::io::Write;

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::marklin_can::{Framing, ListedLocomotive, Message, Settings, kind_in_words};

use super::figures::{line, quantiles};
use crate::commands::plot::{Ink, Layer, Panel, Picture, Shape, shares};
use crate::link::Passed;

/// The figures of a bus.
pub(super) struct CanFigures {
    /// Devices that named themselves: their number, version and kind.
    participants: BTreeMap<u32, ((u8, u8), u16)>,
    /// From a request to its answer, in ms, sorted.
    answers: Vec<f64>,
    asked: usize,
    lost: usize,
    /// Contacts that were ever spoken of, and whether they were occupied last.
    contacts: BTreeMap<u16, bool>,
    reports: usize,
    /// Reports that say how long the state before lasted.
    timed: usize,
    unread: usize,
}

/// A kind of request whose answer can be told from other frames.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Ping,
    Modules,
    Power,
}

impl CanFigures {
    /// The figures of what passed; `own` is this program's number.
    pub(super) fn of(passed: &[Passed], settings: &Settings) -> Self {
        let mut figures = Self {
            participants: BTreeMap::new(),
            answers: Vec::new(),
            asked: 0,
            lost: 0,
            contacts: BTreeMap::new(),
            reports: 0,
            timed: 0,
            unread: 0,
        };
        let (mut said, mut heard) = (Framing::new(settings.transport), Framing::new(settings.transport));
        let mut waiting: Vec<(Kind, Timestamp)> = Vec::new();
        for one in passed {
            match *one {
                Passed::Written(at, byte) => {
                    let frame = said.push(byte).filter(|frame| !frame.is_response);
                    let Some(kind) = frame.and_then(|frame| kind_of(Message::of(&frame))) else { continue };
                    figures.asked += 1;
                    // The same is asked again before it was answered only when no answer came.
                    let before = waiting.len();
                    waiting.retain(|(other, _)| *other != kind);
                    figures.lost += before - waiting.len();
                    waiting.push((kind, at));
                }
                Passed::Heard(at, byte) => {
                    let Some(frame) = heard.push(byte).filter(|frame| frame.is_response) else { continue };
                    let message = Message::of(&frame);
                    if let Some(kind) = kind_of(message)
                        && let Some(place) = waiting.iter().position(|(other, _)| *other == kind)
                    {
                        let (_, since) = waiting.remove(place);
                        figures.answers.push((at - since).as_ms());
                    }
                    figures.take(message);
                }
            }
        }
        figures.unread = heard.take_unread();
        figures.answers.sort_by(f64::total_cmp);
        figures
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Participant { uid, version, kind } => {
                self.participants.insert(uid.0, (version, kind));
            }
            Message::ModuleState { module, contacts, .. } => {
                for bit in 0..u16::BITS as u16 {
                    let contact = (u16::from(module.max(1)) - 1) * u16::BITS as u16 + bit + 1;
                    self.contacts.insert(contact, contacts & 1 << bit != 0);
                }
            }
            Message::Contact { contact, change: Some(change), .. } => {
                self.contacts.insert(contact, change.is_occupied);
                self.reports += usize::from(change.is_occupied && !change.was_occupied);
                self.timed += usize::from(change.is_occupied && change.lasted.is_some_and(|ticks| ticks > 0));
            }
            _ => {}
        }
    }

    /// Whether anybody has named themselves.
    pub(super) fn is_known(&self) -> bool {
        !self.participants.is_empty()
    }

    /// The share of requests that were not answered.
    pub(super) fn lost_share(&self) -> f64 {
        self.lost as f64 / self.asked.max(1) as f64
    }

    fn occupied(&self) -> usize {
        self.contacts.values().filter(|occupied| **occupied).count()
    }

    pub(super) fn json(&self, listed: &[ListedLocomotive]) -> serde_json::Value {
        let participants = self.participants.iter().map(|(uid, ((major, minor), kind))| {
            serde_json::json!({
                "number": format!("{uid:08X}"),
                "version": format!("{major}.{minor}"),
                "kind": kind_in_words(*kind),
            })
        });
        let locomotives = listed.iter().map(|listed| {
            serde_json::json!({ "number": listed.uid.0, "address": listed.address, "name": listed.name })
        });
        serde_json::json!({
            "participants": participants.collect::<Vec<_>>(),
            "locomotives": locomotives.collect::<Vec<_>>(),
            "requests": self.asked,
            "lost_answers": self.lost,
            "answer_ms": quantiles(&self.answers),
            "contacts": self.contacts.len(),
            "occupied": self.occupied(),
            "reports": self.reports,
            "reports_with_time": self.timed,
            "unread_bytes": self.unread,
        })
    }

    /// Says it to a person; `scan` is the cycle of contacts that reports are dated with.
    pub(super) fn write(
        &self,
        listed: &[ListedLocomotive],
        scan: TimeSpan,
        output: &mut dyn Write,
    ) -> std::io::Result<()> {
        for (uid, ((major, minor), kind)) in &self.participants {
            writeln!(
                output,
                "on the bus    {}, number {uid:08X}, version {major}.{minor}",
                kind_in_words(*kind)
            )?;
        }
        for ListedLocomotive { uid, address, name } in listed {
            writeln!(output, "locomotive    {address}: {name}, number {:#06x}", uid.0)?;
        }
        writeln!(output, "requests      {}, {} without an answer", self.asked, self.lost)?;
        line(output, "answers", &self.answers)?;
        let (count, occupied) = (self.contacts.len(), self.occupied());
        let (reports, timed) = (self.reports, self.timed);
        writeln!(
            output,
            "contacts      {count}, {occupied} occupied, {reports} reports, {timed} with their time"
        )?;
        writeln!(
            output,
            "cycle         of contacts taken to be {:.0} ms, as set in the station (scan)",
            scan.as_ms()
        )?;
        if self.unread > 0 {
            writeln!(output, "noise         {} bytes could not be read", self.unread)?;
        }
        Ok(())
    }

    /// How the times to answers are spread.
    pub(super) fn picture(&self) -> Picture {
        let curve = Shape::Line(shares(self.answers.iter().copied()));
        let layers = (!self.answers.is_empty()).then(|| Layer::new("answer", Ink::First, curve));
        let panel = Panel {
            x: "at most (ms)".to_owned(),
            y: "share (%)".to_owned(),
            from_zero: true,
            layers: layers.into_iter().collect(),
            ..Panel::default()
        };
        Picture {
            title: "How soon the station answers".to_owned(),
            subtitle: format!("{} requests, {} without an answer", self.asked, self.lost),
            panels: vec![panel],
        }
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
