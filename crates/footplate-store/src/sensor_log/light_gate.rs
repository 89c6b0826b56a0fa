//! The form *light-gate*: a train already running, its sensors on the host's clock, and two light gates on a
//! clock of their own.
//!
//! Columns: `run`, `train`, `speed_level`, `kind` (`sensor` or `gate`), `name` (of the sensor; `L0`, `L1` for
//! gates), `t_ms`, `clock` (`host_epoch_ms` or `gate_clock_ms`).

use footplate_core::{EventKind, Report, RunId, SpeedStep, Timestamp, TrainId};

use super::form_reader::FormReader;
use super::runs::{Runs, UNIX_TIMES_FROM, gate_named};
use crate::decimal::scaled;
use crate::recording::{Form, Note, Oddity, TrainAtStart};
use crate::sensor_names::SensorNames;
use crate::table::{Column, Row, TableError};

pub(super) struct LightGateLog<'a> {
    sensors: &'a dyn SensorNames,
    run: Column,
    train: Column,
    speed_level: Column,
    kind: Column,
    name: Column,
    time: Column,
    clock: Column,
    /// The last pass of a gate in the run before the one that is open.
    last_gate: Option<Timestamp>,
}

impl<'a> LightGateLog<'a> {
    pub(super) const COLUMNS: [&'static str; 7] =
        ["run", "train", "speed_level", "kind", "name", "t_ms", "clock"];

    /// `columns` in the order of [`COLUMNS`](Self::COLUMNS).
    pub(super) fn new(columns: [Column; 7], sensors: &'a dyn SensorNames) -> Self {
        let [run, train, speed_level, kind, name, time, clock] = columns;
        Self { sensors, run, train, speed_level, kind, name, time, clock, last_gate: None }
    }

    fn entry(&self, row: Row<'_>, time: Timestamp) -> Result<Entry, TableError> {
        let (entry, clock) = match row.text(self.kind) {
            "sensor" => {
                let sensor =
                    row.read(self.name, &self.sensors.example(), |name| self.sensors.sensor_named(name))?;
                (Entry::Sensor(Report { sensor, poll_interval: None }), "host_epoch_ms")
            }
            "gate" => (Entry::Gate(row.read(self.name, "a gate such as `L0`", gate_named)?), "gate_clock_ms"),
            _ => return Err(row.wrong(self.kind, "`sensor` or `gate`")),
        };
        if row.text(self.clock) != clock {
            return Err(row.wrong(self.clock, format!("`{clock}`, the clock of this kind of row")));
        }
        if matches!(entry, Entry::Sensor(_)) && time < UNIX_TIMES_FROM {
            return Err(row.wrong(self.time, "milliseconds since the Unix epoch, 1000000000000 or more"));
        }
        Ok(entry)
    }
}

enum Entry {
    Sensor(Report),
    Gate(u8),
}

impl FormReader for LightGateLog<'_> {
    const FORM: Form = Form::LightGate;
    const REQUIRED: &'static [&'static str] = &Self::COLUMNS;
    const OPTIONAL: &'static [&'static str] = &[];

    fn read_row(&mut self, row: Row<'_>, runs: &mut Runs) -> Result<(), TableError> {
        let id = row.read(self.run, "the number of a run", |text| text.parse().ok().map(RunId))?;
        let train = row.read(self.train, "the number of a train", |text| text.parse().ok().map(TrainId))?;
        let step = row.read(self.speed_level, "a throttle step, 0 to 126", |text| {
            text.parse().ok().and_then(SpeedStep::new)
        })?;
        let clock = row.read(self.time, "a time in milliseconds", |text| {
            scaled(text, 6).filter(|ns| *ns >= 0).map(Timestamp::from_ns)
        })?;
        let entry = self.entry(row, clock)?;
        runs.check_not_ended(row, Some(self.run), id)?;
        let running = TrainAtStart { train, step };
        if runs.open(id).is_none() {
            self.last_gate =
                runs.last().and_then(|run| run.gates.last()).map(|pass| pass.time).or(self.last_gate);
            runs.begin(row, id, vec![running]);
        }
        let Some(run) = runs.open(id) else { return Ok(()) };
        if let Some(known) = run.only_train() {
            if known.train != train {
                return Err(row.wrong(self.train, format!("{}, the train of this run", known.train)));
            }
            if known.step != step {
                return Err(row.wrong(self.speed_level, format!("{}, the step of this run", known.step)));
            }
        }
        match entry {
            Entry::Sensor(report) => {
                let origin = *run.began_at.get_or_insert(clock);
                run.add(row, self.time, Timestamp::ZERO + (clock - origin), EventKind::Sensor(report))
            }
            Entry::Gate(gate) => {
                let first = run.gates.is_empty();
                run.add_gate(row, self.time, gate, clock)?;
                if first && self.last_gate.is_some_and(|last| clock < last) {
                    runs.note(Note { line: row.line(), oddity: Oddity::TimerRestarted(id) });
                }
                Ok(())
            }
        }
    }
}
