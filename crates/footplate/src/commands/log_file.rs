//! Reads a sensor log once, for its events and its fingerprint.

use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::Context;
use footplate_core::TrainId;
use footplate_store::{ContentHash, HashingReader, LogContext, Recording, SensorNames, parse_sensor_log};

use crate::reading::ProgressReader;

/// A sensor log and the fingerprint of its file.
pub(crate) struct LogFile {
    pub(crate) recording: Recording,
    pub(crate) content: ContentHash,
}

impl LogFile {
    /// Reads a log, with a progress display if that takes long, and reports oddities on standard error.
    pub(crate) fn read(path: &Path, context: LogContext<'_>) -> anyhow::Result<Self> {
        let reading = || format!("reading {}", path.display());
        let file = ProgressReader::open(path).with_context(reading)?;
        let mut input = BufReader::new(HashingReader::new(file));
        let recording = parse_sensor_log(path, &mut input, context)?;
        let content = input.into_inner().finish().with_context(reading)?;
        for note in &recording.notes {
            eprintln!("{}, {note}", path.display());
        }
        Ok(Self { recording, content })
    }
    /// Reads all logs; `train` applies to logs that name no train.
    pub(crate) fn read_all(
        paths: &[PathBuf],
        sensors: &dyn SensorNames,
        train: Option<TrainId>,
    ) -> anyhow::Result<Vec<Self>> {
        paths.iter().map(|path| Self::read(path, LogContext { sensors, train })).collect()
    }

    /// The recordings of all logs; `train` applies to logs that name no train.
    pub(crate) fn recordings(
        paths: &[PathBuf],
        sensors: &dyn SensorNames,
        train: Option<TrainId>,
    ) -> anyhow::Result<Vec<Recording>> {
        Ok(Self::read_all(paths, sensors, train)?.into_iter().map(|log| log.recording).collect())
    }
}
