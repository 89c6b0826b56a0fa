//! Rows in pages that no tree leads to: whose they are, and back into their tables.

use rusqlite::types::Value;
use rusqlite::{Connection, Transaction, params_from_iter};

use super::leaf_pages::{FoundRow, Pages};
use super::table_copy::{TableCopy, columns_of};
use super::tables::{Parent, RENUMBERED, TABLES, accepted, stand_in};
use crate::store::checksum;
use crate::store::file::Store;

/// The type of columns with real numbers.
const REAL: &str = "REAL";

/// All rows of a file by its pages, and an empty store to try them in.
pub(super) struct Strays<'a> {
    /// Of the file, and of the file with its log if they differ.
    images: Vec<Pages<'a>>,
    /// Has the tables of a store, no rows, and checks no parents.
    trial: Connection,
    /// The columns of each of `TABLES`.
    columns: Vec<Vec<String>>,
    /// Their types, in the same order.
    types: Vec<Vec<String>>,
}

impl<'a> Strays<'a> {
    pub(super) fn new(images: Vec<Pages<'a>>) -> rusqlite::Result<Self> {
        let trial = Connection::open_in_memory()?;
        for migration in Store::migrations() {
            trial.execute_batch(migration)?;
        }
        trial.pragma_update(None, "foreign_keys", false)?;
        let columns = TABLES.iter().map(|(name, _)| columns_of(&trial, name)).collect();
        let types = TABLES.iter().map(|(name, _)| types_of(&trial, name)).collect::<Result<_, _>>()?;
        Ok(Self { images, trial, columns, types })
    }

    /// Inserts those that can only be rows of this table and are not in it yet. Counts again what is lost.
    pub(super) fn bring_home(
        &self,
        into: &Transaction<'_>,
        copy: &mut TableCopy,
        parent: Option<Parent>,
    ) -> rusqlite::Result<()> {
        let TableCopy { table, last_known, .. } = copy;
        let Some(at) = at_of(table.name) else { return Ok(()) };
        for leaf in self.images.iter().flat_map(|pages| pages.leaves()) {
            for row in self.homeless(into, at, &leaf)? {
                let columns = self.columns_for(at, row);
                let values = self.values_for(at, row);
                if let Some(parent) = parent
                    && let Some(place) = columns.iter().position(|column| column == parent.column)
                    && let Some(Value::Integer(key)) = values.get(place)
                {
                    table.stand_ins += u64::from(stand_in(into, parent, *key)?);
                }
                let mut insert = into.prepare_cached(&insertion(table.name, columns))?;
                if accepted(&mut insert, &values)? {
                    table.rows += 1;
                    *last_known = row.id.max(*last_known);
                } else if RENUMBERED.contains(&table.name) {
                    let unnumbered: Vec<Value> =
                        std::iter::once(Value::Null).chain(values.into_iter().skip(1)).collect();
                    table.rows += u64::from(accepted(&mut insert, &unnumbered)?);
                }
            }
        }
        Ok(())
    }

    /// The rows of a leaf that belong to this table and are not in it yet. A row that several tables would take, as a run of number
    /// 0 or 1 and a direction are, belongs to the table that alone takes all rows of its leaf.
    fn homeless<'r>(
        &self,
        into: &Transaction<'_>,
        at: usize,
        leaf: &'r [FoundRow],
    ) -> rusqlite::Result<Vec<&'r FoundRow>> {
        let mut homeless = Vec::new();
        let mut of_leaf = None;
        for row in leaf.iter().filter(|row| could_be_ours(row)) {
            if let Some(home) = self.home_by_checksum(row) {
                if home == at && !self.is_there(into, at, row)? {
                    homeless.push(row);
                }
                continue;
            }
            if !self.fits(at, row)? || self.is_there(into, at, row)? {
                continue;
            }
            if self.candidates(row)? != [at] {
                let home = match of_leaf {
                    Some(home) => home,
                    None => *of_leaf.insert(self.home_of(into, leaf)?),
                };
                if home != Some(at) {
                    continue;
                }
            }
            homeless.push(row);
        }
        Ok(homeless)
    }

    /// The only table that takes all rows of a leaf together; `None` if there are several, or none.
    fn home_of(&self, into: &Transaction<'_>, leaf: &[FoundRow]) -> rusqlite::Result<Option<usize>> {
        let mut homes = Vec::new();
        for at in 0..TABLES.len() {
            if self.takes_all(into, at, leaf)? {
                homes.push(at);
            }
        }
        Ok(match homes[..] {
            [home] => Some(home),
            _ => None,
        })
    }

    /// Whether a table would take all rows of a leaf, and has no other rows of their numbers.
    fn takes_all(&self, into: &Transaction<'_>, at: usize, leaf: &[FoundRow]) -> rusqlite::Result<bool> {
        self.trial.execute_batch("SAVEPOINT leaf")?;
        let all = || -> rusqlite::Result<bool> {
            for row in leaf {
                if !self.takes(at, row)? || self.is_taken(into, at, row)? {
                    return Ok(false);
                }
            }
            Ok(true)
        };
        let takes_all = all();
        self.trial.execute_batch("ROLLBACK TO leaf; RELEASE leaf")?;
        takes_all
    }

    /// Rows that could belong to several tables and are in none of them now.
    pub(super) fn ambiguous(&self, into: &Transaction<'_>) -> rusqlite::Result<u64> {
        let mut count = 0;
        for row in self.images.iter().flat_map(|pages| pages.rows()).filter(could_be_ours) {
            if self.home_by_checksum(&row).is_some() {
                continue;
            }
            let mut is_in_one = false;
            for at in 0..TABLES.len() {
                let columns = self.columns_for(at, &row);
                is_in_one |= columns.len() == row.values.len() && self.is_there(into, at, &row)?;
            }
            if !is_in_one {
                count += u64::from(self.candidates(&row)?.len() > 1);
            }
        }
        Ok(count)
    }

    /// Whether a row that a tree leads to belongs to no other table: by its checksum, or because no other would take it.
    pub(super) fn is_only_home(&self, table: &str, id: i64, values: &[Value]) -> rusqlite::Result<bool> {
        let values = std::iter::once(Value::Null).chain(values.iter().skip(1).cloned()).collect();
        let candidates = self.candidates(&FoundRow { id, values })?;
        Ok(at_of(table).is_some_and(|at| candidates == [at]))
    }

    /// The tables that would take a row.
    fn candidates(&self, row: &FoundRow) -> rusqlite::Result<Vec<usize>> {
        let mut takes = Vec::new();
        for at in 0..TABLES.len() {
            if self.fits(at, row)? {
                takes.push(at);
            }
        }
        Ok(takes)
    }

    /// Whether a table would take a row by itself.
    fn fits(&self, at: usize, row: &FoundRow) -> rusqlite::Result<bool> {
        self.trial.execute_batch("SAVEPOINT trial")?;
        let fits = self.takes(at, row);
        self.trial.execute_batch("ROLLBACK TO trial; RELEASE trial")?;
        fits
    }

    /// Inserts a row into a table of the trial, beside those that are there. Returns whether it was taken.
    fn takes(&self, at: usize, row: &FoundRow) -> rusqlite::Result<bool> {
        let (Some((name, _)), columns) = (TABLES.get(at), self.columns_for(at, row)) else {
            return Ok(false);
        };
        let values = self.values_for(at, row);
        if columns.len() != row.values.len() || checksum::matches(name, columns, &values) == Some(false) {
            return Ok(false);
        }
        if self.home_by_checksum(row).is_some_and(|home| home != at) {
            return Ok(false);
        }
        // SQLite would take a number as text, but a row that it wrote into a text column has text there.
        if !self.types_of(at).iter().zip(&values).all(|(kind, value)| is_of(kind, value)) {
            return Ok(false);
        }
        accepted(&mut *self.trial.prepare_cached(&insertion(name, columns))?, &values)
    }

    /// The table whose name is in the checksum of a row; `None` if it has none that holds.
    fn home_by_checksum(&self, row: &FoundRow) -> Option<usize> {
        TABLES.iter().enumerate().find_map(|(at, (name, _))| {
            let columns = self.columns_for(at, row);
            let is_home = checksum::matches(name, columns, &self.values_for(at, row)) == Some(true);
            is_home.then_some(at)
        })
    }

    /// The columns of a table that a row has; an older store has fewer.
    fn columns_for(&self, at: usize, row: &FoundRow) -> &[String] {
        let columns = self.columns.get(at).map(Vec::as_slice).unwrap_or_default();
        columns.get(..row.values.len()).unwrap_or_default()
    }

    /// The values of a row as a table has them: SQLite writes a whole number into a column of real ones as an integer.
    fn values_for(&self, at: usize, row: &FoundRow) -> Vec<Value> {
        let mut values = values_of(row);
        for (kind, value) in self.types_of(at).iter().zip(&mut values) {
            if let Value::Integer(number) = *value
                && kind == REAL
            {
                *value = Value::Real(number as f64);
            }
        }
        values
    }

    fn types_of(&self, at: usize) -> &[String] {
        self.types.get(at).map(Vec::as_slice).unwrap_or_default()
    }

    /// Whether a table has another row of this number.
    fn is_taken(&self, into: &Transaction<'_>, at: usize, row: &FoundRow) -> rusqlite::Result<bool> {
        let Some((table, _)) = TABLES.get(at) else { return Ok(false) };
        let of_number = format!("SELECT 1 FROM {table} WHERE id = ?1{}", but_stand_ins(table));
        Ok(into.prepare_cached(&of_number)?.exists([row.id])? && !self.is_there(into, at, row)?)
    }

    /// Whether a table has exactly this row.
    fn is_there(&self, into: &Transaction<'_>, at: usize, row: &FoundRow) -> rusqlite::Result<bool> {
        let Some((table, _)) = TABLES.get(at) else { return Ok(false) };
        let same: Vec<String> =
            self.columns_for(at, row).iter().map(|column| format!("{column} IS ?")).collect();
        let same = format!("SELECT 1 FROM {table} WHERE {}", same.join(" AND "));
        into.prepare_cached(&same)?.exists(params_from_iter(self.values_for(at, row)))
    }
}

/// The place of a table among all.
fn at_of(table: &str) -> Option<usize> {
    TABLES.iter().position(|(name, _)| *name == table)
}

/// The condition that a row of a table is no placeholder for one that is lost.
fn but_stand_ins(table: &str) -> &'static str {
    match table {
        "recordings" => " AND form NOT IN ('salvaged', 'salvaged runs')",
        "runs" => " AND recording NOT IN (SELECT id FROM recordings WHERE form = 'salvaged runs')",
        _ => "",
    }
}

/// In every table of ours the first column is the row's number, which SQLite writes as null.
fn could_be_ours(row: &FoundRow) -> bool {
    row.values.first() == Some(&Value::Null) && row.id > 0
}

fn values_of(row: &FoundRow) -> Vec<Value> {
    std::iter::once(Value::Integer(row.id)).chain(row.values.iter().skip(1).cloned()).collect()
}

fn insertion(table: &str, columns: &[String]) -> String {
    let places = vec!["?"; columns.len()].join(", ");
    format!("INSERT INTO {table} ({}) VALUES ({places})", columns.join(", "))
}

/// The types of the columns of a table.
fn types_of(connection: &Connection, table: &str) -> rusqlite::Result<Vec<String>> {
    let mut types = connection.prepare("SELECT type FROM pragma_table_info(?1)")?;
    types.query_map([table], |row| row.get(0))?.collect()
}

/// Whether a column of this type keeps such a value as it is.
fn is_of(kind: &str, value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Integer(_) => kind == "INTEGER",
        Value::Real(_) => kind == REAL,
        Value::Text(_) => kind == "TEXT",
        Value::Blob(_) => kind == "BLOB",
    }
}
