//! Recorded sensor logs through the full estimator: what one entry of a log costs, forecasts and their scores
//! included.
//!
//! An entry is a report of a sensor, repeats included, or a command. For every passage the estimator learns, and
//! it is counted in which of the stated intervals the report lay and how far off it was; everything that a live
//! run needs, and no rival.

use std::path::{Path, PathBuf};

use footplate_core::track::Layout;
use footplate_core::tracking::{Hit, Predictor};
use footplate_store::score::LEVELS;
use footplate_store::{LogContext, Run, built_in, read_sensor_log};

use crate::operation::Operation;

const GROUP: &str = "an entry of a sensor log";

/// Where the recordings of real trains stand.
const LOGS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/sensor-logs");
/// The log of laps at settled speeds.
const LAPS: &str = "eadanila_2020_track_a";

/// All of them.
///
/// # Panics
/// When the recordings of the project or its built-in layout cannot be read.
pub fn operations() -> Vec<Operation> {
    let layout = built_in("track-a").expect("the layout is built in").layout;
    let logs = logs(&layout);
    let laps = logs.iter().filter(|log| log.name == LAPS).cloned().collect();
    let operation = |means, logs, kept| {
        let mut replay = Replay::new(layout.clone(), logs, kept);
        Operation::with_body(GROUP, means, move |count| replay.entries(count))
    };
    vec![
        operation("every log begun with nothing known", logs.clone(), Kept::Nothing),
        operation("one estimator through all logs", logs, Kept::Everything),
        operation("one estimator through laps at settled speeds", laps, Kept::Everything),
    ]
}

/// One recording.
#[derive(Clone)]
struct Log {
    name: String,
    runs: Vec<Run>,
}

fn logs(layout: &Layout) -> Vec<Log> {
    let entries = Path::new(LOGS).read_dir().expect("the recordings are there");
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "csv"));
    paths.sort();
    let read = |path: &PathBuf| {
        let context = LogContext { sensors: layout, train: None };
        let recording = read_sensor_log(path, context).expect("the recordings can be read");
        Log { name: recording.name, runs: recording.runs }
    };
    paths.iter().map(read).collect()
}

/// What the estimator keeps from one log to the next.
#[derive(Clone, Copy, PartialEq)]
enum Kept {
    Nothing,
    Everything,
}

/// An endless walk through logs, which begin again after the last.
struct Replay {
    layout: Layout,
    logs: Vec<Log>,
    kept: Kept,
    knows_nothing: Predictor,
    predictor: Predictor,
    /// Log, run and entry that are next.
    place: (usize, usize, usize),
    score: Score,
}

/// What is kept of all hits.
#[derive(Default)]
struct Score {
    inside: [u64; LEVELS.len()],
    off_mm: f64,
}

impl Score {
    fn take(&mut self, hit: &Hit) {
        let Some(forecast) = hit.forecast else { return };
        let reported = hit.passage.window.until;
        let level = (2.0 * forecast.probability_by(reported) - 1.0).abs();
        for (count, stated) in self.inside.iter_mut().zip(LEVELS) {
            *count += u64::from(level <= stated);
        }
        self.off_mm += forecast.place_error(reported).as_mm().abs();
    }
}

impl Replay {
    fn new(layout: Layout, logs: Vec<Log>, kept: Kept) -> Self {
        let knows_nothing = Predictor::new(&layout);
        let predictor = knows_nothing.clone();
        Self { layout, logs, kept, knows_nothing, predictor, place: (0, 0, 0), score: Score::default() }
    }

    /// The next entries; gives a number that depends on all scores.
    fn entries(&mut self, count: usize) -> f64 {
        for _ in 0..count {
            self.entry();
        }
        self.score.off_mm + self.score.inside.iter().sum::<u64>() as f64
    }

    fn entry(&mut self) {
        loop {
            let (log, run, entry) = self.place;
            let Some(runs) = self.logs.get(log).map(|log| &log.runs) else {
                self.place = (0, 0, 0);
                continue;
            };
            let Some(of_run) = runs.get(run) else {
                self.place = (log + 1, 0, 0);
                continue;
            };
            let Some(raw) = of_run.events.get(entry) else {
                self.predictor.end_run();
                self.place = (log, run + 1, 0);
                continue;
            };
            if entry == 0 {
                if run == 0 && self.kept == Kept::Nothing {
                    self.predictor.clone_from(&self.knows_nothing);
                }
                if let Some(at_start) = of_run.only_train() {
                    self.predictor.begin_run(at_start.train, at_start.step);
                }
            }
            self.place = (log, run, entry + 1);
            if let Some(hit) = self.predictor.take(&self.layout, &raw.event) {
                self.score.take(&hit);
            }
            return;
        }
    }
}
