//! What the messages of JMRI come to: what it is, how soon it answers, and what its sensors report.

use footplate_wire::jmri::{Client, Lines, Reply, Request, SENSOR_DELAY_SHORTEST, Settings, System};

use super::answers::{Sensors, Waiting, noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// Requests whose answers can be distinguished from other messages.
#[derive(PartialEq)]
enum Kind {
    Ping,
    Power,
}

/// The figures of what passed in a session.
pub(super) fn figures_of(passed: &[Passed], session: &Client) -> StationFigures {
    let (mut said, mut heard) = (Lines::default(), Lines::default());
    let mut waiting: Waiting<Kind> = Waiting::default();
    let (mut identity, mut sensors, mut unread) = (None, Sensors::default(), 0);
    for one in passed {
        match *one {
            Passed::Written(at, byte) => match said.push(byte).map(Request::read) {
                Some(Ok(Some(Request::Ping))) => waiting.asked(Kind::Ping, at),
                Some(Ok(Some(Request::Power { .. }))) => waiting.asked(Kind::Power, at),
                _ => {}
            },
            Passed::Heard(at, byte) => match heard.push(byte).map(|text| (text.len(), Reply::read(text))) {
                Some((_, Ok(Some(reply)))) => {
                    match &reply {
                        Reply::Pong => waiting.answered(&Kind::Ping, at),
                        Reply::Power { .. } => waiting.answered(&Kind::Power, at),
                        _ => {}
                    }
                    take(reply, session, &mut identity, &mut sensors);
                }
                Some((length, Err(_))) => unread += length,
                _ => {}
            },
        }
    }
    unread += heard.take_unread();
    // The system that the layout is connected to.
    let System { name, prefix } = session.system();
    let system = format!("{} ({prefix})", name.as_deref().unwrap_or("unknown"));
    let mut json = serde_json::json!({ "identity": identity, "system": system, "unread_bytes": unread });
    sensors.add_to(&mut json);
    let [count, occupied, reports] = sensors.counts();
    let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), session.settings().sensor_delay.as_ms());
    let lines = [
        format!("sensors       {count}, {occupied} occupied, {reports} reports"),
        format!("delay         of reports taken to be {from:.1} to {to:.0} ms (sensor-delay)"),
    ];
    StationFigures {
        missing: identity
            .is_none()
            .then_some("JMRI has not said what it is; check that the port belongs to its web server"),
        answers: waiting.finish(),
        json,
        station: vec![
            format!("station       {}", identity.as_deref().unwrap_or("unknown")),
            format!("system        {system}"),
        ],
        reports: lines.into_iter().chain(noise(unread)).collect(),
    }
}

fn take(reply: Reply, session: &Client, identity: &mut Option<String>, sensors: &mut Sensors) {
    match reply {
        Reply::Hello { version, railroad } => *identity = Some(format!("JMRI {version}, {railroad}")),
        Reply::Sensor { name, active: Some(active) } => {
            let Settings { first_sensor, last_sensor, .. } = session.settings();
            let number = session.system().number_of_sensor(&name);
            if let Some(number) = number.filter(|number| (first_sensor..=last_sensor).contains(&number)) {
                sensors.heard(number, active);
            }
        }
        Reply::List(all) => all.into_iter().for_each(|one| take(one, session, identity, sensors)),
        _ => {}
    }
}
