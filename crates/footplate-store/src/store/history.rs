//! Reads a store: its state at a date, and the changes between two dates.

use footplate_core::{RunId, SpeedStep, Timestamp, TrainId};
use rusqlite::{Connection, Row};

use super::error::StoreError;
use super::file::Store;
use super::keys::{EventKey, RecordingKey, RunKey};
use super::marks::{Mark, MarkKind};
use super::recordings::LIVE;
use super::row;
use crate::recording::{GatePass, RawEvent, Run, TrainAtStart};

/// A summary of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredRecording {
    /// Its number in the store.
    pub key: RecordingKey,
    /// Its name.
    pub name: String,
    /// The name of its form, or `live`.
    pub form: String,
    /// The layout whose sensors it reports.
    pub layout: String,
    /// When it was imported, or its session began.
    pub stored_at: Timestamp,
    /// The number of its runs.
    pub runs: u64,
    /// The number of its events at the date.
    pub events: u64,
    /// The number of events that were excluded at the date.
    pub excluded: u64,
}

impl StoredRecording {
    /// Whether it is a live session and not an imported file.
    pub fn is_live(&self) -> bool {
        self.form == LIVE
    }
}

/// A run as it was at a date.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredRun {
    /// Its number in the store.
    pub key: RunKey,
    /// Its number in the recording.
    pub id: RunId,
    /// When its clock was zero, since the Unix epoch, if known.
    pub began_at: Option<Timestamp>,
    /// The state of its trains at the beginning.
    pub trains: Vec<TrainAtStart>,
    /// All events, including excluded ones.
    pub events: Vec<StoredEvent>,
    /// Passes of light gates.
    pub gates: Vec<GatePass>,
}

impl StoredRun {
    /// The run without excluded events, for estimators.
    pub fn accepted(&self) -> Run {
        let events = self.events.iter().filter(|stored| !stored.is_excluded());
        Run {
            id: self.id,
            began_at: self.began_at,
            trains: self.trains.clone(),
            events: events.map(|stored| stored.raw).collect(),
            gates: self.gates.clone(),
        }
    }
}

/// An event as it was at a date.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredEvent {
    /// Its number in the store.
    pub key: EventKey,
    /// The event; line 0 if no file was read.
    pub raw: RawEvent,
    /// The newest mark on it.
    pub mark: Option<Mark>,
}

impl StoredEvent {
    /// Whether it is excluded.
    pub fn is_excluded(&self) -> bool {
        self.mark.as_ref().is_some_and(|mark| mark.kind == MarkKind::Excluded)
    }
}

/// A change that may have changed estimates.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Events were added.
    Measured {
        /// When the last of them was added.
        at: Timestamp,
        /// The recording.
        recording: RecordingKey,
        /// Its name.
        name: String,
        /// The number of events.
        events: u64,
    },
    /// An event was excluded or restored.
    Marked(Mark),
    /// A calibration was made.
    Calibrated {
        /// When.
        at: Timestamp,
        /// The train.
        train: TrainId,
        /// The version of the model.
        model_version: String,
    },
}

impl Change {
    /// The time of the change.
    pub const fn at(&self) -> Timestamp {
        match self {
            Self::Measured { at, .. } | Self::Calibrated { at, .. } => *at,
            Self::Marked(mark) => mark.made_at,
        }
    }
}

/// The newest mark on each event at the date `?1`. Of two marks the later row counts, even if the clock was set back
/// between them.
const NEWEST_MARKS: &str = "SELECT event, mark, max(id) FROM marks WHERE made_at_ns <= ?1 GROUP BY event";

impl Store {
    /// The recordings at a date.
    pub fn recordings(&self, as_of: Timestamp) -> Result<Vec<StoredRecording>, StoreError> {
        let sql = format!(
            "SELECT recordings.id, name, form, layout, recordings.stored_at_ns, count(DISTINCT runs.id), \
             count(events.id), count(CASE newest.mark WHEN 'exclude' THEN 1 END) FROM recordings \
             LEFT JOIN runs ON runs.recording = recordings.id \
             LEFT JOIN events ON events.run = runs.id AND events.stored_at_ns <= ?1 \
             LEFT JOIN ({NEWEST_MARKS}) AS newest ON newest.event = events.id \
             WHERE recordings.stored_at_ns <= ?1 GROUP BY recordings.id ORDER BY recordings.id"
        );
        self.rows(&sql, [as_of.as_ns()], |row| {
            Ok(StoredRecording {
                key: RecordingKey(row.get(0)?),
                name: row.get(1)?,
                form: row.get(2)?,
                layout: row.get(3)?,
                stored_at: Timestamp::from_ns(row.get(4)?),
                runs: row.get(5)?,
                events: row.get(6)?,
                excluded: row.get(7)?,
            })
        })
    }

    /// The runs of a recording at a date, in the order of their beginnings.
    pub fn runs(&self, recording: RecordingKey, as_of: Timestamp) -> Result<Vec<StoredRun>, StoreError> {
        let sql = "SELECT runs.id, number, began_at_ns FROM runs JOIN recordings ON recordings.id = recording \
                   WHERE recording = ?1 AND recordings.stored_at_ns <= ?2 ORDER BY runs.id";
        let runs = self.rows(sql, [recording.0, as_of.as_ns()], |row| {
            let began_at: Option<i64> = row.get(2)?;
            Ok((row.get::<_, i64>(0)?, RunId(row.get(1)?), began_at.map(Timestamp::from_ns)))
        })?;
        if runs.is_empty() {
            let known = self.rows("SELECT id FROM recordings WHERE id = ?1", [recording.0], |_| Ok(()))?;
            if known.is_empty() {
                return Err(StoreError::NoRecording(recording));
            }
        }
        runs.into_iter().map(|(key, id, began_at)| self.run(key, id, began_at, as_of)).collect()
    }

    fn run(
        &self,
        key: i64,
        id: RunId,
        began_at: Option<Timestamp>,
        as_of: Timestamp,
    ) -> Result<StoredRun, StoreError> {
        let trains =
            self.rows("SELECT train, step FROM starts WHERE run = ?1 ORDER BY id", [key], |row| {
                Ok(TrainAtStart { train: TrainId(row.get(0)?), step: row::step(row, 1)? })
            })?;
        let sql = format!(
            "SELECT events.id, marks.mark, marks.reason, marks.made_at_ns, {} FROM events LEFT JOIN marks ON \
             marks.id = (SELECT max(id) FROM marks WHERE marks.event = events.id AND made_at_ns <= ?2) \
             WHERE events.run = ?1 AND stored_at_ns <= ?2 ORDER BY events.id",
            row::COLUMNS
        );
        let events = self.rows(&sql, [key, as_of.as_ns()], |row| {
            let event = EventKey(row.get(0)?);
            let mark = row.get::<_, Option<MarkKind>>(1)?;
            let mark = mark.map(|kind| mark_of(row, event, kind, 2)).transpose()?;
            Ok(StoredEvent { key: event, raw: row::read(row, 4)?, mark })
        })?;
        let gates = self.rows(
            "SELECT line, gate, time_ns FROM gate_passes WHERE run = ?1 ORDER BY id",
            [key],
            |row| {
                let time = Timestamp::from_ns(row.get(2)?);
                Ok(GatePass { line: row::line(row, 0)?, gate: row.get(1)?, time })
            },
        )?;
        Ok(StoredRun { key: RunKey(key), id, began_at, trains, events, gates })
    }

    /// The highest step that a train was commanded to, or ran at when a run began, on any layout until a date; 0 if it
    /// never ran.
    pub fn highest_step(&self, train: TrainId, as_of: Timestamp) -> Result<SpeedStep, StoreError> {
        let sql = "SELECT max(step) FROM (SELECT step FROM events WHERE kind = 'speed' AND train = ?1 AND \
                   stored_at_ns <= ?2 UNION ALL SELECT step FROM starts JOIN runs ON runs.id = run JOIN recordings ON \
                   recordings.id = recording WHERE train = ?1 AND stored_at_ns <= ?2)";
        let highest = self.rows(sql, (train.0, as_of.as_ns()), |row| row.get::<_, Option<u8>>(0))?;
        Ok(highest.into_iter().flatten().find_map(SpeedStep::new).unwrap_or_default())
    }

    /// When the newest recording, event or calibration was stored, by the clock of the computer that stored it.
    pub fn newest_stamp(&self) -> Result<Option<Timestamp>, StoreError> {
        let sql = "SELECT max(stamp) FROM (SELECT max(stored_at_ns) AS stamp FROM recordings UNION ALL \
                   SELECT stored_at_ns FROM events WHERE id = (SELECT max(id) FROM events) UNION ALL \
                   SELECT max(made_at_ns) FROM calibrations)";
        let newest = self.rows(sql, [], |row| row.get::<_, Option<i64>>(0))?;
        Ok(newest.into_iter().flatten().map(Timestamp::from_ns).next())
    }

    /// The changes after one date and until another, in order: why estimates of the two differ.
    pub fn changes(&self, after: Timestamp, until: Timestamp) -> Result<Vec<Change>, StoreError> {
        let between = [after.as_ns(), until.as_ns()];
        let measured = "SELECT max(events.stored_at_ns), recordings.id, name, count(*) FROM events \
                        JOIN runs ON runs.id = events.run JOIN recordings ON recordings.id = runs.recording \
                        WHERE events.stored_at_ns > ?1 AND events.stored_at_ns <= ?2 GROUP BY recordings.id";
        let mut changes = self.rows(measured, between, |row| {
            Ok(Change::Measured {
                at: Timestamp::from_ns(row.get(0)?),
                recording: RecordingKey(row.get(1)?),
                name: row.get(2)?,
                events: row.get(3)?,
            })
        })?;
        let marked = "SELECT event, mark, reason, made_at_ns FROM marks \
                      WHERE made_at_ns > ?1 AND made_at_ns <= ?2 ORDER BY id";
        changes.extend(self.rows(marked, between, |row| {
            Ok(Change::Marked(mark_of(row, EventKey(row.get(0)?), row.get(1)?, 2)?))
        })?);
        let calibrated = "SELECT made_at_ns, train, model_version FROM calibrations \
                          WHERE made_at_ns > ?1 AND made_at_ns <= ?2 ORDER BY id";
        changes.extend(self.rows(calibrated, between, |row| {
            let (at, train) = (Timestamp::from_ns(row.get(0)?), TrainId(row.get(1)?));
            Ok(Change::Calibrated { at, train, model_version: row.get(2)? })
        })?);
        changes.sort_by_key(Change::at);
        Ok(changes)
    }

    /// All rows of a query.
    pub(super) fn rows<T>(
        &self,
        sql: &str,
        parameters: impl rusqlite::Params,
        read: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Vec<T>, StoreError> {
        let query = |connection: &Connection| {
            connection.prepare_cached(sql)?.query_map(parameters, read)?.collect::<rusqlite::Result<Vec<T>>>()
        };
        query(&self.connection).map_err(|error| self.error(error))
    }
}

/// A mark whose reason and date are in the columns from `first`.
fn mark_of(row: &Row<'_>, event: EventKey, kind: MarkKind, first: usize) -> rusqlite::Result<Mark> {
    let made_at = Timestamp::from_ns(row.get(first + 1)?);
    Ok(Mark { event, kind, reason: row.get(first)?, made_at })
}
