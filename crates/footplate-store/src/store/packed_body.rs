//! The body of a row: a JSON text, compressed if it is long.
//!
//! Its row has two columns: `body`, which SQLite checks to be JSON, and `packed`, a zlib stream. One of them has the text.

use miniz_oxide::deflate::compress_to_vec_zlib;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use rusqlite::types::Type;
use rusqlite::{Error, Row};
use serde::de::IgnoredAny;

/// The usual level of compression of zlib.
pub(super) const LEVEL: u8 = 6;
/// The shortest text that is compressed, in bytes (chosen: a shorter one has its page of the file with others anyway).
const LEAST_PACKED: usize = 1_024;
/// The longest text, where a long one has 0.1 MB. Somebody else's file may hold anything.
const MOST_BYTES: usize = 64 << 20;
/// `body` where `packed` has the text.
const IN_PACKED: &str = "null";

/// The two columns.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct PackedBody<'t> {
    pub(super) body: &'t str,
    pub(super) packed: Option<Vec<u8>>,
}

impl<'t> PackedBody<'t> {
    /// The columns of a text. What is not JSON stays as it is, so that the table rejects it.
    pub(super) fn of(text: &'t str) -> Self {
        let is_long = text.len() >= LEAST_PACKED;
        if is_long && serde_json::from_str::<IgnoredAny>(text).is_ok() {
            Self { body: IN_PACKED, packed: Some(compress_to_vec_zlib(text.as_bytes(), LEVEL)) }
        } else {
            Self { body: text, packed: None }
        }
    }

    /// The text of a row; the two columns are `first` and the one behind it.
    pub(super) fn text(row: &Row<'_>, first: usize) -> rusqlite::Result<String> {
        let Some(packed) = row.get_ref(first + 1)?.as_blob_or_null()? else { return row.get(first) };
        let unpacked =
            decompress_to_vec_zlib_with_limit(packed, MOST_BYTES).map_err(|error| error.to_string());
        let text = unpacked.and_then(|bytes| String::from_utf8(bytes).map_err(|error| error.to_string()));
        text.map_err(|why| Error::FromSqlConversionFailure(first + 1, Type::Blob, why.into()))
    }
}

#[cfg(test)]
mod tests {
    use rusqlite::Connection;

    use super::*;

    #[test]
    fn a_long_text_comes_back_from_an_eighth_of_its_bytes_and_a_damaged_one_is_refused() {
        let connection = Connection::open_in_memory().unwrap();
        let read = |body: &str, packed: Option<&[u8]>| {
            connection.query_row("SELECT ?1, ?2", (body, packed), |row| PackedBody::text(row, 0))
        };
        let numbers: Vec<u32> = (0..5_000).map(|number| number % 100).collect();
        let long = serde_json::to_string(&numbers).unwrap();
        for text in ["{}", "7", long.as_str()] {
            let PackedBody { body, packed } = PackedBody::of(text);
            assert_eq!(packed.is_some(), text.len() > 1_000);
            assert!(packed.as_ref().is_none_or(|packed| packed.len() < text.len() / 8));
            assert_eq!(read(body, packed.as_deref()).unwrap(), text);
        }
        let packed = PackedBody::of(&long).packed.unwrap();
        assert!(read("null", Some(&packed[..packed.len() - 1])).is_err());
        let not_json = "x".repeat(5_000);
        assert_eq!(PackedBody::of(&not_json), PackedBody { body: &not_json, packed: None });
    }
}
