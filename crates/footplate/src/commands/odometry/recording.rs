//! One recording through the odometer, every run of it.

use std::io;
use std::path::Path;
use std::sync::atomic::Ordering;

use anyhow::bail;
use footplate_core::TimeSpan;
use footplate_core::odometry::wheels::Vehicle;
use footplate_store::odometry::{OdometryRun, RunContext};
use footplate_store::{ColumnMapping, TachometerBlock, TachometerNote, TachometerReader, TimeFaults};

use super::STANDARD;
use super::block_stream::each_block;
use super::results::Results;
use super::run_series::{MOST_POINTS, RunSeries};
use crate::progress::with_progress;
use crate::standard_error::say;

/// Rows this much further apart than claimed, or nearer, have another period: clocks and jitter differ by less.
const OTHER_PERIOD: f64 = 0.1;

/// A recording whose columns are known and whose rows are not read yet.
pub(super) struct OpenRecording {
    file: String,
    /// Whether rows of results name the file before the run: runs of other files may have the same `run_id`.
    names_file: bool,
    reader: TachometerReader,
}

/// How a recording with columns of other names is read.
#[derive(Clone, Copy)]
pub(super) struct Mapped<'m> {
    pub(super) mapping: &'m ColumnMapping,
    /// Whose wheels turn the recorded speeds.
    pub(super) vehicle: &'m Vehicle,
}

/// What a recording comes to.
pub(super) struct WalkedRecording {
    /// What messages call the file.
    pub(super) file: String,
    /// Whether rows of results name the file before the run.
    names_file: bool,
    /// Its runs in the order of first appearance.
    pub(super) runs: Vec<WalkedRun>,
    /// What was odd in it.
    pub(super) notes: Vec<TachometerNote>,
    /// How many rows had a time that makes no period.
    pub(super) time_faults: TimeFaults,
}

/// What a run comes to.
pub(super) struct WalkedRun {
    /// Its `run_id`, where the recording has that column.
    pub(super) id: Option<String>,
    /// What rows of results call it.
    pub(super) name: String,
    pub(super) odometry: OdometryRun,
    /// What its charts show, if they are wanted.
    pub(super) series: Option<RunSeries>,
}

impl OpenRecording {
    /// Opens a recording; with `score`, one that holds the truth.
    pub(super) fn open(path: &Path, score: bool, mapped: Option<Mapped<'_>>) -> anyhow::Result<Self> {
        let is_standard = path.as_os_str() == STANDARD;
        let file = if is_standard { "standard input".to_owned() } else { path.display().to_string() };
        let reader = match (mapped, is_standard) {
            (None, true) => TachometerReader::of_stream(&file, Box::new(io::stdin()))?,
            (None, false) => TachometerReader::open(path)?,
            (Some(Mapped { mapping, vehicle }), true) => {
                TachometerReader::mapped_stream(&file, Box::new(io::stdin()), mapping, vehicle)?
            }
            (Some(Mapped { mapping, vehicle }), false) => {
                TachometerReader::open_mapped(path, mapping, vehicle)?
            }
        };
        let recording = Self { file, names_file: false, reader };
        if score && !recording.has_truth() {
            bail!(
                "{}: --score needs the truth, and there is no column true_speed_m_s or true_distance_m",
                recording.file
            );
        }
        Ok(recording)
    }

    /// As one of so many recordings of a call.
    pub(super) fn one_of(self, recordings: usize) -> Self {
        Self { names_file: recordings > 1, ..self }
    }

    /// Whether its rows say which run they belong to.
    pub(super) fn has_run_ids(&self) -> bool {
        self.reader.columns().has_run_ids()
    }

    /// Whether its rows say what is true.
    pub(super) fn has_truth(&self) -> bool {
        let columns = self.reader.columns();
        columns.has_true_speed() || columns.has_true_distance()
    }

    /// Walks it; what is odd in it is said on standard error as it is found. The first `charts_left` runs are kept for
    /// charts, and then so many fewer are left.
    pub(super) fn walk(
        self,
        context: &RunContext,
        mut results: Option<&mut Results<'_>>,
        charts_left: &mut usize,
    ) -> anyhow::Result<WalkedRecording> {
        let has_run_ids = self.has_run_ids();
        let Self { file, names_file, reader } = self;
        let mut walked = WalkedRecording {
            file,
            names_file,
            runs: Vec::new(),
            notes: Vec::new(),
            time_faults: TimeFaults::default(),
        };
        let extent = reader.extent().and_then(|extent| usize::try_from(extent).ok());
        with_progress("estimating", extent.unwrap_or_default(), |done| {
            each_block(reader, |block| {
                if !has_run_ids && walked.runs.is_empty() {
                    walked.add_run(None, context, block.usual_step(0), charts_left)?;
                }
                walked.take(block, context, results.as_deref_mut(), charts_left)?;
                done.store(block.read_up_to, Ordering::Relaxed);
                Ok(())
            })
        })?;
        if !has_run_ids && walked.runs.is_empty() {
            walked.add_run(None, context, None, charts_left)?;
        }
        Ok(walked)
    }
}

/// The vehicle with the period that the rows have, if that is not the claimed one: otherwise longer steps would count as lost
/// rows, with distances up to twice the true one.
fn with_period_of_rows(claimed: Vehicle, step: TimeSpan) -> Option<Vehicle> {
    let ratio = step.as_s() / claimed.period.as_s();
    ((ratio - 1.0).abs() > OTHER_PERIOD).then_some(Vehicle { period: step, ..claimed })
}

impl WalkedRecording {
    fn add_run(
        &mut self,
        id: Option<&str>,
        context: &RunContext,
        step: Option<TimeSpan>,
        charts_left: &mut usize,
    ) -> anyhow::Result<()> {
        let has_charts = *charts_left > 0;
        *charts_left -= usize::from(has_charts);
        let name = match id {
            Some(id) if self.names_file => format!("{}: {id}", self.file),
            Some(id) => id.to_owned(),
            None => self.file.clone(),
        };
        let claimed = context.vehicle.period.as_s();
        // A step that no odometer works with is no period; the gaps are said.
        let other = step.and_then(|step| with_period_of_rows(context.vehicle, step)).and_then(|vehicle| {
            let odometry = OdometryRun::new(&RunContext { vehicle, ..*context }).ok()?;
            say!(
                "{name}: rows are {:.4} s apart, and period_s says {claimed:.4}: taken as {:.4} s; correct period_s in the \
                 vehicle file",
                vehicle.period.as_s(),
                vehicle.period.as_s()
            );
            Some(odometry)
        });
        self.runs.push(WalkedRun {
            id: id.map(ToOwned::to_owned),
            name,
            odometry: other.map_or_else(|| OdometryRun::new(context), Ok)?,
            series: has_charts.then(|| RunSeries::new(&context.vehicle, MOST_POINTS)),
        });
        Ok(())
    }

    fn take(
        &mut self,
        block: &TachometerBlock,
        context: &RunContext,
        mut results: Option<&mut Results<'_>>,
        charts_left: &mut usize,
    ) -> anyhow::Result<()> {
        for id in &block.new_runs {
            self.add_run(Some(id), context, block.usual_step(self.runs.len()), charts_left)?;
        }
        for note in &block.notes {
            say!("{}, {note}", self.file);
        }
        self.notes.extend_from_slice(&block.notes);
        self.time_faults = block.time_faults;
        for row in 0..block.len() {
            let Some(run) = self.runs.get_mut(block.run(row)) else { continue };
            let period = block.period(row);
            let estimate = run.odometry.step(&period, || block.truth(row));
            if let Some(series) = &mut run.series {
                series.push(&period, &estimate, &block.truth(row));
            }
            if let Some(results) = &mut results {
                results.push(&run.name, &estimate)?;
            }
        }
        if let Some(results) = results {
            results.end_block()?;
        }
        Ok(())
    }
}
