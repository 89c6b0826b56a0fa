//! `footplate calibrate`: recordings in, or a train on a layout, and speeds, laws, stops and lengths with their uncertainty
//! out.

mod explain;
mod live;
mod measured_by_hand;
mod picture;
mod series;
mod short_moves;
mod table;
mod two_sensor;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use footplate_core::model::MotionModel;
use footplate_core::track::Layout;
use footplate_core::{TimeSpan, TrainId};
use footplate_store::{
    Batch, BatchTrain, Findings, Import, LeftOut, Recording, Store, StoredModel, layout_named,
};

use super::Outcome;
use super::left_running::stop_left_running;
use super::log_file::LogFile;
use super::output_files::check_outputs;
use super::plot::PictureFile;
use crate::clock::{LATEST, Moment, now};
use crate::counted::counted;
use crate::dashboard::ServedAt;
use crate::layout_check::{LengthWarning, check_batch, check_runs};
use crate::link::{Address, NamedTrain};
use crate::standard_error::say;
pub(super) use explain::Question;
pub(crate) use live::CalibrationBeginning;
pub(super) use live::{calibration_line, minutes};
use measured_by_hand::Given;
pub(super) use picture::draw_calibration;

/// More runs that are left out tell a person nothing new.
const MOST_NAMED: usize = 4;

/// How a calibration from recordings finds out how trains change their speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// The motion model, fitted to everything a train did.
    Motion,
    /// The acceleration of each change of speed, from the time between two sensors, beside that of the motion model.
    TwoSensor,
    /// Short moves: when to command the stop so that the train gets so far.
    ShortMoves,
}

/// Calibrate a train on a layout, or trains from recorded sensor reports.
///
/// With --link, Footplate locates the train, drives it by a plan that it makes as it learns, and leaves it at rest
/// within the budget: speeds and stops by throttle step, with their uncertainties. From recordings: the same motion model of
/// each train, and beside it the laws that describe its changes of speed, residuals and corrected lengths. Every number has
/// one standard deviation and the number of measurements behind it.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate calibrate --link sim:track-a?seed=7 --layout track-a --train 24 --store railway.db
  footplate calibrate --link sim:track-a?seed=7&speed=5 --layout track-a --train 24 --serve
  footplate calibrate --link marklin-serial:/dev/ttyUSB0 --layout track-a --train 24 --budget 5m --store railway.db
  footplate calibrate --from testdata/sensor-logs/*train24*.csv --layout track-a
  footplate calibrate --from testdata/position-series/cs452_2015_stop_1.csv
  footplate calibrate --from testdata/short-moves/cs452_2023_train58_step8.csv
  footplate calibrate --from session.csv --layout track-a --store railway.db
  footplate calibrate --from session.csv --layout track-a --method two-sensor
  footplate calibrate --store railway.db --layout track-a --train 24 --method short-moves
  footplate calibrate --store railway.db --layout track-a --train 24 --plot train24.svg
  footplate calibrate --store railway.db --layout track-a --explain SPEED:14")]
pub(crate) struct Arguments {
    /// Sensor logs (CSV), in any of the forms of docs/formats/sensor-log.md; or, without a layout, series of positions of
    /// one start or stop each (docs/formats/position-series.md) or measured short moves (docs/formats/short-moves.md).
    #[arg(long, value_name = "LOG", num_args = 1..)]
    from: Vec<PathBuf>,
    /// Drive the train over this link: sim:track-a?seed=7, marklin-serial:/dev/ttyUSB0, dcc-ex:/dev/ttyACM0,
    /// z21:192.168.0.111, marklin-can:192.168.0.5, loconet:192.168.0.20, jmri:192.168.0.20, or tcp://host:port in place of a device.
    #[arg(long, value_name = "URL", conflicts_with_all = ["from", "as_of", "explain"], requires = "train")]
    link: Option<Address>,
    /// Track time that driving may take, such as 5m or 90s.
    #[arg(long, value_name = "TIME", default_value = "5m", value_parser = live::budget, requires = "link")]
    budget: TimeSpan,
    /// Show it live in a browser: at a port of this machine (8417 unless named, 0 for any that is free), or at an address.
    /// Then a simulated layout keeps real time.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "", requires = "link")]
    serve: Option<ServedAt>,
    /// The set-up that this calibration is a step of; `footplate serve` gives it.
    #[arg(long, value_name = "FILE", hide = true, requires = "serve")]
    set_up: Option<PathBuf>,
    /// Begin from nothing, even if the store knows the train already.
    #[arg(long, requires = "link")]
    afresh: bool,
    /// Set all turnouts straight before the train moves, so that it runs onto none of unknown position. No train may
    /// be standing on a turnout.
    #[arg(long, requires = "link")]
    set_turnouts: bool,
    /// A built-in layout (track-a, track-b, oval-blocks) or a layout file (TOML).
    #[arg(long, value_name = "LAYOUT")]
    layout: Option<String>,
    /// What to find in recordings: the motion model, accelerations from pairs of sensors, or short moves.
    #[arg(long, value_enum, default_value_t = Method::Motion, conflicts_with_all = ["link", "plot", "explain"])]
    method: Method,
    /// Only this train; also the train of logs that name none, in their rows or their file name.
    #[arg(long, value_name = "N")]
    train: Option<NamedTrain>,
    /// Keep recordings and calibration in this store, and calibrate from all that it holds of the layout. With --as-of,
    /// --explain or a --method the calibration itself is not kept: trains are driven by the one that is.
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    /// Calibrate as of this date: from what the store held then.
    #[arg(long, value_name = "DATE", requires = "store", conflicts_with = "from")]
    as_of: Option<Moment>,
    /// Write the motion model to a file, TOML or JSON by its ending; models of several trains to a file each, as
    /// model-24.toml.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw speeds and stops by step to this file, SVG or PNG by its ending.
    #[arg(long, value_name = "FILE", conflicts_with = "explain")]
    plot: Option<PictureFile>,
    /// List the measurements behind a number instead: SPEED:STEP, STOP:STEP, LAW:up, LAW:down or
    /// LENGTH:FROM-TO.
    #[arg(long, value_name = "NUMBER")]
    explain: Option<Question>,
    /// Print the calibration as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(crate) const fn link(&self) -> Option<&Address> {
        self.link.as_ref()
    }

    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        if let (Some(link), Some(train)) = (&self.link, self.train) {
            return self.drive(link, train, output);
        }
        if self.from.is_empty() && self.store.is_none() && self.link.is_none() {
            bail!(
                "nothing to calibrate: drive a train with `--link URL --train N --layout LAYOUT`, read recordings with `--from \
                 LOG --layout LAYOUT`, or what a store keeps with `--store FILE --layout LAYOUT`"
            );
        }
        self.check_outputs()?;
        match Given::read(&self.from)? {
            Given::Logs => {}
            Given::Positions(series) => {
                self.check_measured_by_hand("a series of positions", None)?;
                series::write(&series, self.json, output)?;
                return Ok(Outcome::Done);
            }
            Given::ShortMoves(files) => {
                self.check_measured_by_hand("a file of short moves", Some(Method::ShortMoves))?;
                short_moves::write_measured(&files, self.json, output)?;
                return Ok(Outcome::Done);
            }
        }
        let layout = layout_named(self.layout()?)?.layout;
        let train = self.train.map(|named| named.train);
        let logs = LogFile::read_all(&self.from, &layout, train)?;
        check_runs(&layout, logs.iter().flat_map(|log| &log.recording.runs))?;
        let mut outcome = Outcome::Done;
        let (batch, mut store) = match &self.store {
            None => {
                let recordings: Vec<Recording> = logs.into_iter().map(|log| log.recording).collect();
                (Batch::of_recordings(&layout, &recordings, train)?, None)
            }
            Some(path) => {
                // Without logs to keep in it, a store that is not there is a mistyped one.
                let mut store = match (self.from.is_empty(), self.is_kept()) {
                    (false, _) => Store::open_or_create(path)?,
                    (true, true) => Store::open(path)?,
                    (true, false) => Store::open_to_read(path)?,
                };
                store.check()?;
                if import(&layout, &logs, &mut store)? == Outcome::FallsShort {
                    outcome = Outcome::FallsShort;
                }
                let as_of = self.as_of.map_or(LATEST, |moment| moment.0);
                (Batch::of_store(&layout, &store, as_of, train)?, Some(store))
            }
        };
        let warning = check_batch(&layout, &batch)?;
        if LengthWarning::outcome(warning.as_ref()) == Outcome::FallsShort {
            outcome = Outcome::FallsShort;
        }
        if let Some(warning) = warning.as_ref().filter(|_| !self.json) {
            writeln!(output, "WARNING: {}\n", warning.english)?;
        }
        let left_out = runs_left_out(&batch.left_out);
        if let Some(left_out) = left_out.as_ref().filter(|_| !self.json) {
            writeln!(output, "{left_out}\n")?;
        }
        if let Some(store) = store.as_mut().filter(|_| self.is_kept()) {
            let made = now();
            for train in &batch.trains {
                match richer_model(&layout, store, &batch, train)? {
                    Some(reports) => say!(
                        "the stored model of train {} knows {reports} sensor reports, more than the runs that count here: it stays",
                        train.replay.fit.model().train()
                    ),
                    None => train.file(&layout).keep(store, made, made)?,
                }
            }
        }
        if let Some(path) = &self.out {
            for (train, path) in batch.trains.iter().zip(Self::model_files(path, &batch)) {
                train.file(&layout).write(&path)?;
            }
        }
        if self.method == Method::TwoSensor {
            two_sensor::write(&layout, &batch, self.json, output)?;
            return Ok(outcome);
        }
        if self.method == Method::ShortMoves {
            short_moves::write_calibrated(&batch, self.json, output)?;
            return Ok(outcome);
        }
        let report = Findings::of(&layout, &batch);
        if let Some(plot) = &self.plot {
            draw_calibration(&report, plot)?;
        }
        match &self.explain {
            Some(question) => question.answer(&layout, &batch, self.json, output)?,
            None if self.json => {
                let mut value = serde_json::to_value(&report)?;
                value["warnings"] = warning
                    .iter()
                    .map(|warning| warning.english.as_str())
                    .chain(left_out.as_deref())
                    .collect();
                writeln!(output, "{}", serde_json::to_string_pretty(&value)?)?;
            }
            None => table::write(&report, output)?,
        }
        Ok(outcome)
    }

    /// Calibrates a train over a link. What an earlier session left running is stopped before anything that can fail.
    fn drive(&self, link: &Address, train: NamedTrain, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let opened = stop_left_running(link, self.store.as_deref(), &[train.train])?;
        self.check_outputs()?;
        let session = live::Session {
            link,
            layout: self.layout()?,
            train: train.train,
            decoder: train.decoder,
            budget: self.budget,
            is_afresh: self.afresh,
            sets_turnouts: self.set_turnouts,
            serve: self.serve.as_ref(),
            set_up: self.set_up.as_ref(),
            store: self.store.as_deref(),
            out: self.out.as_deref(),
            plot: self.plot.as_ref(),
            is_json: self.json,
        };
        session.run(opened, output)
    }

    fn layout(&self) -> anyhow::Result<&str> {
        self.layout.as_deref().context(
            "which layout are the sensors on? Add `--layout`: a built-in one (track-a, track-b, oval-blocks) or a layout file; \
             positions from a video, which need none, have the columns t_s and position_mm",
        )
    }

    fn check_outputs(&self) -> anyhow::Result<()> {
        let inputs = self.from.iter().chain(&self.store).map(PathBuf::as_path);
        check_outputs(
            inputs.chain(self.layout.as_deref().map(Path::new)),
            &[("--out", self.out.as_deref()), ("--plot", self.plot.as_ref().map(PictureFile::path))],
        )
    }

    /// Where models of the batch's trains go: one train's to the file itself, several to a file each with the train's number
    /// before the ending.
    fn model_files(path: &Path, batch: &Batch) -> Vec<PathBuf> {
        if let [_] = batch.trains.as_slice() {
            return vec![path.to_path_buf()];
        }
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let ending = path.extension().map_or_else(String::new, |of| format!(".{}", of.to_string_lossy()));
        let name = |train: TrainId| path.with_file_name(format!("{stem}-{train}{ending}"));
        batch.trains.iter().map(|train| name(train.replay.fit.model().train())).collect()
    }

    /// What is measured by hand is of no layout, so that most options mean nothing for it.
    fn check_measured_by_hand(&self, what: &str, method: Option<Method>) -> anyhow::Result<()> {
        let given = [
            ("--layout", self.layout.is_some()),
            ("--train", self.train.is_some()),
            ("--store", self.store.is_some()),
            ("--out", self.out.is_some()),
            ("--method", self.method != Method::Motion && Some(self.method) != method),
            ("--plot", self.plot.is_some()),
            ("--explain", self.explain.is_some()),
        ];
        if let Some((option, _)) = given.iter().find(|(_, is_given)| *is_given) {
            bail!("{option} does not work with {what}, which names no sensors: leave it out");
        }
        Ok(())
    }

    /// Whether the models become those that trains are driven by: not if the question is one about the past, or another one
    /// than how the trains run.
    fn is_kept(&self) -> bool {
        self.as_of.is_none() && self.explain.is_none() && self.method == Method::Motion
    }
}

/// The sentence that names runs of a store that teach nothing.
pub(super) fn runs_left_out(left_out: &[LeftOut]) -> Option<String> {
    let named = left_out.iter().take(MOST_NAMED).map(|one| format!("{}, run {}", one.recording, one.run));
    let named = named.collect::<Vec<_>>().join("; ");
    let more = if left_out.len() > MOST_NAMED { "; and others" } else { "" };
    (!left_out.is_empty()).then(|| {
        format!(
            "left out, because several trains moved and their reports cannot be assigned: {} ({named}{more})",
            counted(left_out.len(), "run")
        )
    })
}

/// How many sensor reports the stored model of a train knows, if these are more than the new one knows because runs of the train
/// were left out.
fn richer_model(
    layout: &Layout,
    store: &Store,
    batch: &Batch,
    train: &BatchTrain,
) -> anyhow::Result<Option<u32>> {
    let new = train.replay.fit.model();
    if batch.left_out.iter().all(|left_out| !left_out.trains.contains(&new.train())) {
        return Ok(None);
    }
    let StoredModel::Model(stored) = StoredModel::of_store(layout, store, new.train(), LATEST)? else {
        return Ok(None);
    };
    let reports = sensor_reports(&stored);
    Ok((reports > sensor_reports(new)).then_some(reports))
}

/// The sensor reports that a model was fitted to.
fn sensor_reports(model: &MotionModel) -> u32 {
    model.numbers().counts.iter().flatten().map(|(reports, _)| reports).sum()
}

/// Imports logs into the store; falls short if the store keeps one otherwise than it was read now.
fn import(layout: &Layout, logs: &[LogFile], store: &mut Store) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::Done;
    for log in logs {
        let imported = store.import(&log.recording, log.content, layout.name(), now())?;
        let Import::AlreadyThere { recording, .. } = imported else { continue };
        match log.kept_otherwise(store, recording, layout)? {
            Some(kept) => {
                say!("{kept}");
                outcome = Outcome::FallsShort;
            }
            None => say!("{}: in the store already, not added again", log.path.display()),
        }
    }
    Ok(outcome)
}
