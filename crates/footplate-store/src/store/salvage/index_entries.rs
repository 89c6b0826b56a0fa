//! The numbers of rows in the indices of a damaged table, which tell how many rows it had.

use std::collections::BTreeMap;

use rusqlite::types::Value;
use rusqlite::{Connection, OptionalExtension, params_from_iter};

/// What the indices of a table say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct IndexEntries {
    /// The highest number of a row; 0 if there is none.
    pub(super) last: i64,
    /// Whether one index was read from its beginning to its end, so that no row had a higher number.
    pub(super) is_complete: bool,
}

/// The entries of the indices of a table of `from`. An index that contradicts a row that was copied `into` the new store does not
/// count; if it is doubtful whose it is, neither does one that agrees with none. Fails only if the new store does.
pub(super) fn of_table(
    from: &Connection,
    into: &Connection,
    table: &str,
    is_doubtful: bool,
) -> rusqlite::Result<IndexEntries> {
    let mut all = IndexEntries::default();
    for (index, columns) in indices_of(into, table)? {
        let (entries, agreeing) = of_index(from, into, table, &index, &columns)?;
        if !is_doubtful || agreeing > 0 {
            all.last = all.last.max(entries.last);
            all.is_complete |= entries.is_complete;
        }
    }
    Ok(all)
}

/// The indices of a table with their columns.
fn indices_of(connection: &Connection, table: &str) -> rusqlite::Result<BTreeMap<String, Vec<String>>> {
    let sql = "SELECT list.name, info.name FROM pragma_index_list(?1) AS list, pragma_index_info(list.name) AS info \
               WHERE info.name <> 'id' ORDER BY list.name, info.seqno";
    let mut statement = connection.prepare(sql)?;
    let mut rows = statement.query([table])?;
    let mut indices = BTreeMap::<String, Vec<String>>::new();
    while let Some(row) = rows.next()? {
        indices.entry(row.get(0)?).or_default().push(row.get(1)?);
    }
    Ok(indices)
}

/// The entries of an index up to the first that cannot be read, and how many of them agree with a row of the new store; none if one
/// contradicts such a row.
fn of_index(
    from: &Connection,
    into: &Connection,
    table: &str,
    index: &str,
    columns: &[String],
) -> rusqlite::Result<(IndexEntries, u64)> {
    let mut entries = IndexEntries::default();
    let mut agreeing = 0;
    // All these columns are in the index, so that no page of the table is read.
    let select = format!("SELECT id, {} FROM {table} INDEXED BY {index}", columns.join(", "));
    let Ok(mut select) = from.prepare(&select) else { return Ok((entries, 0)) };
    let same: Vec<String> = columns.iter().map(|column| format!("{column} IS ?")).collect();
    let mut same =
        into.prepare_cached(&format!("SELECT {} FROM {table} WHERE id = ?", same.join(" AND ")))?;
    let Ok(mut rows) = select.query([]) else { return Ok((entries, 0)) };
    loop {
        let Ok(row) = rows.next() else { return Ok((entries, agreeing)) };
        let Some(row) = row else {
            entries.is_complete = true;
            return Ok((entries, agreeing));
        };
        let id: rusqlite::Result<i64> = row.get(0);
        let values = (1..=columns.len()).chain([0]).map(|at| row.get::<_, Value>(at));
        let (Ok(id), Ok(values)) = (id, values.collect::<rusqlite::Result<Vec<Value>>>()) else {
            return Ok((IndexEntries::default(), 0));
        };
        let is_same = same.query_row(params_from_iter(values), |row| row.get(0)).optional()?;
        if id <= 0 || is_same == Some(false) {
            return Ok((IndexEntries::default(), 0));
        }
        agreeing += u64::from(is_same == Some(true));
        entries.last = entries.last.max(id);
    }
}
