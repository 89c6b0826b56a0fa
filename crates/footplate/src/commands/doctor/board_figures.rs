//! What the messages of a DCC-EX board come to: what it is, how soon it answers, and what it reports.

use std::io::Write;
use std::mem::{Discriminant, discriminant};

use footplate_wire::dcc_ex::{Framing, Power, Reply, Request, SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST};

use super::answers::{Answers, Sensors, Waiting, write_noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// The figures of a board.
#[derive(Default)]
pub(super) struct BoardFigures {
    identity: Option<String>,
    answers: Answers,
    sensors: Sensors,
    unread: usize,
}

impl BoardFigures {
    pub(super) fn of(passed: &[Passed]) -> Self {
        let (mut said, mut heard) = (Framing::default(), Framing::default());
        let mut waiting: Waiting<Discriminant<Request>> = Waiting::default();
        let mut figures = Self::default();
        for one in passed {
            match *one {
                Passed::Written(at, byte) => {
                    let request = said.push(byte).and_then(Request::read);
                    if let Some(request) = request.filter(|request| is_answered(*request)) {
                        waiting.asked(discriminant(&request), at);
                    }
                }
                Passed::Heard(at, byte) => {
                    let text = heard.push(byte);
                    match text.map(|text| (text.len(), Reply::read(text))) {
                        Some((_, Ok(Some(reply)))) => {
                            if let Some(kind) = kind_answered(&reply) {
                                waiting.answered(&kind, at);
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
        figures.answers = waiting.finish();
        figures
    }

    fn take(&mut self, reply: Reply) {
        match reply {
            Reply::Identity(identity) => self.identity = Some(identity.trim().to_owned()),
            Reply::Sensor { id, active } => self.sensors.heard(id, active),
            _ => {}
        }
    }
}

impl StationFigures for BoardFigures {
    fn check(&self) -> Result<(), &'static str> {
        self.identity.as_ref().map(|_| ()).ok_or(
            "no DCC-EX board has said what it is; check the port, and listen longer with --seconds 20 if the board is slow to \
             start",
        )
    }

    fn answers(&self) -> &Answers {
        &self.answers
    }

    fn json(&self) -> serde_json::Value {
        let mut json = serde_json::json!({ "identity": self.identity, "unread_bytes": self.unread });
        self.sensors.add_to(&mut json);
        json
    }

    fn write_station(&self, output: &mut dyn Write) -> std::io::Result<()> {
        writeln!(output, "station       {}", self.identity.as_deref().unwrap_or("unknown"))
    }

    fn write_reports(&self, output: &mut dyn Write) -> std::io::Result<()> {
        let [count, occupied, reports] = self.sensors.counts();
        writeln!(output, "sensors       {count}, {occupied} occupied, {reports} reports")?;
        let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), SENSOR_DELAY_LONGEST.as_ms());
        writeln!(
            output,
            "delay         of reports taken to be {from:.1} to {to:.1} ms, as on firmware 5.6.0"
        )?;
        write_noise(self.unread, output)
    }
}

/// Whether a request has an answer that differs from all other messages.
const fn is_answered(request: Request) -> bool {
    matches!(request, Request::Status | Request::Slots | Request::Power { .. })
}

/// The kind of request that a message answers.
fn kind_answered(reply: &Reply) -> Option<Discriminant<Request>> {
    Some(match reply {
        Reply::Identity(_) => discriminant(&Request::Status),
        Reply::Slots(_) => discriminant(&Request::Slots),
        reply => {
            let on = reply.main_power()?;
            discriminant(&Request::Power { on, tracks: Power::Main })
        }
    })
}
