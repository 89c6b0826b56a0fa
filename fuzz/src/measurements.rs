//! Any bytes as a table of measurements: each reader refuses them with the name of the file, or reads them.

use std::path::PathBuf;

use footplate_store::accelerometer::{AccelerometerRecording, StopMarks};
use footplate_store::{MotionFile, PositionSeries, TapedMoves, read_published_table};

/// What every refusal begins with, unless the file has a path.
const FILE: &str = "table.csv";

fn is_named(error: &impl ToString) {
    let message = error.to_string();
    assert!(message.contains(FILE), "{message}");
}

pub(crate) fn accelerometer(bytes: &[u8]) {
    let _ = AccelerometerRecording::parse(FILE, bytes).inspect_err(is_named);
    let _ = StopMarks::parse(FILE, bytes).inspect_err(is_named);
}

pub(crate) fn position_series(bytes: &[u8]) {
    let _ = PositionSeries::parse(FILE, bytes).inspect_err(is_named);
}

pub(crate) fn short_moves(bytes: &[u8]) {
    let _ = TapedMoves::parse(FILE, bytes).inspect_err(is_named);
}

pub(crate) fn published_table(bytes: &[u8]) {
    let file = File::of(FILE, bytes);
    let _ = read_published_table(&file.0).inspect_err(is_named);
}

/// A motion model in both of its forms; one that is read can be written and read again.
pub(crate) fn motion_file(bytes: &[u8]) {
    for name in ["model.toml", "model.json"] {
        let file = File::of(name, bytes);
        match MotionFile::read(&file.0) {
            Ok(model) => {
                model.write(&file.0).expect("a model that was read can be written");
                MotionFile::read(&file.0).expect("a model that was written can be read");
            }
            Err(error) => assert!(error.to_string().contains(name), "{error}"),
        }
    }
}

/// A file of the readers that open their files themselves; it is removed with this.
struct File(PathBuf);

impl File {
    fn of(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("footplate-fuzz-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).expect("a temporary file can be written");
        Self(path)
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}
