//! Layouts, calibrations and recordings on disk, and reading them back.
//!
//! Files come in through [`read_sensor_log`], which turns every form of sensor log into one
//! [`Recording`].

mod decimal;
mod recording;
mod sensor_log;
mod sensor_names;
mod table;

pub use recording::{Form, GatePass, Note, Oddity, RawEvent, Recording, Run, TrainAtStart};
pub use sensor_log::{
    LogContext, RecordingError, WriteLogError, parse_sensor_log, read_sensor_log, write_sensor_log,
};
pub use sensor_names::{ModuleLetters, SensorNames};
pub use table::{LONGEST_LINE, TableError};
