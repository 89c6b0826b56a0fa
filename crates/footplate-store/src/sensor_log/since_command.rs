//! The form *since-command*: every run begins with a speed command, and times count from it.
//!
//! Columns: `run`, `event` (`speed`, `sensor`, `stop`, `stopped`), `speed_level`, `sensor`, `t_since_command_s`;
//! also `distance_mm` (tape measure of a stop, from the sensor reported last before `stop`) and `t_ticks`
//! (the 508 kHz timer behind the times).

use std::io::BufRead;

use footplate_core::{EventKind, Length, Report, RunId, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::form_reader::FormReader;
use super::runs::{LONGEST_RUN, Runs};
use crate::decimal::scaled;
use crate::recording::{Form, Note, Oddity, TrainAtStart};
use crate::sensor_names::SensorNames;
use crate::table::{Column, Row, Table, TableError};

/// The rate with which the seconds of these logs were made from ticks. (The timer of their processor, an EP9302,
/// counts at 508.469 kHz: true times are 0.09 % shorter. The seconds are taken as written.)
const TICKS_PER_S: i64 = 508_000;
/// How far ticks and seconds may disagree: seconds are rounded to the microsecond, half a tick.
const AGREEMENT_TICKS: u32 = 1;

pub(super) struct SinceCommandLog<'a> {
    sensors: &'a dyn SensorNames,
    train: TrainId,
    run: Column,
    event: Column,
    speed_level: Column,
    sensor: Column,
    since_command: Column,
    distance: Option<Column>,
    ticks: Option<Column>,
    /// The step commanded at the beginning of the run that is open.
    commanded: SpeedStep,
    /// The timer at that command.
    ticks_at_command: Option<u32>,
    /// The timer in the row before.
    last_ticks: Option<u32>,
}

impl<'a> SinceCommandLog<'a> {
    pub(super) const COLUMNS: [&'static str; 5] =
        ["run", "event", "speed_level", "sensor", "t_since_command_s"];

    /// `columns` in the order of [`COLUMNS`](Self::COLUMNS).
    pub(super) fn new<R: BufRead>(
        table: &Table<R>,
        columns: [Column; 5],
        sensors: &'a dyn SensorNames,
        train: TrainId,
    ) -> Self {
        let [run, event, speed_level, sensor, since_command] = columns;
        Self {
            sensors,
            train,
            run,
            event,
            speed_level,
            sensor,
            since_command,
            distance: table.column("distance_mm"),
            ticks: table.column("t_ticks"),
            commanded: SpeedStep::STAND,
            ticks_at_command: None,
            last_ticks: None,
        }
    }

    /// The event of a row that is not the first of its run.
    fn later_event(&self, row: Row<'_>, runs: &mut Runs, id: RunId) -> Result<EventKind, TableError> {
        match row.text(self.event) {
            "sensor" => {
                let sensor =
                    row.read(self.sensor, &self.sensors.example(), |name| self.sensors.sensor_named(name))?;
                Ok(EventKind::Sensor(Report { sensor, poll_interval: None }))
            }
            "stop" => Ok(EventKind::Speed { train: self.train, step: SpeedStep::STAND }),
            "stopped" => {
                let column = row.needs(self.distance, "distance_mm", "a `stopped` row")?;
                let offset = row.read(column, "a distance in millimetres", length_in_mm)?;
                let landmark = runs.open(id).and_then(|run| run.last_sensor()).ok_or_else(|| {
                    row.wrong(
                        self.event,
                        "after a `sensor` row: the tape is laid from the sensor reported last",
                    )
                })?;
                Ok(EventKind::Stopped { train: self.train, landmark, offset })
            }
            _ => {
                Err(row
                    .wrong(self.event, "`sensor`, `stop` or `stopped`, or `speed` at the beginning of a run"))
            }
        }
    }

    /// The timer of a row, checked against its seconds.
    fn ticks(&self, row: Row<'_>, since: TimeSpan, begins: bool) -> Result<Option<u32>, TableError> {
        let Some(column) = self.ticks.filter(|column| !row.text(*column).is_empty()) else { return Ok(None) };
        let ticks = row.read(column, "a count of ticks, 0 to 4294967295", |text| text.parse::<u32>().ok())?;
        if let (Some(from), false) = (self.ticks_at_command, begins) {
            // The timer has 32 bits and begins anew after 2.3 hours: only the low bits can be compared.
            let counted = since.as_ns() / 1_000 * TICKS_PER_S / 1_000_000;
            let expected = from.wrapping_add(counted as u32);
            if (ticks.wrapping_sub(expected) as i32).unsigned_abs() > AGREEMENT_TICKS {
                return Err(
                    row.wrong(column, format!("{expected}, if the seconds since the command are right"))
                );
            }
        }
        Ok(Some(ticks))
    }
}

impl FormReader for SinceCommandLog<'_> {
    const FORM: Form = Form::SinceCommand;
    const REQUIRED: &'static [&'static str] = &Self::COLUMNS;
    const OPTIONAL: &'static [&'static str] = &["distance_mm", "t_ticks"];

    fn read_row(&mut self, row: Row<'_>, runs: &mut Runs) -> Result<(), TableError> {
        let id = row.read(self.run, "the number of a run", |text| text.parse().ok().map(RunId))?;
        let step = row.read(self.speed_level, "a throttle step, 0 to 126", |text| {
            text.parse().ok().and_then(SpeedStep::new)
        })?;
        let since =
            row.read(self.since_command, "seconds since the command, 0 to 2592000 (30 days)", |text| {
                scaled(text, 9)
                    .map(TimeSpan::from_ns)
                    .filter(|since| (TimeSpan::ZERO..=LONGEST_RUN).contains(since))
            })?;
        let time = Timestamp::ZERO + since;
        runs.check_not_ended(row, Some(self.run), id)?;
        let begins = runs.open(id).is_none();
        let ticks = self.ticks(row, since, begins)?;
        if begins {
            if row.text(self.event) != "speed" {
                return Err(row.wrong(self.event, "`speed`: a run of this form begins with its command"));
            }
            if since != TimeSpan::ZERO {
                return Err(row.wrong(self.since_command, "0: the command is where its run counts from"));
            }
            if let (Some(before), Some(now)) = (self.last_ticks, ticks)
                && now < before
            {
                runs.note(Note { line: row.line(), oddity: Oddity::TimerRestarted(id) });
            }
            let standing = TrainAtStart { train: self.train, step: SpeedStep::STAND };
            let run = runs.begin(row, id, vec![standing]);
            run.add(row, self.since_command, time, EventKind::Speed { train: self.train, step })?;
            self.commanded = step;
            self.ticks_at_command = ticks;
        } else {
            let kind = self.later_event(row, runs, id)?;
            if step != self.commanded {
                let expected = format!("{}, the step commanded in this run", self.commanded);
                return Err(row.wrong(self.speed_level, expected));
            }
            if let Some(run) = runs.open(id) {
                run.add(row, self.since_command, time, kind)?;
            }
        }
        self.last_ticks = ticks.or(self.last_ticks);
        Ok(())
    }
}

/// The farthest a tape is taken to reach, chosen: a kilometre of model track.
const LONGEST_TAPE_MM: f64 = 1e6;

/// A length that a person measured, if it is one.
pub(super) fn length_in_mm(text: &str) -> Option<Length> {
    let mm: f64 = text.parse().ok()?;
    (mm.abs() <= LONGEST_TAPE_MM).then(|| Length::from_mm(mm))
}
