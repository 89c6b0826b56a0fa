//! Rows in pages that no tree leads to: whose they are, and back into their tables.

use rusqlite::types::Value;
use rusqlite::{Connection, Transaction, params_from_iter};

use super::leaf_pages::{FoundRow, Pages};
use super::{Parent, SalvagedTable, TABLES, accepted, columns_of, stand_in};
use crate::store::checksum;
use crate::store::file::Store;

/// All rows of a file by its pages, and an empty store to try them in.
pub(super) struct Strays<'a> {
    pages: Pages<'a>,
    /// Has the tables of a store, no rows, and checks no parents.
    trial: Connection,
    /// The columns of each of `TABLES`.
    columns: Vec<Vec<String>>,
    /// Which of them are of real numbers.
    reals: Vec<Vec<String>>,
}

impl<'a> Strays<'a> {
    pub(super) fn new(pages: Pages<'a>) -> rusqlite::Result<Self> {
        let trial = Connection::open_in_memory()?;
        for migration in Store::migrations() {
            trial.execute_batch(migration)?;
        }
        trial.pragma_update(None, "foreign_keys", false)?;
        let columns = TABLES.iter().map(|(name, _)| columns_of(&trial, name)).collect();
        let reals = TABLES.iter().map(|(name, _)| reals_of(&trial, name)).collect::<Result<_, _>>()?;
        Ok(Self { pages, trial, columns, reals })
    }

    /// Inserts those that can only be rows of this table and are not in it yet. Counts again what is lost.
    pub(super) fn bring_home(
        &self,
        into: &Transaction<'_>,
        table: &mut SalvagedTable,
        parent: Option<Parent>,
    ) -> rusqlite::Result<()> {
        let Some(at) = TABLES.iter().position(|(name, _)| *name == table.name) else { return Ok(()) };
        let mut last = i64::try_from(table.rows + table.lost).unwrap_or(i64::MAX);
        for row in self.pages.rows().filter(could_be_ours) {
            if !self.fits(at, &row)? || self.is_there(into, at, &row)? {
                continue;
            }
            if self.candidates(&row)? != [at] {
                continue;
            }
            let columns = self.columns_for(at, &row);
            let values = self.values_for(at, &row);
            if let Some(parent) = parent
                && let Some(place) = columns.iter().position(|column| column == parent.column)
                && let Some(Value::Integer(key)) = values.get(place)
            {
                table.stand_ins += u64::from(stand_in(into, parent, *key)?);
            }
            let mut insert = into.prepare_cached(&insertion(table.name, columns))?;
            if accepted(&mut insert, &values)? {
                table.rows += 1;
                last = last.max(row.id);
            }
        }
        table.lost = u64::try_from(last).unwrap_or(0).saturating_sub(table.rows);
        Ok(())
    }

    /// Rows that could belong to several tables and are in none of them now.
    pub(super) fn ambiguous(&self, into: &Transaction<'_>) -> rusqlite::Result<u64> {
        let mut count = 0;
        for row in self.pages.rows().filter(could_be_ours) {
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

    /// Whether a table would take a row.
    fn fits(&self, at: usize, row: &FoundRow) -> rusqlite::Result<bool> {
        let (Some((name, _)), columns) = (TABLES.get(at), self.columns_for(at, row)) else {
            return Ok(false);
        };
        let values = self.values_for(at, row);
        if columns.len() != row.values.len() || !checksum::holds(name, columns, &values) {
            return Ok(false);
        }
        let mut insert = self.trial.prepare_cached(&insertion(name, columns))?;
        self.trial.execute_batch("SAVEPOINT trial")?;
        let fits = accepted(&mut insert, &values);
        self.trial.execute_batch("ROLLBACK TO trial; RELEASE trial")?;
        fits
    }

    /// The columns of a table that a row has; an older store has fewer.
    fn columns_for(&self, at: usize, row: &FoundRow) -> &[String] {
        let columns = self.columns.get(at).map(Vec::as_slice).unwrap_or_default();
        columns.get(..row.values.len()).unwrap_or_default()
    }

    /// The values of a row as a table has them: SQLite writes a whole number into a column of real ones as an integer.
    fn values_for(&self, at: usize, row: &FoundRow) -> Vec<Value> {
        let reals = self.reals.get(at).map(Vec::as_slice).unwrap_or_default();
        let mut values = values_of(row);
        for (column, value) in self.columns_for(at, row).iter().zip(&mut values) {
            if let Value::Integer(number) = *value
                && reals.contains(column)
            {
                *value = Value::Real(number as f64);
            }
        }
        values
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

/// The columns of a table that hold real numbers.
fn reals_of(connection: &Connection, table: &str) -> rusqlite::Result<Vec<String>> {
    let mut names = connection.prepare("SELECT name FROM pragma_table_info(?1) WHERE type = 'REAL'")?;
    names.query_map([table], |row| row.get(0))?.collect()
}
