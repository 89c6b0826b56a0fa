//! Archives: inputs and decisions of a machine, many in a row and compressed.
//!
//! The newest inputs and decisions are rows of their own. When a store has [`MOST_LOOSE`] of them, all move into archives, in
//! the transaction that added the last one. Whatever ends the program, each is in one of both places. Compressed they take a
//! tenth of the space (docs/trust.md).

use std::borrow::Cow;

use footplate_core::Timestamp;
use miniz_oxide::deflate::compress_to_vec_zlib;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use rusqlite::types::Type;
use rusqlite::{Connection, Error, ToSql, Transaction};

use super::checksum;
use super::decisions::{MachineKey, Side, Traced, loose};
use super::packed_body::LEVEL;

/// The inputs and decisions that are rows of their own, at most (chosen: six minutes of two trains, 0.1 MB).
pub(super) const MOST_LOOSE: u64 = 1_024;
/// The longest body, unpacked: 16 kB for each entry, where a long one has 1 kB. Somebody else's file may hold anything.
const MOST_BYTES: usize = 16 << 20;

/// An entry of a body: its number, its time in ns, whether it is a decision, its kind and its text.
type Packed<'t> = (u64, i64, bool, Cow<'t, str>, Cow<'t, str>);

/// The number of inputs and decisions that are rows of their own.
pub(super) fn loose_count(connection: &Connection) -> rusqlite::Result<u64> {
    let sql = "SELECT (SELECT count(*) FROM inputs) + (SELECT count(*) FROM decisions)";
    connection.query_row(sql, [], |row| row.get(0))
}

/// Moves all inputs and decisions into archives. Moves none if one of them has changed since it was written: a new checksum
/// would hide that.
pub(super) fn archive(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    for table in ["inputs", "decisions"] {
        if checksum::changed_row(transaction, table)?.is_some() {
            return Ok(());
        }
    }
    let sql = "SELECT machine FROM inputs UNION SELECT machine FROM decisions";
    let mut statement = transaction.prepare(sql)?;
    let machines = statement.query_map([], |row| row.get(0).map(MachineKey))?;
    for machine in machines.collect::<rusqlite::Result<Vec<_>>>()? {
        for part in loose(transaction, machine)?.chunks(MOST_LOOSE as usize) {
            insert(transaction, machine, part)?;
        }
    }
    // All of them, so that their numbers begin again and a salvage finds no gap.
    transaction.execute_batch("DELETE FROM inputs; DELETE FROM decisions")
}

fn insert(transaction: &Transaction<'_>, machine: MachineKey, part: &[Traced]) -> rusqlite::Result<()> {
    let (Some(first), Some(last)) = (part.first(), part.last()) else { return Ok(()) };
    let is_input = |traced: &&Traced| traced.side == Side::Input;
    let inputs = part.iter().filter(is_input).count() as u64;
    let has_end = part.iter().filter(is_input).any(|traced| traced.kind == "end");
    let body = packed(part).map_err(|error| Error::ToSqlConversionFailure(error.into()))?;
    let values: [&dyn ToSql; 7] =
        [&machine.0, &first.number, &last.number, &inputs, &(part.len() as u64 - inputs), &has_end, &body];
    let columns = ["machine", "first", "last", "inputs", "decisions", "has_end", "body"];
    checksum::append(transaction, "archives", &columns, &values)
}

/// The archived inputs and decisions of a machine, in order.
pub(super) fn archived(connection: &Connection, machine: MachineKey) -> rusqlite::Result<Vec<Traced>> {
    let mut statement = connection.prepare("SELECT body FROM archives WHERE machine = ?1 ORDER BY first")?;
    let mut rows = statement.query([machine.0])?;
    let mut all = Vec::new();
    while let Some(row) = rows.next()? {
        let body = row.get_ref(0)?.as_blob()?;
        all.extend(unpacked(body).map_err(|why| Error::FromSqlConversionFailure(0, Type::Blob, why.into()))?);
    }
    Ok(all)
}

fn packed(part: &[Traced]) -> serde_json::Result<Vec<u8>> {
    let pack = |traced: &Traced| -> Packed<'static> {
        let Traced { number, time, side, kind, text } = traced.clone();
        (number, time.as_ns(), side == Side::Decision, kind, Cow::Owned(text))
    };
    let entries: Vec<Packed<'_>> = part.iter().map(pack).collect();
    Ok(compress_to_vec_zlib(&serde_json::to_vec(&entries)?, LEVEL))
}

fn unpacked(body: &[u8]) -> Result<Vec<Traced>, String> {
    let json = decompress_to_vec_zlib_with_limit(body, MOST_BYTES).map_err(|error| error.to_string())?;
    let entries: Vec<Packed<'_>> = serde_json::from_slice(&json).map_err(|error| error.to_string())?;
    let unpack = |(number, time_ns, is_decision, kind, text): Packed<'_>| Traced {
        number,
        time: Timestamp::from_ns(time_ns),
        side: if is_decision { Side::Decision } else { Side::Input },
        kind: Cow::Owned(kind.into_owned()),
        text: text.into_owned(),
    };
    Ok(entries.into_iter().map(unpack).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_comes_back_and_a_damaged_or_huge_one_is_refused() {
        let traced = |number: u64| Traced {
            number,
            time: Timestamp::from_ns(i64::MAX - number as i64),
            side: if number.is_multiple_of(3) { Side::Input } else { Side::Decision },
            kind: Cow::Borrowed("notice"),
            text: format!("\"{number}\" ä\n\u{0}"),
        };
        let part: Vec<Traced> = (7..3_000).map(traced).collect();
        let body = packed(&part).unwrap();
        assert_eq!(unpacked(&body).unwrap(), part);
        assert!(unpacked(&body[..body.len() - 1]).is_err());
        // 16 MB and a byte more of spaces are 16 kB.
        let huge = compress_to_vec_zlib(&vec![b' '; MOST_BYTES + 1], LEVEL);
        assert!(huge.len() < 20_000 && unpacked(&huge).is_err());
    }
}
