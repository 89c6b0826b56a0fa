//! Any bytes as a layout file: they are refused with a place in the file, or read, and what was read can be written
//! and read again as the same.

use footplate_store::{draw_layout, parse_layout, write_layout};

pub(crate) fn fuzz(bytes: &[u8]) {
    match parse_layout("layout.toml", bytes) {
        Ok(read) => {
            let written = write_layout(&read);
            let again = parse_layout("layout.toml", written.as_bytes());
            assert_eq!(again.map(|again| write_layout(&again)).as_deref().ok(), Some(written.as_str()));
            let _ = draw_layout(&read);
        }
        Err(error) => assert!(error.to_string().starts_with("layout.toml"), "{error}"),
    }
}
