//! The checksum of a row, which detects damage that turns a value into another possible one.

use crc32fast::Hasher;
use rusqlite::types::{ToSqlOutput, Value, ValueRef};
use rusqlite::{Connection, Statement, ToSql, params_from_iter};

/// The tables whose rows have a checksum: all but `replays`, whose bodies have their own. It is the last column of each; rows of
/// older programs have none there.
pub(super) const TABLES: [&str; 14] = [
    "recordings",
    "runs",
    "starts",
    "events",
    "gate_passes",
    "marks",
    "calibrations",
    "profiles",
    "schedules",
    "directions",
    "machines",
    "inputs",
    "decisions",
    "archives",
];
/// The column of the checksum.
const COLUMN: &str = "crc32";

/// Returns the CRC-32 of a table's name and the values of a row, in the order of the table's columns, without the row's number and the
/// checksum itself. Types and lengths are included, so that no two rows are the same bytes.
pub(super) fn of<'v>(table: &str, values: impl IntoIterator<Item = ValueRef<'v>>) -> u32 {
    let mut hasher = Hasher::new();
    hasher.update(table.as_bytes());
    for value in values {
        match value {
            ValueRef::Null => hasher.update(&[0]),
            ValueRef::Integer(number) => {
                hasher.update(&[1]);
                hasher.update(&number.to_le_bytes());
            }
            ValueRef::Real(number) => {
                hasher.update(&[2]);
                // SQLite keeps whole numbers as integers, which have no negative zero.
                hasher.update(&(number + 0.0).to_le_bytes());
            }
            ValueRef::Text(bytes) | ValueRef::Blob(bytes) => {
                hasher.update(&[3]);
                hasher.update(&(bytes.len() as u64).to_le_bytes());
                hasher.update(bytes);
            }
        }
    }
    hasher.finalize()
}

/// The number of the first row of one of [`TABLES`] whose checksum differs.
pub(super) fn changed_row(connection: &Connection, table: &str) -> rusqlite::Result<Option<i64>> {
    let rows = format!("SELECT * FROM {table} WHERE {COLUMN} IS NOT NULL");
    let mut statement = connection.prepare(&rows)?;
    let last = statement.column_count() - 1;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let values = (1..last).map(|at| row.get_ref(at)).collect::<rusqlite::Result<Vec<_>>>()?;
        if i64::from(of(table, values)) != row.get::<_, i64>(last)? {
            return row.get(0).map(Some);
        }
    }
    Ok(None)
}

/// Appends a row with its checksum. `columns` are all columns of the table but its first and its last, in its order.
pub(super) fn append(
    connection: &Connection,
    table: &str,
    columns: &[&str],
    values: &[&dyn ToSql],
) -> rusqlite::Result<()> {
    let places = vec!["?"; columns.len() + 1].join(", ");
    let sql = format!("INSERT INTO {table} ({}, {COLUMN}) VALUES ({places})", columns.join(", "));
    insert(&mut *connection.prepare_cached(&sql)?, table, values)
}

/// Inserts a row whose checksum is the last parameter of the statement. `values` are those before it, in the order of the table's
/// columns.
pub(super) fn insert(
    statement: &mut Statement<'_>,
    table: &str,
    values: &[&dyn ToSql],
) -> rusqlite::Result<()> {
    let written = values.iter().copied().map(ToSql::to_sql).collect::<rusqlite::Result<Vec<_>>>()?;
    let refs = written.iter().filter_map(|value| match value {
        ToSqlOutput::Borrowed(value) => Some(*value),
        ToSqlOutput::Owned(value) => Some(ValueRef::from(value)),
        _ => None,
    });
    let checksum = of(table, refs);
    let last: &dyn ToSql = &checksum;
    statement.execute(params_from_iter(values.iter().copied().chain([last])))?;
    Ok(())
}

/// Whether a row of a table matches its checksum; `values` begin with its number. `None` if it has none: only whole rows of
/// [`TABLES`] do.
pub(super) fn matches(table: &str, columns: &[String], values: &[Value]) -> Option<bool> {
    match values {
        [_, values @ .., Value::Integer(written)]
            if TABLES.contains(&table) && columns.last().is_some_and(|last| last == COLUMN) =>
        {
            Some(i64::from(of(table, values.iter().map(ValueRef::from))) == *written)
        }
        _ => None,
    }
}
