//! What the datagrams of a Z21 come to: what it is, how soon it answers, and what it reports.

use std::collections::BTreeMap;

use footplate_core::Timestamp;
use footplate_wire::z21::{
    Datasets, Lock, RailCom, Reply, Request, SENSOR_DELAY_SHORTEST, Settings, SystemState,
};

use super::answers::{Sensors, Waiting, noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// A kind of request whose answer differs from all other messages.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    SerialNumber,
    Hardware,
    LockCode,
    Broadcasts,
    Status,
    Power,
    Feedback(u8),
}

/// The figures of what passed, with sensors that are connected as the settings say.
pub(super) fn figures_of(passed: &[Passed], settings: &Settings) -> StationFigures {
    let mut waiting: Waiting<Kind> = Waiting::default();
    let (mut serial_number, mut hardware, mut lock, mut system) = (None, None, None, None);
    let mut sensors = Sensors::default();
    // Locomotives whose decoders report by RailCom, with the last report.
    let mut rail_com: BTreeMap<u16, RailCom> = BTreeMap::new();
    // X-BUS messages whose XOR byte was wrong, and bytes that could not be read.
    let (mut wrong_xor, mut unread) = (0, 0);
    for (at, is_heard, datagram) in datagrams(passed) {
        let mut datasets = Datasets::of(&datagram);
        for dataset in datasets.by_ref() {
            if !is_heard {
                if let Some(kind) = Request::read(&dataset).and_then(asked) {
                    waiting.asked(kind, at);
                }
                continue;
            }
            wrong_xor += usize::from(!dataset.is_sound());
            let reply = match Reply::read(&dataset) {
                Ok(Some(reply)) => reply,
                Ok(None) => continue,
                Err(_) => {
                    unread += dataset.data.len();
                    continue;
                }
            };
            if let Some(kind) = answered(&reply) {
                waiting.answered(&kind, at);
            }
            for (number, is_occupied) in settings.feedback.detections(&reply) {
                sensors.heard(number, is_occupied);
            }
            match reply {
                Reply::SerialNumber(number) => serial_number = Some(number),
                Reply::Hardware { kind, firmware } => {
                    hardware = Some((format!("{kind:#06x}"), firmware.to_string()));
                }
                Reply::LockCode(state) => lock = Some(state),
                // The state after the power goes off at the end is not of interest.
                Reply::SystemState(state) if state.central.is_powered() || system.is_none() => {
                    system = Some(state);
                }
                Reply::RailCom(report) => drop(rail_com.insert(report.address, report)),
                _ => {}
            }
        }
        if is_heard {
            unread += datasets.unread();
        }
    }
    let volts = |state: SystemState| f64::from(state.track_mv) / 1e3;
    let mut json = serde_json::json!({
        "serial_number": serial_number,
        "hardware": hardware.as_ref().map(|(kind, _)| kind),
        "firmware": hardware.as_ref().map(|(_, firmware)| firmware),
        "locked": lock.map(|lock| lock == Lock::Locked),
        "track_v": system.map(volts),
        "current_ma": system.map(|state| state.main_ma),
        "railcom_trains": rail_com.keys().collect::<Vec<_>>(),
        "wrong_xor": wrong_xor,
        "unread_bytes": unread,
    });
    sensors.add_to(&mut json);
    let number = serial_number.unwrap_or_default();
    let named = match hardware {
        Some((kind, firmware)) => format!("hardware {kind}, firmware {firmware}, serial number {number}"),
        None => format!("serial number {number}, does not say what it is"),
    };
    let track = system.map(|state| {
        let SystemState { main_ma, temperature_c, .. } = state;
        format!("track         {:.1} V, {main_ma} mA, station at {temperature_c} °C", volts(state))
    });
    let [count, occupied, reports] = sensors.counts();
    let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), settings.sensor_delay.as_ms());
    let lines = [
        format!("sensors       {count} inputs, {occupied} occupied, {reports} reports"),
        format!("delay         of reports taken to be {from:.0} to {to:.0} ms (sensor-delay)"),
    ];
    let decoders = rail_com.values().map(|report| {
        let RailCom { address, received, errors, .. } = report;
        let speed =
            report.reported_speed().map_or_else(String::new, |speed| format!(", reports speed {speed}"));
        format!("railcom       train {address}: {received} received, {errors} errors{speed}")
    });
    let checksums =
        (wrong_xor > 0).then(|| format!("checksums     {wrong_xor} wrong; they are not relied on"));
    StationFigures {
        missing: serial_number
            .is_none()
            .then_some("no Z21 has said its serial number; check its address and the network"),
        answers: waiting.finish(),
        json,
        station: [format!("station       {named}")].into_iter().chain(track).collect(),
        reports: lines.into_iter().chain(decoders).chain(checksums).chain(noise(unread)).collect(),
    }
}

/// What passed, in datagrams as far as times tell them apart: when, whether from the station, and the bytes.
fn datagrams(passed: &[Passed]) -> impl Iterator<Item = (Timestamp, bool, Vec<u8>)> {
    let of = |one: &Passed| match *one {
        Passed::Written(at, byte) => (at, false, byte),
        Passed::Heard(at, byte) => (at, true, byte),
    };
    let is_one = move |one: &Passed, other: &Passed| {
        let ((at, heard, _), (other_at, other_heard, _)) = (of(one), of(other));
        at == other_at && heard == other_heard
    };
    passed.chunk_by(is_one).filter_map(move |part| {
        let (at, is_heard, _) = of(part.first()?);
        Some((at, is_heard, part.iter().map(|one| of(one).2).collect()))
    })
}

const fn asked(request: Request) -> Option<Kind> {
    Some(match request {
        Request::SerialNumber => Kind::SerialNumber,
        Request::Hardware => Kind::Hardware,
        Request::LockCode => Kind::LockCode,
        Request::Broadcasts => Kind::Broadcasts,
        Request::Status => Kind::Status,
        Request::Power { .. } => Kind::Power,
        Request::Feedback { group } => Kind::Feedback(group),
        _ => return None,
    })
}

const fn answered(reply: &Reply) -> Option<Kind> {
    Some(match reply {
        Reply::SerialNumber(_) => Kind::SerialNumber,
        Reply::Hardware { .. } => Kind::Hardware,
        Reply::LockCode(_) => Kind::LockCode,
        Reply::Broadcasts(_) => Kind::Broadcasts,
        Reply::Status(_) => Kind::Status,
        Reply::Power { .. } => Kind::Power,
        Reply::Feedback { group, .. } => Kind::Feedback(*group),
        _ => return None,
    })
}
