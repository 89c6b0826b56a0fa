//! Any bytes as a train or a line, in each syntax: they are refused with a place in the file, or read, and what was read
//! can be written and read again as the same.

use footplate_store::{Described, parse_described, parse_line, parse_train, write_line, write_train};

pub(crate) fn fuzz(bytes: &[u8]) {
    for file in ["any.toml", "any.yaml"] {
        match parse_described(file, bytes, None) {
            Ok(Described::Train(read)) => {
                let written = write_train(&read.train, &read.about);
                let again = parse_train("again.toml", written.as_bytes(), None);
                assert_eq!(again.ok().map(|again| again.train), Some(read.train));
            }
            // A limit that is no decimal number of km/h may differ in its last bit.
            Ok(Described::Line(read)) => {
                let written = write_line(&read.line, &read.about);
                assert!(parse_line("again.toml", written.as_bytes(), None).is_ok());
            }
            Err(error) => assert!(error.to_string().starts_with(file), "{error}"),
        }
    }
}
