//! A recording in Parquet, read column by column.

use std::fs::File;

use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaData, RowGroupMetaData};
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::block::{BLOCK_ROWS, TachometerBlock};
use super::columns::{Slot, TachometerColumns};
use super::error::TachometerError;
use super::note::{RowPlace, TachometerNote};
use super::parquet_column::{ColumnFault, ParquetColumn};
use super::row_watch::RowWatch;
use super::run_names::RunNames;

/// What every Parquet file begins with.
pub(super) const PARQUET_MAGIC: &[u8; 4] = b"PAR1";

/// A Parquet file that is being read.
pub(super) struct ParquetReader {
    file: String,
    reader: SerializedFileReader<File>,
    columns: TachometerColumns,
    /// The columns that are used.
    used: Vec<ParquetColumn>,
    next_group: usize,
    rows_left: usize,
    rows_read: u64,
    rows: u64,
    runs: RunNames,
    watch: RowWatch,
    notes: Vec<TachometerNote>,
}

impl ParquetReader {
    /// Reads what the file says about itself. `file` is what messages call it.
    pub(super) fn open(file: &str, input: File) -> Result<Self, TachometerError> {
        let unreadable = |error| unreadable(file, &error);
        let reader = SerializedFileReader::new(input).map_err(unreadable)?;
        check_places(reader.metadata()).map_err(unreadable)?;
        let about = reader.metadata().file_metadata();
        let schema = about.schema_descr();
        let rows = u64::try_from(about.num_rows()).unwrap_or_default();
        let names = schema.columns().iter().map(|column| column.path().string()).collect();
        let (columns, oddities) = TachometerColumns::of_header(file, names)?;
        let mut used = Vec::new();
        for (leaf, slot) in columns.slots.iter().enumerate().filter(|(_, slot)| **slot != Slot::Unused) {
            let column = ParquetColumn::new(leaf, *slot, &schema.column(leaf));
            used.push(column.map_err(|(found, expected)| TachometerError::ParquetType {
                file: file.to_owned(),
                column: columns.names.get(leaf).cloned().unwrap_or_default(),
                found,
                expected,
            })?);
        }
        if rows == 0 {
            return Err(TachometerError::NoRows(file.to_owned()));
        }
        check_sizes(file, reader.metadata(), &used)?;
        let notes = oddities.into_iter().map(|oddity| TachometerNote { place: None, oddity }).collect();
        Ok(Self {
            file: file.to_owned(),
            reader,
            columns,
            used,
            next_group: 0,
            rows_left: 0,
            rows_read: 0,
            rows,
            runs: RunNames::default(),
            watch: RowWatch::default(),
            notes,
        })
    }

    /// What messages call the file.
    pub(super) fn file(&self) -> &str {
        &self.file
    }

    pub(super) fn columns(&self) -> &TachometerColumns {
        &self.columns
    }

    /// How many rows there are.
    pub(super) fn rows(&self) -> u64 {
        self.rows
    }

    /// The next rows; `false` at the end.
    pub(super) fn read_block(&mut self, block: &mut TachometerBlock) -> Result<bool, TachometerError> {
        block.begin(&self.columns);
        block.notes.append(&mut self.notes);
        while self.rows_left == 0 {
            if self.next_group >= self.reader.num_row_groups() {
                self.watch.end(&self.file, &self.columns)?;
                return Ok(false);
            }
            self.begin_group().map_err(|error| unreadable(&self.file, &error))?;
        }
        let rows = self.rows_left.min(BLOCK_ROWS);
        for column in &mut self.used {
            column.read(rows, block, &mut self.runs).map_err(|fault| match fault {
                ColumnFault::Unreadable(error) => unreadable(&self.file, &error),
                ColumnFault::Value { row, value, expected } => TachometerError::ParquetValue {
                    file: self.file.clone(),
                    row: self.rows_read + row as u64 + 1,
                    column: self.columns.names.get(column.leaf()).cloned().unwrap_or_default(),
                    value,
                    expected,
                },
            })?;
        }
        for row in 0..rows {
            let place = RowPlace::Row(self.rows_read + row as u64 + 1);
            self.watch.see(&self.file, &self.columns, block, row, place)?;
        }
        self.rows_left -= rows;
        self.rows_read += rows as u64;
        block.time_faults = self.watch.faults();
        block.read_up_to = self.rows_read;
        Ok(true)
    }

    fn begin_group(&mut self) -> Result<(), ParquetError> {
        let group = self.reader.get_row_group(self.next_group)?;
        for column in &mut self.used {
            column.begin(group.get_column_reader(column.leaf())?);
        }
        self.rows_left = usize::try_from(group.metadata().num_rows()).unwrap_or_default();
        self.next_group += 1;
        Ok(())
    }
}

/// Whether every column says where it stands: the decoder panics at places before the beginning of the file.
fn check_places(about: &ParquetMetaData) -> Result<(), ParquetError> {
    let columns = about.row_groups().iter().flat_map(RowGroupMetaData::columns);
    let places = columns.flat_map(|column| {
        [
            column.data_page_offset(),
            column.dictionary_page_offset().unwrap_or_default(),
            column.compressed_size(),
        ]
    });
    match places.into_iter().find(|place| *place < 0) {
        Some(place) => Err(ParquetError::General(format!("a column begins at byte {place}"))),
        None => Ok(()),
    }
}

/// Whether no column unpacks to more than its values can need: the decoder allocates what headers say. The longest values are
/// names of runs.
fn check_sizes(file: &str, about: &ParquetMetaData, used: &[ParquetColumn]) -> Result<(), TachometerError> {
    /// The longest value that is read, on average over a column: a name of a run.
    const PER_VALUE: i64 = 1_024;
    /// Headers and a dictionary besides.
    const BESIDES: i64 = 1 << 20;
    for group in about.row_groups() {
        for column in used.iter().filter_map(|column| group.columns().get(column.leaf())) {
            let (values, bytes) = (column.num_values(), column.uncompressed_size());
            let most = values.saturating_mul(PER_VALUE).saturating_add(BESIDES);
            if bytes > most {
                let column = column.column_path().string();
                return Err(TachometerError::ParquetSize {
                    file: file.to_owned(),
                    column,
                    values,
                    bytes,
                    most,
                });
            }
        }
    }
    Ok(())
}

fn unreadable(file: &str, error: &ParquetError) -> TachometerError {
    TachometerError::Parquet { file: file.to_owned(), problem: error.to_string() }
}
