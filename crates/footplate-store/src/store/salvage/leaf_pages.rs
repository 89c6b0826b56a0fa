//! Rows as they lie in the file, page by page, whatever the trees above them say.
//!
//! A table's rows are in the cells of its leaf pages (SQLite file format, sections 1.6 and 2.1). A leaf does not say whose it is,
//! but what it holds does.

use rusqlite::types::Value;

/// The first byte of a leaf page of a table.
const TABLE_LEAF: u8 = 13;
/// The header of the file stands before the first page's own.
const FILE_HEADER: usize = 100;
/// Where the header of the file says how large its pages are, and how much at their ends is not used.
const PAGE_SIZE_AT: usize = 16;
const RESERVED_AT: usize = 20;
/// What new stores have.
const USUAL_PAGE: usize = 4096;
/// The header of a leaf page.
const LEAF_HEADER: usize = 8;

/// One row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FoundRow {
    /// Its number, which is its first column.
    pub(super) id: i64,
    /// All its columns as they were written; the first is null.
    pub(super) values: Vec<Value>,
}

/// A file as pages.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pages<'a> {
    bytes: &'a [u8],
    size: usize,
    usable: usize,
}

impl<'a> Pages<'a> {
    pub(super) fn of(bytes: &'a [u8]) -> Self {
        let said = usize::from(u16_at(bytes, PAGE_SIZE_AT).unwrap_or(0));
        let size = if said.is_power_of_two() && said >= 512 { said } else { USUAL_PAGE };
        let reserved = bytes.get(RESERVED_AT).copied().map_or(0, usize::from);
        // A damaged header may say anything; our stores reserve nothing.
        let usable = if reserved < 32 && size == said { size - reserved } else { size };
        Self { bytes, size, usable }
    }

    /// The rows of every page that can be a leaf of a table, page by page.
    pub(super) fn leaves(self) -> impl Iterator<Item = Vec<FoundRow>> + 'a {
        (0..self.bytes.len().div_ceil(self.size)).map(move |number| self.rows_of(number))
    }

    /// Every row of every such page.
    pub(super) fn rows(self) -> impl Iterator<Item = FoundRow> + 'a {
        self.leaves().flatten()
    }

    fn rows_of(self, number: usize) -> Vec<FoundRow> {
        let Some(page) = self.page(number) else { return Vec::new() };
        let header = if number == 0 { FILE_HEADER } else { 0 };
        if page.get(header) != Some(&TABLE_LEAF) {
            return Vec::new();
        }
        let cells = u16_at(page, header + 3).map_or(0, usize::from);
        let place = |cell: usize| u16_at(page, header + LEAF_HEADER + 2 * cell).map(usize::from);
        (0..cells).filter_map(|cell| self.row(page, place(cell)?)).collect()
    }

    fn page(self, number: usize) -> Option<&'a [u8]> {
        let begin = number.checked_mul(self.size)?;
        self.bytes.get(begin..(begin + self.usable).min(self.bytes.len()))
    }

    fn row(self, page: &[u8], at: usize) -> Option<FoundRow> {
        let mut rest = page.get(at..)?;
        let length = usize::try_from(varint(&mut rest)?).ok()?;
        let id = i64::from_ne_bytes(varint(&mut rest)?.to_ne_bytes());
        if length > self.bytes.len() {
            return None;
        }
        let payload = self.payload(rest, length)?;
        Some(FoundRow { id, values: record(&payload)? })
    }

    /// The payload of a cell with what lies on pages of its own (1.6, "overflow pages").
    fn payload(self, cell: &[u8], length: usize) -> Option<Vec<u8>> {
        let most_here = self.usable - 35;
        if length <= most_here {
            return cell.get(..length).map(<[u8]>::to_vec);
        }
        let least_here = (self.usable - 12) * 32 / 255 - 23;
        let fitting = least_here + (length - least_here) % (self.usable - 4);
        let here = if fitting <= most_here { fitting } else { least_here };
        let mut payload = cell.get(..here)?.to_vec();
        let mut next = u32_at(cell, here)?;
        // A chain that goes round ends where the payload does.
        while payload.len() < length {
            let page = self.page(usize::try_from(next).ok()?.checked_sub(1)?)?;
            next = u32_at(page, 0)?;
            let missing = length - payload.len();
            payload.extend(page.get(4..)?.iter().take(missing));
        }
        Some(payload)
    }
}

/// The columns of a record (2.1): a header of types, then what they say.
fn record(payload: &[u8]) -> Option<Vec<Value>> {
    let mut header = payload;
    let size = usize::try_from(varint(&mut header)?).ok()?;
    let mut header = payload.get(payload.len() - header.len()..size)?;
    let mut body = payload.get(size..)?;
    let mut values = Vec::new();
    while !header.is_empty() {
        let kind = varint(&mut header)?;
        let mut take = |count: usize| {
            let (taken, rest) = body.split_at_checked(count)?;
            body = rest;
            Some(taken)
        };
        values.push(match kind {
            0 => Value::Null,
            1..=4 => Value::Integer(big_endian(take(usize::try_from(kind).ok()?)?)),
            5 => Value::Integer(big_endian(take(6)?)),
            6 => Value::Integer(big_endian(take(8)?)),
            7 => Value::Real(f64::from_be_bytes(take(8)?.try_into().ok()?)),
            8 => Value::Integer(0),
            9 => Value::Integer(1),
            10 | 11 => return None,
            odd if odd % 2 == 1 => {
                let text = take(usize::try_from((odd - 13) / 2).ok()?)?;
                Value::Text(String::from_utf8(text.to_vec()).ok()?)
            }
            even => Value::Blob(take(usize::try_from((even - 12) / 2).ok()?)?.to_vec()),
        });
    }
    // Something that only looks like a row has something left over.
    body.is_empty().then_some(values)
}

fn big_endian(bytes: &[u8]) -> i64 {
    let sign = bytes.first().map_or(0, |first| if first & 0x80 == 0 { 0 } else { -1 });
    bytes.iter().fold(sign, |value, byte| value << 8 | i64::from(*byte))
}

/// A number of one to nine bytes (1.6), whose bytes are then behind `rest`.
fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0_u64;
    for at in 0..9 {
        let (byte, after) = rest.split_first()?;
        *rest = after;
        if at == 8 {
            return Some(value << 8 | u64::from(*byte));
        }
        value = value << 7 | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            break;
        }
    }
    Some(value)
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_found_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.db");
        let connection = rusqlite::Connection::open(&path).unwrap();
        connection.execute_batch("CREATE TABLE some (id INTEGER PRIMARY KEY, a, b TEXT)").unwrap();
        let numbers =
            [0, 1, -1, 127, -128, 32_767, -8_388_608, i64::from(i32::MAX), 1 << 46, i64::MIN, i64::MAX];
        let mut written = Vec::new();
        for (id, number) in (1..).zip(numbers) {
            // The longest needs pages of its own.
            let text = "x".repeat(usize::try_from(id * id * 311).unwrap());
            connection.execute("INSERT INTO some VALUES (?1, ?2, ?3)", (id, number, &text)).unwrap();
            written.push(FoundRow { id, values: vec![Value::Null, number.into(), text.into()] });
        }
        connection.execute("INSERT INTO some VALUES (1000, 0.25, NULL)", ()).unwrap();
        written.push(FoundRow { id: 1000, values: vec![Value::Null, 0.25.into(), Value::Null] });
        drop(connection);
        let bytes = std::fs::read(path).unwrap();
        let mut found: Vec<FoundRow> =
            Pages::of(&bytes).rows().filter(|row| row.values.first() == Some(&Value::Null)).collect();
        found.sort_by_key(|row| row.id);
        assert_eq!(found, written);
        // Whatever bytes there are, they are no more than not read.
        for at in (0..bytes.len()).step_by(13) {
            let mut bent = bytes.clone();
            bent[at] ^= 0x5a;
            assert!(Pages::of(&bent).rows().count() <= bytes.len());
        }
    }
}
