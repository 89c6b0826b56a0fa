//! Tachometer recordings: what two wheelsets counted, period by period, and the truth where it is known.
//!
//! A [`TachometerReader`] tells CSV from Parquet by the first bytes and hands over the rows in blocks of columns, as
//! soon as they are there. The columns are described in `docs/formats/tachometer-recording.md`.

mod block;
mod columns;
mod csv;
mod csv_bytes;
mod csv_line;
mod csv_lines;
mod error;
mod mapping;
mod note;
mod parquet;
mod parquet_column;
mod reader;
mod row_watch;
mod run_names;
mod swap_watch;
mod time_watch;
mod write;

pub use block::{TachometerBlock, Truth};
pub use columns::TachometerColumns;
pub use error::TachometerError;
pub use mapping::{ColumnMapping, MappingError};
pub use note::{RowPlace, TachometerNote, TachometerOddity};
pub use reader::TachometerReader;
pub use time_watch::TimeFaults;
pub use write::{TachometerWriter, WrittenColumns};
