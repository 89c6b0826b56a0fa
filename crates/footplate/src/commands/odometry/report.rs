//! What recordings come to, as one page with charts.

mod still;
mod tables;

use std::ffi::OsStr;
use std::io;
use std::path::Path;

use footplate_store::write_whole;
use serde::Serialize;

use super::run_series::{MOST_POINTS, SeriesForm};
use super::walked::Walked;
use crate::commands::web_page::{Language, WebPage};
pub(super) use still::still;

const CHARTS: &str = include_str!("../../../assets/odometry/odometry.js");
const STYLE: &str = include_str!("../../../assets/odometry/odometry.css");

/// Most runs with charts (chosen: as many as a person picks from a list).
pub(super) const MOST_RUNS: usize = 32;
/// Runs that have all points; more share the points of so many, so that the page stays below some ten megabytes.
const WHOLE_RUNS: usize = 8;

/// Everything that charts show.
#[derive(Debug, Serialize)]
struct PageForm {
    runs: Vec<RunForm>,
}

/// A run as its charts show it.
#[derive(Debug, Serialize)]
struct RunForm {
    name: String,
    /// The probability of its intervals in per cent.
    confidence_pct: String,
    #[serde(flatten)]
    series: SeriesForm,
}

/// Writes the page: a reader finds the old one or the new one.
///
/// # Errors
/// What the system said.
pub(super) fn write(path: &Path, walked: &Walked) -> io::Result<()> {
    write_whole(path, page(walked)?.as_bytes())
}

/// The page.
///
/// # Errors
/// Its numbers cannot be written as JSON.
pub(super) fn page(walked: &Walked) -> serde_json::Result<String> {
    let runs = || walked.recordings.iter().flat_map(|recording| recording.runs.iter());
    let charted = runs().filter(|run| run.series.is_some()).count();
    let most = MOST_POINTS * WHOLE_RUNS / charted.max(WHOLE_RUNS);
    let several = walked.recordings.len() > 1;
    let of_recordings = walked.recordings.iter().flat_map(|recording| {
        recording.runs.iter().filter_map(move |run| {
            let name = tables::run_name(recording, run, several);
            Some(RunForm {
                name,
                confidence_pct: walked.confidence_pct(),
                series: run.series.as_ref()?.form(most),
            })
        })
    });
    let form = PageForm { runs: of_recordings.collect() };
    let title = match walked.recordings.as_slice() {
        [only] => {
            // Where it was is no more than a nuisance to the reader of the page.
            let name = Path::new(&only.file).file_name();
            let of = walked.language.pick("Odometry of", "Odometrie von");
            format!("{of} {}", name.map_or(only.file.as_str().into(), OsStr::to_string_lossy))
        }
        several => match walked.language {
            Language::English => format!("Odometry of {} recordings", several.len()),
            Language::German => format!("Odometrie von {} Aufzeichnungen", several.len()),
        },
    };
    let page = WebPage {
        language: walked.language,
        title: &title,
        introduction: &tables::introduction(walked),
        main: &tables::main(walked, charted),
        style: STYLE,
        script: CHARTS,
    };
    page.html(&form)
}
