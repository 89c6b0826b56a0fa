//! What the readers of all forms have in common.

use footplate_core::TrainId;

use super::runs::Runs;
use crate::recording::Form;
use crate::sensor_names::SensorNames;
use crate::table::{Row, TableError};

/// What a log leaves unsaid.
#[derive(Clone, Copy)]
pub struct LogContext<'a> {
    /// What the sensors of its railway are called.
    pub sensors: &'a dyn SensorNames,
    /// The train of rows that name none, unless the name of the file says another one.
    pub train: Option<TrainId>,
}

/// A reader of one form: takes in row after row.
pub(super) trait FormReader {
    /// The form.
    const FORM: Form;
    /// The columns that the form cannot do without.
    const REQUIRED: &'static [&'static str];
    /// The columns that it knows besides.
    const OPTIONAL: &'static [&'static str];

    /// Adds a row to the runs, or leaves them as they were.
    fn read_row(&mut self, row: Row<'_>, runs: &mut Runs) -> Result<(), TableError>;
}
