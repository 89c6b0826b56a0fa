//! Writes tables row by row, as CSV or Parquet.

mod csv;
mod parquet;
mod writer;

pub(crate) use csv::CsvTable;
pub(crate) use writer::TableWriter;
pub(crate) use writer::{Cell, Kind};
pub use writer::{TableForm, UnknownForm};
