//! Events as rows: writes and reads the columns of an event.

use footplate_core::{
    Event, EventKind, Length, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};
use rusqlite::types::Type;
use rusqlite::{Error, Row, Statement, ToSql};

use super::checksum;
use super::keys::RunKey;
use crate::recording::RawEvent;

/// The step of a sensor's row that reports a block free. The schema knows no kind of its own for it, and older programs
/// ignore the number of a detector.
const FREE: u8 = 0;

/// The columns that [`read`] expects, in its order.
pub(super) const COLUMNS: &str =
    "line, time_ns, kind, sensor, poll_interval_ns, train, step, turnout, curved, offset_m";

/// Appends an event. The columns are in the order of the table, which the checksum needs.
pub(super) const INSERT: &str = "INSERT INTO events (run, line, stored_at_ns, time_ns, kind, sensor, \
     poll_interval_ns, train, step, turnout, curved, offset_m, crc32) \
     VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13)";

/// Executes [`INSERT`] for an event. `line` is its line in the imported file.
pub(super) fn insert(
    statement: &mut Statement<'_>,
    run: RunKey,
    line: Option<u64>,
    stored_at: Timestamp,
    event: Event,
) -> rusqlite::Result<()> {
    let mut columns = Columns::default();
    let kind = match event.kind {
        EventKind::Sensor(report) | EventKind::Freed(report) => {
            columns.sensor = Some(report.sensor.0);
            columns.poll_interval_ns = report.poll_interval.map(TimeSpan::as_ns);
            columns.step = matches!(event.kind, EventKind::Freed(_)).then_some(FREE);
            "sensor"
        }
        EventKind::Speed { train, step } => {
            columns.train = Some(train.0);
            columns.step = Some(step.get());
            "speed"
        }
        EventKind::Reverse { train } => {
            columns.train = Some(train.0);
            "reverse"
        }
        EventKind::Turnout { turnout, curved } => {
            columns.turnout = Some(turnout.0);
            columns.curved = Some(curved);
            "turnout"
        }
        EventKind::Stopped { train, landmark, offset } => {
            columns.train = Some(train.0);
            columns.sensor = Some(landmark.0);
            columns.offset_m = Some(offset.as_m());
            "stopped"
        }
    };
    let values: [&dyn ToSql; 12] = [
        &run.0,
        &line.and_then(|line| i64::try_from(line).ok()),
        &stored_at.as_ns(),
        &event.time.as_ns(),
        &kind,
        &columns.sensor,
        &columns.poll_interval_ns,
        &columns.train,
        &columns.step,
        &columns.turnout,
        &columns.curved,
        &columns.offset_m,
    ];
    checksum::insert(statement, "events", &values)
}

/// Columns that only some kinds of event have.
#[derive(Default)]
struct Columns {
    sensor: Option<u16>,
    poll_interval_ns: Option<i64>,
    train: Option<u16>,
    step: Option<u8>,
    turnout: Option<u16>,
    curved: Option<bool>,
    offset_m: Option<f64>,
}

/// Reads an event whose [`COLUMNS`] begin at column `first`.
pub(super) fn read(row: &Row<'_>, first: usize) -> rusqlite::Result<RawEvent> {
    let kind: String = row.get(first + 2)?;
    let sensor = || row.get(first + 3).map(SensorId);
    let train = || row.get(first + 5).map(TrainId);
    let kind = match kind.as_str() {
        "sensor" => {
            let poll_interval: Option<i64> = row.get(first + 4)?;
            let report = Report { sensor: sensor()?, poll_interval: poll_interval.map(TimeSpan::from_ns) };
            let state: Option<u8> = row.get(first + 6)?;
            if state == Some(FREE) { EventKind::Freed(report) } else { EventKind::Sensor(report) }
        }
        "speed" => EventKind::Speed { train: train()?, step: step(row, first + 6)? },
        "reverse" => EventKind::Reverse { train: train()? },
        "turnout" => {
            EventKind::Turnout { turnout: TurnoutId(row.get(first + 7)?), curved: row.get(first + 8)? }
        }
        "stopped" => EventKind::Stopped {
            train: train()?,
            landmark: sensor()?,
            offset: Length::from_m(row.get(first + 9)?),
        },
        _ => return Err(unreadable(first + 2, "no kind of event")),
    };
    Ok(RawEvent {
        line: line(row, first)?,
        event: Event { time: Timestamp::from_ns(row.get(first + 1)?), kind },
    })
}

/// Reads a line number; 0 without a file.
pub(super) fn line(row: &Row<'_>, column: usize) -> rusqlite::Result<u64> {
    let line: Option<i64> = row.get(column)?;
    Ok(line.and_then(|line| u64::try_from(line).ok()).unwrap_or(0))
}

/// Reads a throttle step.
pub(super) fn step(row: &Row<'_>, column: usize) -> rusqlite::Result<SpeedStep> {
    SpeedStep::new(row.get(column)?).ok_or_else(|| unreadable(column, "no throttle step"))
}

fn unreadable(column: usize, what: &'static str) -> Error {
    Error::FromSqlConversionFailure(column, Type::Integer, what.into())
}
