//! The runs of a log as its rows come in: which run a row belongs to, and that no time runs backwards.

use std::collections::BTreeSet;

use footplate_core::{Event, EventKind, RunId, SensorId, TimeSpan, Timestamp, TrainId};

use crate::recording::{GatePass, Note, Oddity, RawEvent, Run, TrainAtStart};
use crate::table::{Column, Row, TableError};

/// The longest run that is accepted, chosen: a month, beyond any session, and far from any epoch.
pub(super) const LONGEST_RUN: TimeSpan = TimeSpan::from_ms(30 * 24 * 3_600_000);

/// Times from here on count from the Unix epoch (this is September 2001); earlier ones from the beginning of
/// their run.
pub(super) const UNIX_TIMES_FROM: Timestamp = Timestamp::from_ns(1_000_000_000 * 1_000_000_000);

/// The runs read so far. The last one is still open.
#[derive(Default)]
pub(super) struct Runs {
    runs: Vec<Run>,
    /// The line with which each run began, in the same order.
    began: Vec<u64>,
    seen: BTreeSet<RunId>,
    notes: Vec<Note>,
}

impl Runs {
    /// The run that is open, if it is run `id`.
    pub(super) fn open(&mut self, id: RunId) -> Option<&mut Run> {
        self.runs.last_mut().filter(|run| run.id == id)
    }

    /// The run that was begun last.
    pub(super) fn last(&self) -> Option<&Run> {
        self.runs.last()
    }

    /// Fails if run `id` has ended; `column` is where the row names it.
    pub(super) fn check_not_ended(
        &self,
        row: Row<'_>,
        column: Option<Column>,
        id: RunId,
    ) -> Result<(), TableError> {
        let open = self.runs.last().is_some_and(|run| run.id == id);
        match column {
            Some(column) if !open && self.seen.contains(&id) => {
                Err(row.wrong(column, "a new run: the rows of a run stand together, and this one has ended"))
            }
            _ => Ok(()),
        }
    }

    /// Opens a run, which ends the one before.
    pub(super) fn begin(&mut self, row: Row<'_>, id: RunId, trains: Vec<TrainAtStart>) -> &mut Run {
        self.seen.insert(id);
        self.began.push(row.line());
        self.runs.push(Run { id, began_at: None, trains, events: Vec::new(), gates: Vec::new() });
        let last = self.runs.len() - 1;
        &mut self.runs[last]
    }

    /// Notes something odd.
    pub(super) fn note(&mut self, note: Note) {
        self.notes.push(note);
    }

    /// Ends the last run and hands everything over.
    pub(super) fn finish(mut self) -> (Vec<Run>, Vec<Note>) {
        // A last line that turned out to be cut off may have opened a run and left nothing in it.
        self.runs.pop_if(|run| run.events.is_empty() && run.trains.is_empty() && run.gates.is_empty());
        for (run, line) in self.runs.iter().zip(&self.began) {
            if run.reports().next().is_none() {
                self.notes.push(Note { line: *line, oddity: Oddity::NoReports(run.id) });
            }
        }
        self.notes.sort_by_key(|note| note.line);
        (self.runs, self.notes)
    }
}

impl Run {
    /// Adds an event; its time stands in `column` and must not come before the last one's.
    pub(super) fn add(
        &mut self,
        row: Row<'_>,
        column: Column,
        time: Timestamp,
        kind: EventKind,
    ) -> Result<(), TableError> {
        if (time - Timestamp::ZERO).abs() > LONGEST_RUN {
            return Err(row.wrong(column, "within 30 days of the beginning of its run"));
        }
        if let Some(last) = self.events.last()
            && time < last.event.time
        {
            return Err(row.wrong(column, not_before("run", last.line)));
        }
        self.events.push(RawEvent { line: row.line(), event: Event { time, kind } });
        Ok(())
    }

    /// Adds the pass of a light gate, on the clock of the gates.
    pub(super) fn add_gate(
        &mut self,
        row: Row<'_>,
        column: Column,
        gate: u8,
        time: Timestamp,
    ) -> Result<(), TableError> {
        if let Some(last) = self.gates.last()
            && time < last.time
        {
            return Err(row.wrong(column, not_before("run, on the clock of the gates", last.line)));
        }
        self.gates.push(GatePass { line: row.line(), gate, time });
        Ok(())
    }

    /// Whether `train` takes part.
    pub(super) fn knows(&self, train: TrainId) -> bool {
        self.trains.iter().any(|known| known.train == train)
    }

    /// The sensor reported last.
    pub(super) fn last_sensor(&self) -> Option<SensorId> {
        self.events.iter().rev().find_map(|raw| match raw.event.kind {
            EventKind::Sensor(report) => Some(report.sensor),
            _ => None,
        })
    }
}

fn not_before(clock: &str, line: u64) -> String {
    format!(
        "no earlier than the time in line {line}: time does not run backwards within a {clock}; where the clock \
         restarts, a new run begins"
    )
}

/// The number of a gate: `L0`, `L1` and so on.
pub(super) fn gate_named(name: &str) -> Option<u8> {
    let digits = name.strip_prefix('L')?;
    digits.bytes().all(|digit| digit.is_ascii_digit()).then(|| digits.parse().ok())?
}
