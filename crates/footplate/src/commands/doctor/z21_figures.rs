//! What the datagrams of a Z21 come to: what it is, how soon it answers, and what it reports.

use std::collections::BTreeMap;
use std::io::Write;

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::z21::{
    Datasets, Feedback, Firmware, Lock, RailCom, Reply, Request, SENSOR_DELAY_SHORTEST, SystemState,
};

use super::figures::{line, quantiles};
use crate::commands::plot::{Ink, Layer, Panel, Picture, Shape, shares};
use crate::link::Passed;

/// The figures of a station.
#[derive(Default)]
pub(super) struct Z21Figures {
    hardware: Option<(u32, Firmware)>,
    serial_number: Option<u32>,
    lock: Option<Lock>,
    system: Option<SystemState>,
    /// From a request to its answer, in ms, sorted.
    answers: Vec<f64>,
    asked: usize,
    lost: usize,
    /// Sensors by their numbers on the station, and whether they were occupied last.
    sensors: BTreeMap<u16, bool>,
    reports: usize,
    /// Locomotives whose decoders report by RailCom, and what they said last.
    rail_com: BTreeMap<u16, RailCom>,
    /// X-BUS messages whose XOR byte was wrong, and bytes that could not be read.
    wrong_xor: usize,
    unread: usize,
}

/// A kind of request whose answer can be told from other messages.
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

impl Z21Figures {
    /// The figures of what passed, with sensors that are connected so.
    pub(super) fn of(passed: &[Passed], feedback: Feedback) -> Self {
        let mut figures = Self::default();
        let mut waiting: Vec<(Kind, Timestamp)> = Vec::new();
        for (at, is_heard, datagram) in datagrams(passed) {
            let mut datasets = Datasets::of(&datagram);
            for dataset in datasets.by_ref() {
                if !is_heard {
                    if let Some(kind) = Request::read(&dataset).and_then(asked) {
                        figures.asked += 1;
                        // The same is asked again before it was answered only when no answer came.
                        let before = waiting.len();
                        waiting.retain(|(other, _)| *other != kind);
                        figures.lost += before - waiting.len();
                        waiting.push((kind, at));
                    }
                    continue;
                }
                figures.wrong_xor += usize::from(!dataset.is_sound());
                match Reply::read(&dataset) {
                    Ok(Some(reply)) => {
                        let place = waiting.iter().position(|(kind, _)| Some(*kind) == answered(&reply));
                        if let Some(place) = place {
                            let (_, since) = waiting.remove(place);
                            figures.answers.push((at - since).as_ms());
                        }
                        figures.take(reply, feedback);
                    }
                    Ok(None) => {}
                    Err(_) => figures.unread += dataset.data.len(),
                }
            }
            if is_heard {
                figures.unread += datasets.unread();
            }
        }
        figures.answers.sort_by(f64::total_cmp);
        figures
    }

    fn take(&mut self, reply: Reply, feedback: Feedback) {
        for (number, is_occupied) in feedback.detections(&reply) {
            let before = self.sensors.insert(number, is_occupied);
            self.reports += usize::from(before == Some(false) && is_occupied);
        }
        match reply {
            Reply::SerialNumber(number) => self.serial_number = Some(number),
            Reply::Hardware { kind, firmware } => self.hardware = Some((kind, firmware)),
            Reply::LockCode(lock) => self.lock = Some(lock),
            // What it says when the power goes off at the end is no news.
            Reply::SystemState(state) if state.central.is_powered() || self.system.is_none() => {
                self.system = Some(state);
            }
            Reply::RailCom(rail_com) => drop(self.rail_com.insert(rail_com.address, rail_com)),
            _ => {}
        }
    }

    /// Whether anything was heard that only such a station says.
    pub(super) const fn is_known(&self) -> bool {
        self.serial_number.is_some()
    }

    /// The share of requests that were not answered.
    pub(super) fn lost_share(&self) -> f64 {
        self.lost as f64 / self.asked.max(1) as f64
    }

    fn occupied(&self) -> usize {
        self.sensors.values().filter(|occupied| **occupied).count()
    }

    pub(super) fn json(&self) -> serde_json::Value {
        let hardware = self.hardware.map(|(kind, firmware)| (format!("{kind:#06x}"), firmware.to_string()));
        serde_json::json!({
            "serial_number": self.serial_number,
            "hardware": hardware.as_ref().map(|(kind, _)| kind),
            "firmware": hardware.as_ref().map(|(_, firmware)| firmware),
            "locked": self.lock.map(|lock| lock == Lock::Locked),
            "track_v": self.system.map(|state| f64::from(state.track_mv) / 1e3),
            "current_ma": self.system.map(|state| state.main_ma),
            "requests": self.asked,
            "lost_answers": self.lost,
            "answer_ms": quantiles(&self.answers),
            "sensors": self.sensors.len(),
            "occupied": self.occupied(),
            "reports": self.reports,
            "railcom_trains": self.rail_com.keys().collect::<Vec<_>>(),
            "wrong_xor": self.wrong_xor,
            "unread_bytes": self.unread,
        })
    }

    /// Says it to a person; `sensor_delay`: the longest delay that reports are taken to have.
    pub(super) fn write(&self, sensor_delay: TimeSpan, output: &mut dyn Write) -> std::io::Result<()> {
        let number = self.serial_number.unwrap_or_default();
        match self.hardware {
            Some((kind, firmware)) => {
                writeln!(
                    output,
                    "station       hardware {kind:#06x}, firmware {firmware}, serial number {number}"
                )?;
            }
            None => writeln!(output, "station       serial number {number}, does not say what it is")?,
        }
        if let Some(SystemState { track_mv, main_ma, temperature_c, .. }) = self.system {
            let volts = f64::from(track_mv) / 1e3;
            writeln!(output, "track         {volts:.1} V, {main_ma} mA, station at {temperature_c} °C")?;
        }
        writeln!(output, "requests      {}, {} without an answer", self.asked, self.lost)?;
        line(output, "answers", &self.answers)?;
        let (count, occupied) = (self.sensors.len(), self.occupied());
        writeln!(output, "sensors       {count} inputs, {occupied} occupied, {} reports", self.reports)?;
        let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), sensor_delay.as_ms());
        writeln!(output, "delay         of reports taken to be {from:.0} to {to:.0} ms (sensor-delay)")?;
        for RailCom { address, received, errors, .. } in self.rail_com.values() {
            let speed = self.rail_com.get(address).and_then(RailCom::reported_speed);
            let speed = speed.map_or_else(String::new, |speed| format!(", reports speed {speed}"));
            writeln!(output, "railcom       train {address}: {received} received, {errors} errors{speed}")?;
        }
        if self.wrong_xor > 0 {
            writeln!(output, "checksums     {} wrong; they are not relied on", self.wrong_xor)?;
        }
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
