//! The decisions of a machine in a live session, and their inputs.
//!
//! The store keeps the initial state of a machine, and after it, numbered together, its inputs and decisions. Every row
//! is one [`Traced`]; the program that wrote the text defines its meaning. Older ones move into [archives](super::archives).

use std::borrow::Cow;

use footplate_core::Timestamp;
use rusqlite::{Connection, Row, ToSql, Transaction};

use super::archives::archived;
use super::checksum;
use super::error::StoreError;
use super::file::Store;
use super::keys::RecordingKey;
use super::packed_body::PackedBody;
use crate::content_hash::ContentHash;

/// A machine by its number in the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MachineKey(pub i64);

/// A machine that begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NewMachine<'a> {
    /// Which kind of machine, such as `drive`.
    pub kind: &'a str,
    /// The version of the program.
    pub program: &'a str,
    /// Its initial state, as JSON.
    pub body: &'a str,
}

/// The initial state of a machine in a recorded session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredMachine {
    /// Its number in the store.
    pub key: MachineKey,
    /// The session.
    pub recording: RecordingKey,
    /// When it was stored.
    pub stored_at: Timestamp,
    /// Which kind of machine.
    pub kind: String,
    /// The version of the program that ran it.
    pub program: String,
    /// Its initial state, as JSON.
    pub body: String,
    /// Whether the body has the bytes that were written.
    pub is_whole: bool,
    /// The number of its inputs.
    pub inputs: u64,
    /// The number of its decisions.
    pub decisions: u64,
}

/// The direction of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// An input of the machine.
    Input,
    /// A decision of the machine.
    Decision,
}

/// An input or a decision of a machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Traced {
    /// Counts inputs and decisions of a machine together, from 0 without gaps.
    pub number: u64,
    /// The time of the input on the clock of the run; of a decision, the time of the input before it.
    pub time: Timestamp,
    /// Input or decision.
    pub side: Side,
    /// The kind of input or decision.
    pub kind: Cow<'static, str>,
    /// Its content.
    pub text: String,
}

impl Store {
    /// Stores the initial state of a machine in a live session.
    ///
    /// # Errors
    /// The store cannot be written, or the body is no JSON.
    pub fn begin_machine(
        &mut self,
        recording: RecordingKey,
        new: NewMachine<'_>,
        now: Timestamp,
    ) -> Result<MachineKey, StoreError> {
        let columns = ["recording", "stored_at_ns", "kind", "program", "body", "body_sha256", "packed"];
        let hash = ContentHash::of(new.body.as_bytes()).to_string();
        let PackedBody { body, packed } = PackedBody::of(new.body);
        let values: [&dyn ToSql; 7] =
            [&recording.0, &now.as_ns(), &new.kind, &new.program, &body, &hash, &packed];
        checksum::append(&self.connection, "machines", &columns, &values)
            .map_err(|error| self.error(error))?;
        Ok(MachineKey(self.connection.last_insert_rowid()))
    }

    /// The machines of all sessions, in the order of their beginnings.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn machines(&self) -> Result<Vec<StoredMachine>, StoreError> {
        let sql = "SELECT id, recording, stored_at_ns, kind, program, body, packed, body_sha256, \
                   (SELECT count(*) FROM inputs WHERE machine = machines.id) + \
                   (SELECT ifnull(sum(inputs), 0) FROM archives WHERE machine = machines.id), \
                   (SELECT count(*) FROM decisions WHERE machine = machines.id) + \
                   (SELECT ifnull(sum(decisions), 0) FROM archives WHERE machine = machines.id) \
                   FROM machines ORDER BY id";
        let read = || {
            let mut statement = self.connection.prepare(sql)?;
            statement.query_map([], machine)?.collect::<rusqlite::Result<Vec<StoredMachine>>>()
        };
        read().map_err(|error| self.error(error))
    }

    /// All inputs and decisions of a machine, in order.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn trace(&self, machine: MachineKey) -> Result<Vec<Traced>, StoreError> {
        let read = || {
            let mut trace = archived(&self.connection, machine)?;
            trace.extend(loose(&self.connection, machine)?);
            Ok(trace)
        };
        read().map_err(|error| self.error(error))
    }
}

/// The inputs and decisions of a machine that are rows of their own, in order.
pub(super) fn loose(connection: &Connection, machine: MachineKey) -> rusqlite::Result<Vec<Traced>> {
    let sql = "SELECT number, time_ns, 0, kind, text FROM inputs WHERE machine = ?1 UNION ALL \
               SELECT number, time_ns, 1, kind, text FROM decisions WHERE machine = ?1 ORDER BY number";
    connection.prepare(sql)?.query_map([machine.0], traced)?.collect()
}

fn machine(row: &Row<'_>) -> rusqlite::Result<StoredMachine> {
    // A body that does not unpack is not whole.
    let body = PackedBody::text(row, 5).unwrap_or_default();
    let hash: String = row.get(7)?;
    Ok(StoredMachine {
        key: MachineKey(row.get(0)?),
        recording: RecordingKey(row.get(1)?),
        stored_at: Timestamp::from_ns(row.get(2)?),
        kind: row.get(3)?,
        program: row.get(4)?,
        is_whole: ContentHash::of(body.as_bytes()).to_string() == hash,
        body,
        inputs: row.get(8)?,
        decisions: row.get(9)?,
    })
}

fn traced(row: &Row<'_>) -> rusqlite::Result<Traced> {
    Ok(Traced {
        number: row.get(0)?,
        time: Timestamp::from_ns(row.get(1)?),
        side: if row.get::<_, bool>(2)? { Side::Decision } else { Side::Input },
        kind: Cow::Owned(row.get(3)?),
        text: row.get(4)?,
    })
}

/// Appends an input or a decision.
pub(super) fn insert(
    transaction: &Transaction<'_>,
    machine: MachineKey,
    traced: &Traced,
) -> rusqlite::Result<()> {
    let table = match traced.side {
        Side::Input => "inputs",
        Side::Decision => "decisions",
    };
    let values: [&dyn ToSql; 5] =
        [&machine.0, &traced.number, &traced.time.as_ns(), &traced.kind.as_ref(), &traced.text];
    checksum::append(transaction, table, &["machine", "number", "time_ns", "kind", "text"], &values)
}
