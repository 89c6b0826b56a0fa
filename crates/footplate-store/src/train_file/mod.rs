//! Full-size trains on disk: a TOML form that people write by hand, and readers for three forms of others.
//!
//! [`read_train`] tells the form from the file. The forms are described in `docs/formats/train.md`.

mod form;
mod osrd;
mod own;
mod read;
mod trainruns;
mod ttobench;
mod write;

pub use form::{TrainFile, TrainFileForm};
pub use read::{parse_train, read_train};
pub use write::write_train;

pub(crate) use read::form_of;
