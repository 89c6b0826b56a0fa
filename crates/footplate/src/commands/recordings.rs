//! Reading the sensor logs that a verb was given.

use std::path::PathBuf;

use footplate_core::TrainId;
use footplate_store::{LogContext, Recording, SensorNames, read_sensor_log};

/// Reads all logs and says on standard error what was odd in them. `train` is that of logs that name none.
pub(crate) fn read_all(
    paths: &[PathBuf],
    sensors: &dyn SensorNames,
    train: Option<TrainId>,
) -> anyhow::Result<Vec<Recording>> {
    let mut recordings = Vec::with_capacity(paths.len());
    for path in paths {
        let recording = read_sensor_log(path, LogContext { sensors, train })?;
        for note in &recording.notes {
            eprintln!("{}, {note}", path.display());
        }
        recordings.push(recording);
    }
    Ok(recordings)
}
