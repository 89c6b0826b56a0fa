//! Reads a sensor log once, for its events and its fingerprint.

use std::collections::BTreeSet;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::Context;
use footplate_core::TrainId;
use footplate_core::track::Layout;
use footplate_store::{
    ContentHash, HashingReader, LogContext, Recording, RecordingKey, SensorNames, Store, StoredRun,
    parse_sensor_log,
};

use crate::clock::LATEST;
use crate::reading::ProgressReader;
use crate::standard_error::say;

/// A sensor log and the fingerprint of its file.
pub(crate) struct LogFile {
    pub(crate) path: PathBuf,
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
            say!("{}, {note}", path.display());
        }
        Ok(Self { path: path.to_path_buf(), recording, content })
    }

    /// Reads every log; `train` applies to logs that name no train.
    pub(crate) fn read_each(
        paths: &[PathBuf],
        sensors: &dyn SensorNames,
        train: Option<TrainId>,
    ) -> anyhow::Result<Vec<Self>> {
        paths.iter().map(|path| Self::read(path, LogContext { sensors, train })).collect()
    }

    /// Reads all logs, each once: what is measured once counts once, in however many files it is given.
    pub(crate) fn read_all(
        paths: &[PathBuf],
        sensors: &dyn SensorNames,
        train: Option<TrainId>,
    ) -> anyhow::Result<Vec<Self>> {
        let mut logs: Vec<Self> = Vec::new();
        for log in Self::read_each(paths, sensors, train)? {
            match logs.iter().find(|earlier| earlier.content == log.content) {
                Some(earlier) => {
                    let (path, earlier) = (log.path.display(), earlier.path.display());
                    say!("{path}: has the same content as {earlier}, so it is counted once");
                }
                None => logs.push(log),
            }
        }
        Ok(logs)
    }

    /// What the store keeps of this log, which it has already as `kept`, if that differs from how the log was read now.
    ///
    /// # Errors
    /// The store cannot be read.
    pub(crate) fn kept_otherwise(
        &self,
        store: &Store,
        kept: RecordingKey,
        layout: &Layout,
    ) -> anyhow::Result<Option<String>> {
        let Some(recording) = store.recordings(LATEST)?.into_iter().find(|stored| stored.key == kept) else {
            return Ok(None);
        };
        let runs = store.runs(kept, LATEST)?;
        let of_run = |run: &StoredRun| run.accepted().trains.iter().map(|at_start| at_start.train).collect();
        let trains: BTreeSet<TrainId> = runs.iter().flat_map(|run| -> Vec<TrainId> { of_run(run) }).collect();
        let layout_differs = recording.layout != layout.name();
        let trains_differ = !self.recording.trains().eq(trains.iter().copied());
        if !layout_differs && !trains_differ {
            return Ok(None);
        }
        let named: Vec<String> = trains.iter().map(ToString::to_string).collect();
        Ok(Some(format!(
            "{}: the store keeps it as recording {kept} of layout {}, train {}, and does not change that: import it into \
             another store for another layout or train",
            self.path.display(),
            recording.layout,
            if named.is_empty() { "unknown".to_owned() } else { named.join(", ") },
        )))
    }

    /// The recordings of all logs, each once; `train` applies to logs that name no train.
    pub(crate) fn recordings(
        paths: &[PathBuf],
        sensors: &dyn SensorNames,
        train: Option<TrainId>,
    ) -> anyhow::Result<Vec<Recording>> {
        Ok(Self::read_all(paths, sensors, train)?.into_iter().map(|log| log.recording).collect())
    }
}
