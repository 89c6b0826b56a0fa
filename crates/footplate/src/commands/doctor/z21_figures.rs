//! What the datagrams of a Z21 come to: what it is, how soon it answers, and what it reports.

use std::collections::BTreeMap;
use std::io::Write;

use footplate_core::Timestamp;
use footplate_wire::z21::{
    Datasets, Firmware, Lock, RailCom, Reply, Request, SENSOR_DELAY_SHORTEST, Settings, SystemState,
};

use super::answers::{Answers, Sensors, Waiting, write_noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// The figures of a station.
#[derive(Default)]
pub(super) struct Z21Figures {
    hardware: Option<(u32, Firmware)>,
    serial_number: Option<u32>,
    lock: Option<Lock>,
    system: Option<SystemState>,
    settings: Settings,
    answers: Answers,
    sensors: Sensors,
    /// Locomotives whose decoders report by RailCom, with the last report.
    rail_com: BTreeMap<u16, RailCom>,
    /// X-BUS messages whose XOR byte was wrong, and bytes that could not be read.
    wrong_xor: usize,
    unread: usize,
}

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

impl Z21Figures {
    /// The figures of what passed, with sensors that are connected as the settings say.
    pub(super) fn of(passed: &[Passed], settings: &Settings) -> Self {
        let mut figures = Self { settings: *settings, ..Self::default() };
        let mut waiting: Waiting<Kind> = Waiting::default();
        for (at, is_heard, datagram) in datagrams(passed) {
            let mut datasets = Datasets::of(&datagram);
            for dataset in datasets.by_ref() {
                if !is_heard {
                    if let Some(kind) = Request::read(&dataset).and_then(asked) {
                        waiting.asked(kind, at);
                    }
                    continue;
                }
                figures.wrong_xor += usize::from(!dataset.is_sound());
                match Reply::read(&dataset) {
                    Ok(Some(reply)) => {
                        if let Some(kind) = answered(&reply) {
                            waiting.answered(&kind, at);
                        }
                        figures.take(reply);
                    }
                    Ok(None) => {}
                    Err(_) => figures.unread += dataset.data.len(),
                }
            }
            if is_heard {
                figures.unread += datasets.unread();
            }
        }
        figures.answers = waiting.finish();
        figures
    }

    fn take(&mut self, reply: Reply) {
        for (number, is_occupied) in self.settings.feedback.detections(&reply) {
            self.sensors.heard(number, is_occupied);
        }
        match reply {
            Reply::SerialNumber(number) => self.serial_number = Some(number),
            Reply::Hardware { kind, firmware } => self.hardware = Some((kind, firmware)),
            Reply::LockCode(lock) => self.lock = Some(lock),
            // The state after the power goes off at the end is not of interest.
            Reply::SystemState(state) if state.central.is_powered() || self.system.is_none() => {
                self.system = Some(state);
            }
            Reply::RailCom(rail_com) => drop(self.rail_com.insert(rail_com.address, rail_com)),
            _ => {}
        }
    }
}

impl StationFigures for Z21Figures {
    fn check(&self) -> Result<(), &'static str> {
        let is_known = self.serial_number.map(|_| ());
        is_known.ok_or("no Z21 has said its serial number; check its address and the network")
    }

    fn answers(&self) -> &Answers {
        &self.answers
    }

    fn json(&self) -> serde_json::Value {
        let hardware = self.hardware.map(|(kind, firmware)| (format!("{kind:#06x}"), firmware.to_string()));
        let mut json = serde_json::json!({
            "serial_number": self.serial_number,
            "hardware": hardware.as_ref().map(|(kind, _)| kind),
            "firmware": hardware.as_ref().map(|(_, firmware)| firmware),
            "locked": self.lock.map(|lock| lock == Lock::Locked),
            "track_v": self.system.map(|state| f64::from(state.track_mv) / 1e3),
            "current_ma": self.system.map(|state| state.main_ma),
            "railcom_trains": self.rail_com.keys().collect::<Vec<_>>(),
            "wrong_xor": self.wrong_xor,
            "unread_bytes": self.unread,
        });
        self.sensors.add_to(&mut json);
        json
    }

    fn write_station(&self, output: &mut dyn Write) -> std::io::Result<()> {
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
        Ok(())
    }

    fn write_reports(&self, output: &mut dyn Write) -> std::io::Result<()> {
        let [count, occupied, reports] = self.sensors.counts();
        writeln!(output, "sensors       {count} inputs, {occupied} occupied, {reports} reports")?;
        let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), self.settings.sensor_delay.as_ms());
        writeln!(output, "delay         of reports taken to be {from:.0} to {to:.0} ms (sensor-delay)")?;
        for RailCom { address, received, errors, .. } in self.rail_com.values() {
            let speed = self.rail_com.get(address).and_then(RailCom::reported_speed);
            let speed = speed.map_or_else(String::new, |speed| format!(", reports speed {speed}"));
            writeln!(output, "railcom       train {address}: {received} received, {errors} errors{speed}")?;
        }
        if self.wrong_xor > 0 {
            writeln!(output, "checksums     {} wrong; they are not relied on", self.wrong_xor)?;
        }
        write_noise(self.unread, output)
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
