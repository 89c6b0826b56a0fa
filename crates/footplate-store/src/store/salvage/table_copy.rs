//! The rows of a table that its tree still leads to, and the number of its last one.

use rusqlite::types::Value;
use rusqlite::{Connection, Statement, Transaction};

use super::index_entries;
use super::strays::Strays;
use super::tables::{Parent, SalvagedTable, accepted, stand_in};
use crate::store::checksum;

/// A table as far as it is copied.
pub(super) struct TableCopy {
    pub(super) table: SalvagedTable,
    /// The highest number that a row is known to have had.
    pub(super) last_known: i64,
    /// Whether trees and indices may be those of other tables.
    is_doubtful: bool,
}

impl TableCopy {
    /// Copies the rows of a table by number, from the first to the last that is found, or to number `most`. Fails only if the
    /// new store does.
    pub(super) fn copy<'a>(
        from: &'a Connection,
        into: &'a Transaction<'a>,
        name: &'static str,
        parent: Option<Parent>,
        most: u64,
        other_homes: Option<&'a Strays<'a>>,
    ) -> rusqlite::Result<Self> {
        let table = SalvagedTable { name, rows: 0, lost: 0, is_end_known: false, stand_ins: 0 };
        let is_doubtful = other_homes.is_some();
        let nothing = Self { table: table.clone(), last_known: 0, is_doubtful };
        // An older store has fewer columns, and names in a damaged one may be wrong.
        let known = columns_of(into, name);
        let columns: Vec<String> =
            columns_of(from, name).into_iter().filter(|column| known.contains(column)).collect();
        if columns.first().is_none_or(|first| first != "id") {
            return Ok(Self {
                table: SalvagedTable { is_end_known: is_absent(from, name), ..table },
                ..nothing
            });
        }
        let (names, places) = (columns.join(", "), vec!["?"; columns.len()].join(", "));
        let select = format!("SELECT {names} FROM {name} NOT INDEXED WHERE id >= ?1 ORDER BY id");
        let Ok(select) = from.prepare(&select) else { return Ok(nothing) };
        let insert = format!("INSERT INTO {name} ({names}) VALUES ({places})");
        let Ok(insert) = into.prepare(&insert) else { return Ok(nothing) };
        let parent = parent.and_then(|parent| {
            let column = columns.iter().position(|column| column == parent.column)?;
            Some((parent, column))
        });
        let newest =
            from.query_row(&format!("SELECT max(id) FROM {name}"), [], |row| row.get::<_, Option<i64>>(0));
        let last = match &newest {
            Ok(newest) => newest.unwrap_or(0),
            Err(_) => i64::try_from(most).unwrap_or(i64::MAX),
        };

        let is_end_known = newest.is_ok() && other_homes.is_none();
        let table = SalvagedTable { is_end_known, ..table };
        let mut tree = TreeReader { select, columns, insert, into, parent, other_homes, table };
        let mut next = 1;
        let mut last_known = newest.ok().flatten().unwrap_or(0);
        while next <= last {
            let stretch = tree.copy_from(next)?;
            last_known = last_known.max(stretch.last_read.unwrap_or(0));
            if stretch.ended {
                break;
            }
            // The next row cannot be read: continue behind it, or behind all of its page.
            next = match stretch.last_read {
                Some(read) => read.saturating_add(1),
                None => tree.readable_after(next, last),
            };
        }
        if other_homes.is_some() {
            // The tree may be that of another table.
            let own = format!("SELECT ifnull(max(id), 0) FROM {name}");
            last_known = into.query_row(&own, [], |row| row.get(0))?;
        }
        Ok(Self { table: tree.table, last_known, is_doubtful })
    }

    /// Counts the lost rows, and those among them whose numbers only the indices of the damaged file still have.
    pub(super) fn count_in_indices(&mut self, from: &Connection, into: &Connection) -> rusqlite::Result<()> {
        let entries = index_entries::of_table(from, into, self.table.name, self.is_doubtful)?;
        self.last_known = self.last_known.max(entries.last);
        self.table.is_end_known |= entries.is_complete;
        let last = u64::try_from(self.last_known).unwrap_or(0);
        self.table.lost = last.saturating_sub(self.table.rows);
        Ok(())
    }
}

/// Whether a store is of an older version and does not have this table.
fn is_absent(from: &Connection, table: &str) -> bool {
    let listed = "SELECT count(*) FROM sqlite_schema WHERE name = ?1 OR tbl_name = ?1";
    from.query_row(listed, [table], |row| row.get::<_, i64>(0)).is_ok_and(|listed| listed == 0)
}

/// The columns of a table whose names can be read.
pub(super) fn columns_of(connection: &Connection, table: &str) -> Vec<String> {
    let names = |connection: &Connection| {
        connection
            .prepare("SELECT name FROM pragma_table_info(?1)")?
            .query_map([table], |row| row.get(0))?
            .collect::<rusqlite::Result<Vec<String>>>()
    };
    names(connection).unwrap_or_default()
}

/// Reads a table of the damaged file by its tree.
struct TreeReader<'a> {
    /// Reads the rows from a number on, in order.
    select: Statement<'a>,
    columns: Vec<String>,
    insert: Statement<'a>,
    into: &'a Transaction<'a>,
    /// The parent of its rows, and the column that refers to it.
    parent: Option<(Parent, usize)>,
    /// What tells whether a row belongs to another table, if the tree may.
    other_homes: Option<&'a Strays<'a>>,
    table: SalvagedTable,
}

/// How far rows were read.
struct Stretch {
    last_read: Option<i64>,
    /// Whether that was the last row of the table.
    ended: bool,
}

impl TreeReader<'_> {
    /// The first number after an unreadable one at which reading goes on, or the one after `last`: ever further ahead, then
    /// by halves. A page of readable rows between two damaged ones can be passed over; its rows are found as strays.
    fn readable_after(&mut self, unreadable: i64, last: i64) -> i64 {
        let (mut bad, mut step) = (unreadable, 1_i64);
        let mut good = loop {
            let probe = bad.saturating_add(step);
            if probe > last {
                return last.saturating_add(1);
            }
            if self.reads_at(probe) {
                break probe;
            }
            (bad, step) = (probe, step.saturating_mul(2));
        };
        while good - bad > 1 {
            let middle = bad + (good - bad) / 2;
            if self.reads_at(middle) { good = middle } else { bad = middle }
        }
        good
    }

    /// Whether a row from a number on can be read, or the end of the table.
    fn reads_at(&mut self, number: i64) -> bool {
        self.select.query([number]).is_ok_and(|mut rows| rows.next().is_ok())
    }

    /// Copies rows from number `first` on, until one cannot be read.
    fn copy_from(&mut self, first: i64) -> rusqlite::Result<Stretch> {
        let mut stretch = Stretch { last_read: None, ended: false };
        let Ok(mut rows) = self.select.query([first]) else { return Ok(stretch) };
        loop {
            let row = match rows.next() {
                Ok(Some(row)) => row,
                Ok(None) => {
                    stretch.ended = true;
                    return Ok(stretch);
                }
                Err(_) => return Ok(stretch),
            };
            let values: rusqlite::Result<Vec<Value>> =
                (0..self.columns.len()).map(|column| row.get(column)).collect();
            let Ok(values) = values else { return Ok(stretch) };
            let Some(Value::Integer(id)) = values.first() else { return Ok(stretch) };
            // Rows are in the order of their ids; damaged pages may lead round in a circle for ever.
            if stretch.last_read.is_some_and(|last| *id <= last) {
                return Ok(stretch);
            }
            stretch.last_read = Some(*id);
            // A row that was changed refers to a parent that perhaps never was.
            if checksum::matches(self.table.name, &self.columns, &values) == Some(false) {
                continue;
            }
            if let Some(strays) = self.other_homes
                && !strays.is_only_home(self.table.name, *id, &values)?
            {
                continue;
            }
            if let Some((parent, column)) = self.parent
                && let Some(Value::Integer(key)) = values.get(column)
            {
                self.table.stand_ins += u64::from(stand_in(self.into, parent, *key)?);
            }
            self.table.rows += u64::from(accepted(&mut self.insert, &values)?);
        }
    }
}
