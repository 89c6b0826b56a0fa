//! The form *sensor-log*, Footplate's own: a row an event.
//!
//! Columns: `t_s` and `kind`; and as far as the kinds need them `run`, `name`, `train`, `step`, `leg`,
//! `landmark`, `offset_mm`, `poll_interval_ms`. The kinds are the arms of [`OwnLog::entry`].

use std::io::BufRead;

use footplate_core::{EventKind, Report, RunId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::form_reader::{FormReader, LogContext};
use super::runs::{Runs, UNIX_TIMES_FROM, gate_named};
use super::since_command::length_in_mm;
use crate::decimal::scaled;
use crate::recording::{Form, Run, TrainAtStart};
use crate::table::{Column, Row, Table, TableError};

/// The run of a log that has no column `run`.
const ONLY_RUN: RunId = RunId(1);
pub(super) struct OwnLog<'a> {
    context: LogContext<'a>,
    time: Column,
    kind: Column,
    run: Option<Column>,
    name: Option<Column>,
    train: Option<Column>,
    step: Option<Column>,
    leg: Option<Column>,
    landmark: Option<Column>,
    offset: Option<Column>,
    poll_interval: Option<Column>,
}

/// What a row says.
enum Entry {
    Event(EventKind),
    Running(TrainAtStart),
    Gate(u8),
}

impl<'a> OwnLog<'a> {
    pub(super) const COLUMNS: [&'static str; 2] = ["t_s", "kind"];

    /// `columns` in the order of [`COLUMNS`](Self::COLUMNS).
    pub(super) fn new<R: BufRead>(table: &Table<R>, columns: [Column; 2], context: LogContext<'a>) -> Self {
        let [time, kind] = columns;
        Self {
            context,
            time,
            kind,
            run: table.column("run"),
            name: table.column("name"),
            train: table.column("train"),
            step: table.column("step"),
            leg: table.column("leg"),
            landmark: table.column("landmark"),
            offset: table.column("offset_mm"),
            poll_interval: table.column("poll_interval_ms"),
        }
    }

    /// What a row says; `run` is the run it continues, if it does.
    fn entry(&self, row: Row<'_>, run: Option<&Run>) -> Result<Entry, TableError> {
        let sensors = self.context.sensors;
        let event = match row.text(self.kind) {
            "sensor" => {
                let column = row.needs(self.name, "name", "a `sensor` row")?;
                let sensor = row.read(column, &sensors.example(), |name| sensors.sensor_named(name))?;
                EventKind::Sensor(Report { sensor, poll_interval: self.poll_interval(row)? })
            }
            "freed" => {
                let column = row.needs(self.name, "name", "a `freed` row")?;
                let sensor =
                    row.read(column, "the name of a block of this layout", |name| sensors.block_named(name))?;
                EventKind::Freed(Report { sensor, poll_interval: self.poll_interval(row)? })
            }
            "running" => {
                let (train, step) = (self.train(row, run)?, self.step(row, "a `running` row")?);
                return Ok(Entry::Running(TrainAtStart { train, step }));
            }
            "speed" => {
                EventKind::Speed { train: self.train(row, run)?, step: self.step(row, "a `speed` row")? }
            }
            "reverse" => EventKind::Reverse { train: self.train(row, run)? },
            "turnout" => {
                let column = row.needs(self.name, "name", "a `turnout` row")?;
                let turnout =
                    row.read(column, "the number of a turnout", |text| text.parse().ok().map(TurnoutId))?;
                let column = row.needs(self.leg, "leg", "a `turnout` row")?;
                let curved = row.read(column, "`straight` or `curved`", |leg| match leg {
                    "straight" => Some(false),
                    "curved" => Some(true),
                    _ => None,
                })?;
                EventKind::Turnout { turnout, curved }
            }
            "stopped" => {
                let column = row.needs(self.landmark, "landmark", "a `stopped` row")?;
                let landmark = row.read(column, &sensors.example(), |name| sensors.sensor_named(name))?;
                let column = row.needs(self.offset, "offset_mm", "a `stopped` row")?;
                let offset = row.read(column, "a distance in millimetres", length_in_mm)?;
                EventKind::Stopped { train: self.train(row, run)?, landmark, offset }
            }
            "gate" => {
                let column = row.needs(self.name, "name", "a `gate` row")?;
                return Ok(Entry::Gate(row.read(column, "a gate such as `L0`", gate_named)?));
            }
            _ => {
                let kinds =
                    "`sensor`, `freed`, `speed`, `reverse`, `turnout`, `stopped`, `running` or `gate`";
                return Err(row.wrong(self.kind, kinds));
            }
        };
        Ok(Entry::Event(event))
    }

    /// The train a row names, or the only one that it can mean.
    fn train(&self, row: Row<'_>, run: Option<&Run>) -> Result<TrainId, TableError> {
        let only = run.and_then(Run::only_train).map(|known| known.train).or(self.context.train);
        let Some(column) = self.train else {
            return only.ok_or_else(|| row.lacks("train", "a row about a train"));
        };
        match (row.text(column), only) {
            ("", Some(only)) => Ok(only),
            (text, _) => text
                .parse()
                .map(TrainId)
                .map_err(|_| row.wrong(column, "the number of a train (or empty, with `--train`)")),
        }
    }

    fn step(&self, row: Row<'_>, kind: &'static str) -> Result<SpeedStep, TableError> {
        let column = row.needs(self.step, "step", kind)?;
        row.read(column, "a throttle step, 0 to 126", |text| text.parse().ok().and_then(SpeedStep::new))
    }

    fn poll_interval(&self, row: Row<'_>) -> Result<Option<TimeSpan>, TableError> {
        let Some(column) = self.poll_interval.filter(|column| !row.text(*column).is_empty()) else {
            return Ok(None);
        };
        row.read(column, "a positive number of milliseconds, or empty", |text| {
            scaled(text, 6).filter(|ns| *ns > 0).map(|ns| Some(TimeSpan::from_ns(ns)))
        })
    }
}

impl FormReader for OwnLog<'_> {
    const FORM: Form = Form::SensorLog;
    const REQUIRED: &'static [&'static str] = &Self::COLUMNS;
    const OPTIONAL: &'static [&'static str] =
        &["run", "name", "train", "step", "leg", "landmark", "offset_mm", "poll_interval_ms"];

    fn read_row(&mut self, row: Row<'_>, runs: &mut Runs) -> Result<(), TableError> {
        let id = match self.run {
            Some(column) => row.read(column, "the number of a run", |text| text.parse().ok().map(RunId))?,
            None => ONLY_RUN,
        };
        let clock = row.read(self.time, "a time in seconds such as 12.345", |text| {
            scaled(text, 9).map(Timestamp::from_ns)
        })?;
        runs.check_not_ended(row, self.run, id)?;
        let entry = self.entry(row, runs.open(id).map(|run| &*run))?;
        if runs.open(id).is_none() {
            runs.begin(row, id, Vec::new());
        }
        let Some(run) = runs.open(id) else { return Ok(()) };
        if let Entry::Gate(gate) = entry {
            return run.add_gate(row, self.time, gate, clock);
        }
        // The first row on the run's own clock decides from where that clock counts.
        if run.events.is_empty() && run.trains.is_empty() && clock >= UNIX_TIMES_FROM {
            run.began_at = Some(clock);
        }
        let time = Timestamp::ZERO + (clock - run.began_at.unwrap_or_default());
        match entry {
            Entry::Running(at_start) => {
                if !run.events.is_empty() || run.knows(at_start.train) {
                    return Err(row.wrong(
                        self.kind,
                        "an event: `running` is given once, before the first event of its run",
                    ));
                }
                run.trains.push(at_start);
                Ok(())
            }
            Entry::Event(kind) => {
                run.add(row, self.time, time, kind)?;
                let named = match kind {
                    EventKind::Speed { train, .. }
                    | EventKind::Reverse { train }
                    | EventKind::Stopped { train, .. } => Some(train),
                    EventKind::Sensor(_) | EventKind::Freed(_) | EventKind::Turnout { .. } => None,
                };
                if let Some(train) = named.filter(|train| !run.knows(*train)) {
                    run.trains.push(TrainAtStart { train, step: SpeedStep::STAND });
                }
                Ok(())
            }
            Entry::Gate(_) => Ok(()),
        }
    }
}
