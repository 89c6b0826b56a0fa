//! Tachometer recordings: what two wheelsets counted, period by period, and the truth where it is known.
//!
//! A [`TachometerReader`] tells CSV from Parquet by the first bytes and hands over the rows in blocks of columns, as
//! soon as they are there. The columns are described in `docs/formats/tachometer-recording.md`.

mod block;
mod columns;
mod csv;
mod csv_bytes;
mod csv_line;
mod error;
mod note;
mod reader;
mod run_names;
mod time_watch;

pub use block::{TachometerBlock, Truth};
pub use columns::TachometerColumns;
pub use error::TachometerError;
pub use note::{RowPlace, TachometerNote, TachometerOddity};
pub use reader::TachometerReader;
pub use time_watch::TimeFaults;
