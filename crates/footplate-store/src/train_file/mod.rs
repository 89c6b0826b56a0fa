//! Full-size trains on disk: a TOML format written by hand, and readers for three other formats.
//!
//! [`read_train`] recognises the format. `docs/formats/train.md` describes them.

mod form;
mod osrd;
mod own;
mod read;
mod trainruns;
mod ttobench;

pub use form::{TrainFile, TrainFileForm};
pub use own::write_train;
pub use read::{parse_train, read_train};

pub(crate) use read::form_of;
