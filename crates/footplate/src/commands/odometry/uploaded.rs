//! A recording that somebody sent: walked as files are, and its page.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use anyhow::{Context, bail};
use footplate_store::odometry::{Preset, RunContext};
use footplate_store::{VehicleFile, default_vehicle, parse_vehicle};

use super::recording::OpenRecording;
use super::report;
use super::walked::Walked;
use crate::commands::web_page::Language;
use crate::error_text::error_text;

/// Recordings that were sent to this process, so that two of one name are two files.
static SENT: AtomicU32 = AtomicU32::new(0);

/// Charts of as many runs as there are in one page.
const MOST_RUNS: usize = report::MOST_RUNS;

/// A folder that is removed when it is dropped.
pub(crate) struct PassingFolder(PathBuf);

impl PassingFolder {
    /// # Errors
    /// There is no room for it.
    pub(crate) fn make() -> std::io::Result<Self> {
        let number = SENT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("footplate-{}-{number}", std::process::id()));
        fs::create_dir(&folder)?;
        Ok(Self(folder))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for PassingFolder {
    fn drop(&mut self) {
        // What cannot be removed is left to the system, which cleans its folder of temporary files.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The page of a recording: CSV or Parquet by the ending of its name; `vehicle` is the text of a vehicle file.
///
/// # Errors
/// What is wrong with the recording or the vehicle, with its place.
pub(crate) fn uploaded_page(
    name: &str,
    bytes: &mut impl Read,
    vehicle: Option<&str>,
    language: Language,
) -> anyhow::Result<String> {
    let has_vehicle = vehicle.is_some();
    let vehicle = match vehicle {
        Some(text) => parse_vehicle("the vehicle's file", text.as_bytes())?,
        None => default_vehicle()?,
    };
    let name = Path::new(name).file_name().and_then(|name| name.to_str()).unwrap_or_default();
    if !(name.ends_with(".csv") || name.ends_with(".parquet")) {
        bail!("`{name}` should be a recording whose name ends with .csv or .parquet");
    }
    // In a folder of its own, so that the file is called in messages as it was called where it came from.
    let folder = PassingFolder::make().with_context(|| format!("making room for `{name}`"))?;
    let file = folder.path().join(name);
    std::io::copy(bytes, &mut fs::File::create_new(&file)?)?;
    walked_page(&file, vehicle, has_vehicle, language).map_err(|error| {
        // The folder has a name that no user knows.
        let said = error_text(&error).replace(&file.display().to_string(), name);
        anyhow::Error::msg(said)
    })
}

fn walked_page(
    path: &Path,
    vehicle: VehicleFile,
    has_vehicle: bool,
    language: Language,
) -> anyhow::Result<String> {
    let preset = Preset::Recommended;
    let recording = OpenRecording::open(path, false, None)?;
    let context = RunContext::new(vehicle.vehicle, preset, recording.has_truth());
    let mut charts_left = MOST_RUNS;
    let recordings = vec![recording.walk(&context, None, &mut charts_left)?];
    let vehicle = vehicle.name;
    let confidence = context.confidence;
    let is_scored = context.score;
    let walked = Walked { vehicle, preset, recordings, has_vehicle, confidence, language, is_scored };
    Ok(report::page(&walked)?)
}
