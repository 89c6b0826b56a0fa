//! Full-size lines on disk: a TOML form that people write by hand, and readers for two forms of others.
//!
//! [`read_line`] tells the form from the file. The forms are described in `docs/formats/line.md`.

mod form;
mod own;
mod read;
mod trainruns;
mod ttobench;

pub use form::{LineFile, LineFileForm};
pub use own::write_line;
pub use read::{parse_line, read_line};

pub(crate) use read::form_of;
