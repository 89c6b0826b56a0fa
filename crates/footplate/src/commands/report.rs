//! `footplate report`: what is known of trains as one page with charts that opens in any browser, without a network.

mod charts;
mod data;
mod forecasts;
mod german_law;
mod health;
mod page;
mod tables;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use footplate_core::TrainId;
use footplate_core::track::Layout;
use footplate_store::{Batch, Findings, Run, Store, layout_named, write_whole};

use super::Outcome;
use super::calibrate::runs_left_out;
use super::log_file::LogFile;
use super::output_files::check_outputs;
use super::web_page::Language;
use crate::clock::LATEST;
use crate::layout_check::{LengthWarning, check_batch, check_runs};
use crate::standard_error::say;
use data::{ReportData, TrainReport};
use german_law::german_law;

/// Write a page with charts of what recordings show.
///
/// For every train: its state, speed by throttle step, the law by which it changes speed against the detections
/// measured, how far forecasts were off, stops, corrected lengths and suspicious measurements. The page is one
/// file, needs no network, and the same input makes the same bytes.
#[derive(Args)]
#[command(after_help = "\
Example:
  footplate report testdata/sensor-logs/*train24*.csv --layout track-a --out report.html")]
pub(crate) struct Arguments {
    /// Sensor logs (CSV), in any of the forms of docs/formats/sensor-log.md.
    #[arg(value_name = "LOG", required_unless_present = "store", conflicts_with = "store")]
    logs: Vec<PathBuf>,
    /// A built-in layout (track-a, track-b, oval-blocks) or a layout file (TOML).
    #[arg(long, value_name = "LAYOUT")]
    layout: String,
    /// Only this train; also the train of logs that name none, in their rows or their file name.
    #[arg(long, value_name = "N")]
    train: Option<u16>,
    /// Report on all that this store holds of the layout instead, less what was excluded.
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    /// The page to write (HTML).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The language of the page.
    #[arg(long, value_enum, default_value_t)]
    language: Language,
}

/// The runs of one recording, however they were kept.
struct Session {
    name: String,
    runs: Vec<Run>,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let inputs = self.logs.iter().chain(&self.store).map(PathBuf::as_path);
        check_outputs(inputs.chain([Path::new(&self.layout)]), &[("--out", Some(&self.out))])?;
        let layout = layout_named(&self.layout)?.layout;
        let train = self.train.map(TrainId);
        let (sessions, batch) = match &self.store {
            Some(path) => of_store(&layout, &Store::open_to_read(path)?, train)?,
            None => {
                let recordings = LogFile::recordings(&self.logs, &layout, train)?;
                let batch = Batch::of_recordings(&layout, &recordings, train)?;
                let session = |recording: footplate_store::Recording| Session {
                    name: recording.name,
                    runs: recording.runs,
                };
                (recordings.into_iter().map(session).collect(), batch)
            }
        };
        check_runs(&layout, sessions.iter().flat_map(|session| &session.runs))?;
        let language = self.language;
        let warning = check_batch(&layout, &batch)?;
        let outcome = LengthWarning::outcome(warning.as_ref());
        let data = gather(&layout, &sessions, &batch, warning.as_ref(), language)?;
        if let Some(left_out) = runs_left_out(&batch.left_out) {
            say!("{left_out}");
        }
        if let Some(warning) = &data.warning {
            writeln!(output, "{}: {warning}", language.pick("WARNING", "WARNUNG"))?;
        }
        write_whole(&self.out, page::page(&data, language)?.as_bytes())
            .with_context(|| format!("writing {}", self.out.display()))?;
        for train in &data.trains {
            let health = &train.health;
            writeln!(
                output,
                "{} {}: {}, {}",
                language.pick("train", "Zug"),
                train.calibration.train,
                health.state.word(language),
                health.summary
            )?;
        }
        let open = language.pick("open it in a browser", "in einem Browser öffnen");
        writeln!(output, "{}: {open}", self.out.display())?;
        Ok(outcome)
    }
}

/// All that a store holds of a layout.
fn of_store(layout: &Layout, store: &Store, train: Option<TrainId>) -> anyhow::Result<(Vec<Session>, Batch)> {
    let mut sessions = Vec::new();
    for recording in
        store.recordings(LATEST)?.into_iter().filter(|recording| recording.layout == layout.name())
    {
        let runs = store.runs(recording.key, LATEST)?;
        sessions.push(Session {
            name: recording.name,
            runs: runs.iter().map(footplate_store::StoredRun::accepted).collect(),
        });
    }
    Ok((sessions, Batch::of_store(layout, store, LATEST, train)?))
}

/// What a store holds of one train, as the charts of a report read it.
///
/// # Errors
/// The store cannot be read, or holds nothing of the train.
pub(super) fn store_report(
    layout: &Layout,
    store: &Store,
    train: TrainId,
    language: Language,
) -> anyhow::Result<String> {
    let (sessions, batch) = of_store(layout, store, Some(train))?;
    let warning = check_batch(layout, &batch)?;
    let data = gather(layout, &sessions, &batch, warning.as_ref(), language)?;
    let found = data.trains.into_iter().next();
    Ok(serde_json::to_string(&found.with_context(|| format!("nothing of train {train} was recorded yet"))?)?)
}

fn gather(
    layout: &Layout,
    sessions: &[Session],
    batch: &Batch,
    warning: Option<&LengthWarning>,
    language: Language,
) -> anyhow::Result<ReportData> {
    let findings = Findings::of(layout, batch);
    let trains = findings.trains.iter().zip(&batch.trains).map(|(form, train)| {
        let mut calibration = form.clone();
        if language == Language::German {
            for law in &mut calibration.laws {
                law.best.name = german_law(law.best.law);
            }
        }
        let forecasts = forecasts::of_train(layout, sessions, form.train)?;
        Ok(TrainReport {
            health: health::of(form, &forecasts, warning, language),
            changes: charts::changes(batch, train),
            stop_curve: charts::stop_curve(form),
            calibration,
            forecasts,
        })
    });
    Ok(ReportData {
        warning: warning.map(|warning| match language {
            Language::English => warning.english.clone(),
            Language::German => warning.german.clone(),
        }),
        trains: trains.collect::<anyhow::Result<_>>()?,
        layout: findings.layout,
        polling: findings.polling,
    })
}
