//! What the messages of a DCC-EX board come to: what it is, how soon it answers, and what it reports.

use std::collections::BTreeMap;
use std::io::Write;
use std::mem::{Discriminant, discriminant};

use footplate_core::Timestamp;
use footplate_wire::dcc_ex::{Framing, Reply, Request, SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST};

use super::figures::{line, quantiles};
use crate::commands::plot::{Ink, Layer, Panel, Picture, Shape, shares};
use crate::link::Passed;

/// The figures of a board.
pub(super) struct BoardFigures {
    identity: Option<String>,
    /// From a request to its answer, in ms, sorted.
    answers: Vec<f64>,
    asked: usize,
    lost: usize,
    /// Sensors by their numbers on the board, and whether they were occupied last.
    sensors: BTreeMap<u16, bool>,
    reports: usize,
    unread: usize,
}

impl BoardFigures {
    pub(super) fn of(passed: &[Passed]) -> Self {
        let (mut said, mut heard) = (Framing::default(), Framing::default());
        let mut waiting: Vec<(Discriminant<Request>, Timestamp)> = Vec::new();
        let mut figures = Self {
            identity: None,
            answers: Vec::new(),
            asked: 0,
            lost: 0,
            sensors: BTreeMap::new(),
            reports: 0,
            unread: 0,
        };
        for one in passed {
            match *one {
                Passed::Written(at, byte) => {
                    let Some(request) = said.push(byte).and_then(Request::read) else { continue };
                    if !is_answered(request) {
                        continue;
                    }
                    let kind = discriminant(&request);
                    figures.asked += 1;
                    // The same is asked again only when it was not answered.
                    let before = waiting.len();
                    waiting.retain(|(other, _)| *other != kind);
                    figures.lost += before - waiting.len();
                    waiting.push((kind, at));
                }
                Passed::Heard(at, byte) => {
                    let text = heard.push(byte);
                    match text.map(|text| (text.len(), Reply::read(text))) {
                        Some((_, Ok(Some(reply)))) => {
                            if let Some(kind) = kind_answered(&reply)
                                && let Some(place) = waiting.iter().position(|(other, _)| *other == kind)
                            {
                                let (_, since) = waiting.remove(place);
                                figures.answers.push((at - since).as_ms());
                            }
                            figures.take(reply);
                        }
                        Some((length, Err(_))) => figures.unread += length,
                        _ => {}
                    }
                }
            }
        }
        figures.unread += heard.take_unread();
        figures.answers.sort_by(f64::total_cmp);
        figures
    }

    fn take(&mut self, reply: Reply) {
        match reply {
            Reply::Identity(identity) => self.identity = Some(identity.trim().to_owned()),
            Reply::Sensor { id, active } => {
                let before = self.sensors.insert(id, active);
                self.reports += usize::from(before == Some(false) && active);
            }
            _ => {}
        }
    }

    /// What the board says it is.
    pub(super) fn identity(&self) -> Option<&str> {
        self.identity.as_deref()
    }

    /// The share of requests that were not answered.
    pub(super) fn lost_share(&self) -> f64 {
        self.lost as f64 / self.asked.max(1) as f64
    }

    fn occupied(&self) -> usize {
        self.sensors.values().filter(|occupied| **occupied).count()
    }

    pub(super) fn json(&self) -> serde_json::Value {
        serde_json::json!({
            "identity": self.identity,
            "requests": self.asked,
            "lost_answers": self.lost,
            "answer_ms": quantiles(&self.answers),
            "sensors": self.sensors.len(),
            "occupied": self.occupied(),
            "reports": self.reports,
            "unread_bytes": self.unread,
        })
    }

    pub(super) fn write(&self, output: &mut dyn Write) -> std::io::Result<()> {
        writeln!(output, "station       {}", self.identity().unwrap_or("unknown"))?;
        writeln!(output, "requests      {}, {} without an answer", self.asked, self.lost)?;
        line(output, "answers", &self.answers)?;
        let (count, occupied) = (self.sensors.len(), self.occupied());
        writeln!(output, "sensors       {count}, {occupied} occupied, {} reports", self.reports)?;
        let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), SENSOR_DELAY_LONGEST.as_ms());
        writeln!(
            output,
            "delay         of reports taken to be {from:.1} to {to:.1} ms, as on firmware 5.6.0"
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
            title: "How soon the board answers".to_owned(),
            subtitle: format!("{} requests, {} without an answer", self.asked, self.lost),
            panels: vec![panel],
        }
    }
}

/// Whether a request has an answer that can be told from other messages.
const fn is_answered(request: Request) -> bool {
    matches!(request, Request::Status | Request::Slots | Request::Power { .. })
}

/// The kind of request that a message answers.
fn kind_answered(reply: &Reply) -> Option<Discriminant<Request>> {
    use footplate_wire::dcc_ex::Power;
    Some(match reply {
        Reply::Identity(_) => discriminant(&Request::Status),
        Reply::Slots(_) => discriminant(&Request::Slots),
        reply => {
            let on = reply.main_power()?;
            discriminant(&Request::Power { on, tracks: Power::Main })
        }
    })
}
