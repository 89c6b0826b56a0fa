//! The tables of a store, and what a row of theirs needs to be accepted.

use rusqlite::types::Value;
use rusqlite::{Statement, Transaction, params_from_iter};

/// The rows of one table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SalvagedTable {
    /// The table.
    pub name: &'static str,
    /// Rows that were read and are valid.
    pub rows: u64,
    /// Rows that are known to be lost, by the gaps in the numbers and by those in indices.
    pub lost: u64,
    /// Whether the number of the last row is known. If not, more rows may be lost than are counted.
    pub is_end_known: bool,
    /// Lost rows of other tables that got a placeholder, because rows of this one refer to them.
    pub stand_ins: u64,
}

/// The tables with their parents, parents first. States of replays are not copied: they follow from the rest.
pub(super) const TABLES: [(&str, Option<Parent>); 14] = [
    ("recordings", None),
    ("runs", Some(Parent { column: "recording", table: "recordings", stand_in: STAND_IN_RECORDING })),
    ("starts", Some(Parent { column: "run", table: "runs", stand_in: STAND_IN_RUN })),
    ("events", Some(Parent { column: "run", table: "runs", stand_in: STAND_IN_RUN })),
    ("gate_passes", Some(Parent { column: "run", table: "runs", stand_in: STAND_IN_RUN })),
    // A mark is useless without its event.
    ("marks", None),
    ("calibrations", None),
    ("profiles", None),
    ("schedules", None),
    ("directions", None),
    ("machines", Some(Parent { column: "recording", table: "recordings", stand_in: STAND_IN_RECORDING })),
    // Without the initial state no decision can be replayed.
    ("inputs", None),
    ("decisions", None),
    ("archives", None),
];

/// The parent of a row.
#[derive(Clone, Copy)]
pub(super) struct Parent {
    pub(super) column: &'static str,
    pub(super) table: &'static str,
    /// Inserts the row `?1` of the parent table.
    pub(super) stand_in: &'static str,
}

/// The tables whose numbers begin again when their rows have moved into archives. A row is known by its machine and its place there.
pub(super) const RENUMBERED: [&str; 2] = ["inputs", "decisions"];

const STAND_IN_RECORDING: &str = "INSERT INTO recordings (id, name, form, layout, stored_at_ns) \
     VALUES (?1, 'lost recording', 'salvaged', 'unknown', 0)";
/// All lost runs get one recording, under their numbers in the store.
const STAND_IN_RUN: &str = "INSERT INTO runs (id, recording, number) \
     SELECT ?1, id, ?1 FROM recordings WHERE form = 'salvaged runs'";
/// The number of that recording, above all numbers that were read.
const RECORDING_OF_LOST_RUNS: &str = "INSERT INTO recordings (name, form, layout, stored_at_ns) \
     SELECT 'lost runs', 'salvaged runs', 'unknown', 0 \
     WHERE NOT EXISTS (SELECT 1 FROM recordings WHERE form = 'salvaged runs')";

/// Inserts a row if it is valid.
pub(super) fn accepted(insert: &mut Statement<'_>, values: &[Value]) -> rusqlite::Result<bool> {
    match insert.execute(params_from_iter(values)) {
        Ok(_) => Ok(true),
        Err(error) if error.sqlite_error_code() == Some(rusqlite::ErrorCode::ConstraintViolation) => {
            Ok(false)
        }
        Err(error) => Err(error),
    }
}

/// Inserts the row `key` of the parent table if it is lost. Returns whether it did.
pub(super) fn stand_in(into: &Transaction<'_>, parent: Parent, key: i64) -> rusqlite::Result<bool> {
    let there = format!("SELECT 1 FROM {} WHERE id = ?1", parent.table);
    if into.prepare_cached(&there)?.exists([key])? {
        return Ok(false);
    }
    if parent.table == "runs" {
        into.execute(RECORDING_OF_LOST_RUNS, [])?;
    }
    // An impossible number is a damaged row, which its own insertion refuses.
    Ok(into.execute(parent.stand_in, [key]).is_ok())
}
