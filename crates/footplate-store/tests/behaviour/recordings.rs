//! Finds the committed recordings and reads text as if it were a file.

use std::path::{Path, PathBuf};

use footplate_core::TrainId;
use footplate_store::{
    LogContext, ModuleLetters, Recording, RecordingError, parse_sensor_log, read_sensor_log,
};

pub(crate) const ALL: [&str; 9] = [
    "choochoos_2020_track_a_train1_run.csv",
    "choochoos_2020_track_a_train1_stop.csv",
    "choochoos_2020_track_a_train24_run.csv",
    "choochoos_2020_track_a_train24_stop.csv",
    "choochoos_2020_track_a_train74_run.csv",
    "choochoos_2020_track_a_train74_stop.csv",
    "choochoos_2020_track_a_train78_run.csv",
    "choochoos_2020_track_a_train78_stop.csv",
    "eadanila_2020_track_a.csv",
];

const CONTEXT: LogContext<'_> = LogContext { sensors: &ModuleLetters, train: None };

pub(crate) fn path_of(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/sensor-logs").join(file)
}

pub(crate) fn real(file: &str) -> Recording {
    read_sensor_log(&path_of(file), CONTEXT).unwrap()
}

pub(crate) fn bytes_of(file: &str) -> Vec<u8> {
    std::fs::read(path_of(file)).unwrap()
}

/// Reads `bytes` as the file `log_train24.csv`.
pub(crate) fn parse(bytes: &[u8]) -> Result<Recording, RecordingError> {
    parse_sensor_log(Path::new("log_train24.csv"), bytes, CONTEXT)
}

pub(crate) fn parse_of_train(bytes: &[u8], train: u16) -> Result<Recording, RecordingError> {
    let context = LogContext { train: Some(TrainId(train)), ..CONTEXT };
    parse_sensor_log(Path::new("log.csv"), bytes, context)
}
