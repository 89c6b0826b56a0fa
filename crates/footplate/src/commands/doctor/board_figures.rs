//! What the messages of a DCC-EX board come to: what it is, how soon it answers, and what it reports.

use std::mem::{Discriminant, discriminant};

use footplate_wire::dcc_ex::{Framing, Power, Reply, Request, SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST};

use super::answers::{Sensors, Waiting, noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// The figures of what passed.
pub(super) fn figures_of(passed: &[Passed]) -> StationFigures {
    let (mut said, mut heard) = (Framing::default(), Framing::default());
    let mut waiting: Waiting<Discriminant<Request>> = Waiting::default();
    let (mut identity, mut sensors, mut unread) = (None, Sensors::default(), 0);
    for one in passed {
        match *one {
            Passed::Written(at, byte) => {
                let request = said.push(byte).and_then(Request::read);
                if let Some(request) = request.filter(|request| is_answered(*request)) {
                    waiting.asked(discriminant(&request), at);
                }
            }
            Passed::Heard(at, byte) => match heard.push(byte).map(|text| (text.len(), Reply::read(text))) {
                Some((_, Ok(Some(reply)))) => {
                    if let Some(kind) = kind_answered(&reply) {
                        waiting.answered(&kind, at);
                    }
                    match reply {
                        Reply::Identity(named) => identity = Some(named.trim().to_owned()),
                        Reply::Sensor { id, active } => sensors.heard(id, active),
                        _ => {}
                    }
                }
                Some((length, Err(_))) => unread += length,
                _ => {}
            },
        }
    }
    unread += heard.take_unread();
    let mut json = serde_json::json!({ "identity": identity, "unread_bytes": unread });
    sensors.add_to(&mut json);
    let [count, occupied, reports] = sensors.counts();
    let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), SENSOR_DELAY_LONGEST.as_ms());
    let lines = [
        format!("sensors       {count}, {occupied} occupied, {reports} reports"),
        format!("delay         of reports taken to be {from:.1} to {to:.1} ms, as on firmware 5.6.0"),
    ];
    StationFigures {
        missing: identity.is_none().then_some(
            "no DCC-EX board has said what it is; check the port, and listen longer with --seconds 20 if the board is slow to \
             start",
        ),
        answers: waiting.finish(),
        json,
        station: vec![format!("station       {}", identity.as_deref().unwrap_or("unknown"))],
        reports: lines.into_iter().chain(noise(unread)).collect(),
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
