//! What the messages of JMRI come to: what it is, how soon it answers, and what its sensors report.

use std::io::Write;

use footplate_wire::jmri::{Client, Lines, Reply, Request, SENSOR_DELAY_SHORTEST, Settings};

use super::answers::{Answers, Sensors, Waiting, write_noise};
use super::figures::StationFigures;
use crate::link::Passed;

/// Requests whose answers can be distinguished from other messages.
#[derive(PartialEq)]
enum Kind {
    Ping,
    Power,
}

/// The figures of JMRI.
pub(super) struct JmriFigures {
    settings: Settings,
    identity: Option<String>,
    /// The system that the layout is connected to, by its name and prefix.
    system: String,
    answers: Answers,
    sensors: Sensors,
    unread: usize,
}

impl JmriFigures {
    pub(super) fn of(passed: &[Passed], session: &Client) -> Self {
        let (mut said, mut heard) = (Lines::default(), Lines::default());
        let mut waiting: Waiting<Kind> = Waiting::default();
        let system = session.system();
        let mut figures = Self {
            settings: session.settings().clone(),
            identity: None,
            system: format!("{} ({})", system.name.as_deref().unwrap_or("unknown"), system.prefix),
            answers: Answers::default(),
            sensors: Sensors::default(),
            unread: 0,
        };
        for one in passed {
            match *one {
                Passed::Written(at, byte) => match said.push(byte).map(Request::read) {
                    Some(Ok(Some(Request::Ping))) => waiting.asked(Kind::Ping, at),
                    Some(Ok(Some(Request::Power { .. }))) => waiting.asked(Kind::Power, at),
                    _ => {}
                },
                Passed::Heard(at, byte) => match heard.push(byte).map(|text| (text.len(), Reply::read(text)))
                {
                    Some((_, Ok(Some(reply)))) => {
                        match &reply {
                            Reply::Pong => waiting.answered(&Kind::Ping, at),
                            Reply::Power { .. } => waiting.answered(&Kind::Power, at),
                            _ => {}
                        }
                        figures.take(session, reply);
                    }
                    Some((length, Err(_))) => figures.unread += length,
                    _ => {}
                },
            }
        }
        figures.unread += heard.take_unread();
        figures.answers = waiting.finish();
        figures
    }

    fn take(&mut self, session: &Client, reply: Reply) {
        match reply {
            Reply::Hello { version, railroad } => self.identity = Some(format!("JMRI {version}, {railroad}")),
            Reply::Sensor { name, active: Some(active) } => {
                let settings = &self.settings;
                let number = session.system().number_of_sensor(&name);
                let of_layout =
                    |number: &u16| (settings.first_sensor..=settings.last_sensor).contains(number);
                if let Some(number) = number.filter(of_layout) {
                    self.sensors.heard(number, active);
                }
            }
            Reply::List(all) => all.into_iter().for_each(|one| self.take(session, one)),
            _ => {}
        }
    }
}

impl StationFigures for JmriFigures {
    fn check(&self) -> Result<(), &'static str> {
        self.identity
            .as_ref()
            .map(|_| ())
            .ok_or("JMRI has not said what it is; check that the port belongs to its web server")
    }

    fn answers(&self) -> &Answers {
        &self.answers
    }

    fn json(&self) -> serde_json::Value {
        let mut json = serde_json::json!({
            "identity": self.identity,
            "system": self.system,
            "unread_bytes": self.unread,
        });
        self.sensors.add_to(&mut json);
        json
    }

    fn write_station(&self, output: &mut dyn Write) -> std::io::Result<()> {
        writeln!(output, "station       {}", self.identity.as_deref().unwrap_or("unknown"))?;
        writeln!(output, "system        {}", self.system)
    }

    fn write_reports(&self, output: &mut dyn Write) -> std::io::Result<()> {
        let [count, occupied, reports] = self.sensors.counts();
        writeln!(output, "sensors       {count}, {occupied} occupied, {reports} reports")?;
        let (from, to) = (SENSOR_DELAY_SHORTEST.as_ms(), self.settings.sensor_delay.as_ms());
        writeln!(output, "delay         of reports taken to be {from:.1} to {to:.0} ms (sensor-delay)")?;
        write_noise(self.unread, output)
    }
}
