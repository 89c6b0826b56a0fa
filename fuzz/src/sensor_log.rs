//! Any bytes as a sensor log: they are refused or read, and what was read can be written and read again.

use std::path::Path;

use footplate_core::TrainId;
use footplate_store::{LogContext, ModuleLetters, parse_sensor_log, write_sensor_log};

pub(crate) fn fuzz(bytes: &[u8]) {
    let context = LogContext { sensors: &ModuleLetters, train: Some(TrainId(24)) };
    let Ok(recording) = parse_sensor_log(Path::new("log.csv"), bytes, context) else { return };
    let mut written = Vec::new();
    write_sensor_log(&recording, &ModuleLetters, &mut written).expect("memory takes every byte");
    let again = parse_sensor_log(Path::new("log.csv"), written.as_slice(), context);
    assert!(again.is_ok(), "a log that was written reads back: {again:?}");
}
