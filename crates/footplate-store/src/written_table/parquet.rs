//! Writes a table as Parquet.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;

use super::cell::{Cell, Kind};

/// Rows per group: the usual size, a few megabytes in memory.
const GROUP_ROWS: usize = 128 * 1024;

/// The key of a warning about the whole table.
const WARNING: &str = "warning";

/// A table as Parquet: doubles, 64-bit integers and texts, compressed with zstd.
pub(super) struct ParquetTable<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    columns: Vec<GatheredColumn>,
    rows: usize,
}

/// The values of a column that are not written yet.
struct GatheredColumn {
    kind: Kind,
    /// 1 for a value, 0 for an empty field; only in columns that may have empty fields.
    levels: Vec<i16>,
    doubles: Vec<f64>,
    longs: Vec<i64>,
    texts: Vec<ByteArray>,
}

impl<W: Write + Send> ParquetTable<W> {
    pub(super) fn new<'n>(
        output: W,
        columns: impl Iterator<Item = (&'n str, Kind)> + Clone,
        warning: Option<&str>,
    ) -> io::Result<Self> {
        let mut schema = "message table {".to_owned();
        for (name, kind) in columns.clone() {
            let kind = match kind {
                Kind::Time | Kind::Number => "REQUIRED DOUBLE",
                Kind::OptionalTime | Kind::OptionalNumber => "OPTIONAL DOUBLE",
                Kind::Whole => "OPTIONAL INT64",
                Kind::Text => "REQUIRED BYTE_ARRAY",
            };
            let text = if kind.ends_with("BYTE_ARRAY") { " (UTF8)" } else { "" };
            let _ = write!(schema, " {kind} {name}{text};");
        }
        schema.push('}');
        let schema = parse_message_type(&schema).map_err(failed)?;
        let mut properties = WriterProperties::builder()
            // Numbers rarely repeat: a dictionary costs more time than everything else.
            .set_dictionary_enabled(false)
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            // Recordings are read as a whole: statistics for searching are not needed.
            .set_statistics_enabled(EnabledStatistics::None)
            .set_key_value_metadata(
                warning.map(|text| vec![KeyValue::new(WARNING.to_owned(), text.to_owned())]),
            );
        for (name, _) in columns.clone().filter(|(_, kind)| matches!(kind, Kind::Text | Kind::Whole)) {
            properties = properties.set_column_dictionary_enabled(name.into(), true);
        }
        let writer = SerializedFileWriter::new(output, Arc::new(schema), Arc::new(properties.build()));
        let columns = columns.map(|(_, kind)| GatheredColumn::new(kind)).collect();
        Ok(Self { writer: writer.map_err(failed)?, columns, rows: 0 })
    }

    pub(super) fn push<'c>(&mut self, row: impl Iterator<Item = Cell<'c>>) -> io::Result<()> {
        for (column, cell) in self.columns.iter_mut().zip(row) {
            column.push(cell);
        }
        self.rows += 1;
        if self.rows >= GROUP_ROWS { self.write_group().map_err(failed) } else { Ok(()) }
    }

    pub(super) fn finish(mut self) -> io::Result<W> {
        if self.rows > 0 {
            self.write_group().map_err(failed)?;
        }
        self.writer.into_inner().map_err(failed)
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for column in &mut self.columns {
            if let Some(writer) = group.next_column()? {
                column.write(writer)?;
            }
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }
}

impl GatheredColumn {
    fn new(kind: Kind) -> Self {
        Self { kind, levels: Vec::new(), doubles: Vec::new(), longs: Vec::new(), texts: Vec::new() }
    }

    /// Adds a value; one of another type counts as empty.
    fn push(&mut self, cell: Cell<'_>) {
        let is_there = match (self.kind, cell) {
            (Kind::Time | Kind::OptionalTime, Cell::Time(time)) => {
                self.doubles.push(time.as_s());
                true
            }
            (Kind::Number | Kind::OptionalNumber, Cell::Number(number)) => {
                self.doubles.push(number);
                true
            }
            (Kind::Whole, Cell::Whole(number)) => {
                self.longs.push(number);
                true
            }
            (Kind::Text, Cell::Text(text)) => {
                // Most texts repeat the one before: a name, a state.
                let repeated = self.texts.last().filter(|last| last.data() == text.as_bytes()).cloned();
                self.texts.push(repeated.unwrap_or_else(|| text.into()));
                true
            }
            _ => false,
        };
        self.levels.push(i16::from(is_there));
    }

    fn write(&mut self, mut writer: SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
        let levels = self.levels.as_slice();
        match self.kind {
            Kind::Time | Kind::Number => {
                writer.typed::<DoubleType>().write_batch(&self.doubles, None, None)?
            }
            Kind::OptionalTime | Kind::OptionalNumber => {
                writer.typed::<DoubleType>().write_batch(&self.doubles, Some(levels), None)?
            }
            Kind::Whole => writer.typed::<Int64Type>().write_batch(&self.longs, Some(levels), None)?,
            Kind::Text => writer.typed::<ByteArrayType>().write_batch(&self.texts, None, None)?,
        };
        writer.close()?;
        self.levels.clear();
        self.doubles.clear();
        self.longs.clear();
        self.texts.clear();
        Ok(())
    }
}

fn failed(error: ParquetError) -> io::Error {
    io::Error::other(error)
}
