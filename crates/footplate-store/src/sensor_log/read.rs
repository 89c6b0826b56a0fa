//! From a file to a recording: which form it has, and what is the same in all of them.

use std::io::{BufRead, BufReader};
use std::path::Path;

use footplate_core::TrainId;

use super::form_reader::{FormReader, LogContext};
use super::light_gate::LightGateLog;
use super::own::OwnLog;
use super::runs::Runs;
use super::since_command::SinceCommandLog;
use crate::recording::{Form, Note, Oddity, Recording};
use crate::table::{LastLine, Table, TableError, shown};
use crate::whole_file::open_file;

/// Why a sensor log could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A line or a field is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The header fits no form.
    #[error(
        "{file}, line {line}: missing columns: {}; the header names {found}, which comes nearest to the form {form} \
         (docs/formats/sensor-log.md)",
        missing.join(", ")
    )]
    MissingColumns {
        /// The file.
        file: String,
        /// The line of the header.
        line: u64,
        /// What the header names, shortened if long.
        found: String,
        /// The form that most of it fits.
        form: Form,
        /// The columns which that form needs and the header does not name.
        missing: Vec<&'static str>,
    },
    /// There is a header and nothing below it.
    #[error("{0}: no rows below the header; a recording has at least one")]
    NoRows(String),
    /// Neither the rows nor the file name nor the caller say which train ran.
    #[error(
        "{0}: which train ran? its file name should contain `train` and the number, such as `train24`, or the \
         train should be given (`--train 24`)"
    )]
    WhichTrain(String),
}

/// Reads the sensor log at `path`, whatever its form.
pub fn read_sensor_log(path: &Path, context: LogContext<'_>) -> Result<Recording, RecordingError> {
    match open_file(path) {
        Ok((file, _)) => parse_sensor_log(path, BufReader::new(file), context),
        Err(source) => Err(TableError::Read { file: path.display().to_string(), source }.into()),
    }
}

/// Reads a sensor log from `input`; `path` gives the recording its name and messages their file.
pub fn parse_sensor_log(
    path: &Path,
    input: impl BufRead,
    context: LogContext<'_>,
) -> Result<Recording, RecordingError> {
    let file = path.display().to_string();
    let name = path.file_stem().map_or_else(|| file.clone(), |stem| stem.to_string_lossy().into_owned());
    let table = Table::open(&file, input)?;
    // A log whose name says its train is of no other, whichever is asked for.
    let named = train_in(&name);
    // The most demanding form first: no other has all its columns.
    if let Some(columns) = table.columns_named(SinceCommandLog::COLUMNS) {
        let Some(train) = named.or(context.train) else {
            return Err(RecordingError::WhichTrain(file));
        };
        let log = SinceCommandLog::new(&table, columns, context.sensors, train);
        return read_rows(&file, name, table, log);
    }
    if let Some(columns) = table.columns_named(LightGateLog::COLUMNS) {
        return read_rows(&file, name, table, LightGateLog::new(columns, context.sensors));
    }
    if let Some(columns) = table.columns_named(OwnLog::COLUMNS) {
        let context = LogContext { train: context.train.map(|asked| named.unwrap_or(asked)), ..context };
        let log = OwnLog::new(&table, columns, context);
        return read_rows(&file, name, table, log);
    }
    Err(missing_columns(&table, file))
}

fn read_rows<L: FormReader, R: BufRead>(
    file: &str,
    name: String,
    mut table: Table<R>,
    mut log: L,
) -> Result<Recording, RecordingError> {
    let mut runs = Runs::default();
    let unknown: Vec<String> = table
        .columns()
        .iter()
        .filter(|column| !L::REQUIRED.contains(&column.as_str()) && !L::OPTIONAL.contains(&column.as_str()))
        .map(|column| shown(column))
        .collect();
    if !unknown.is_empty() {
        runs.note(Note { line: table.line(), oddity: Oddity::UnknownColumns(unknown) });
    }
    while let Some(row) = table.next_row()? {
        match log.read_row(row, &mut runs) {
            Ok(()) => {}
            // A line that breaks off in the middle of its last field is not wrong but cut.
            Err(_) if table.last_line() == LastLine::NotEnded => table.last_line_is_cut_off(),
            Err(error) => return Err(error.into()),
        }
    }
    let oddity = match table.last_line() {
        LastLine::Ended => None,
        LastLine::NotEnded => Some(Oddity::LineNotEnded),
        LastLine::CutOff => Some(Oddity::LineCutOff),
    };
    let (runs, mut notes) = runs.finish();
    notes.extend(oddity.map(|oddity| Note { line: table.line(), oddity }));
    if runs.is_empty() {
        return Err(RecordingError::NoRows(file.to_owned()));
    }
    Ok(Recording { name, form: L::FORM, runs, notes })
}

/// What the form lacks of which most columns are there; our own if there is none of any.
fn missing_columns<R: BufRead>(table: &Table<R>, file: String) -> RecordingError {
    let forms = [
        (OwnLog::FORM, OwnLog::REQUIRED),
        (SinceCommandLog::FORM, SinceCommandLog::REQUIRED),
        (LightGateLog::FORM, LightGateLog::REQUIRED),
    ];
    let mut nearest = (OwnLog::FORM, OwnLog::REQUIRED.to_vec(), 0);
    for (form, required) in forms {
        let missing: Vec<_> = required.iter().copied().filter(|name| table.column(name).is_none()).collect();
        let there = required.len() - missing.len();
        if there > nearest.2 {
            nearest = (form, missing, there);
        }
    }
    RecordingError::MissingColumns {
        file,
        line: table.line(),
        found: shown(&table.columns().join(", ")),
        form: nearest.0,
        missing: nearest.1,
    }
}

/// The number behind `train` in the name of a file, such as `track_a_train24_run`.
fn train_in(name: &str) -> Option<TrainId> {
    name.match_indices("train").find_map(|(at, word)| {
        let behind = &name[at + word.len()..];
        let end = behind.find(|letter: char| !letter.is_ascii_digit()).unwrap_or(behind.len());
        behind[..end].parse().ok().map(TrainId)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_train_is_found_in_the_name_of_the_file() {
        assert_eq!(train_in("choochoos_2020_track_a_train24_run"), Some(TrainId(24)));
        assert_eq!(train_in("training_train7"), Some(TrainId(7)));
        assert_eq!(train_in("train"), None);
        assert_eq!(train_in("train99999_x"), None);
        assert_eq!(train_in("lap 12"), None);
    }
}
