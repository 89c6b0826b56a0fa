//! Writes tables row by row, as CSV or Parquet.

mod cell;
mod csv;
mod parquet;
mod writer;

pub(crate) use cell::{Cell, Kind};
pub(crate) use csv::CsvTable;
pub(crate) use writer::TableWriter;
pub use writer::{TableForm, UnknownForm};
