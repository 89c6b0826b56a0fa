//! What a railway reported and was commanded, as read from a file: raw, in order, run by run.
//!
//! Nothing is judged here. A sensor that repeats in every poll while the shoe stands on it is an event each
//! time; the stale detection that a station still remembers from before the start is an event; a run without a
//! single report is a run. What they mean is for the core to decide.

use core::fmt;
use std::collections::BTreeSet;

use footplate_core::{Event, EventKind, Report, RunId, SpeedStep, Timestamp, TrainId};

/// One file of measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// What to call it: the name of its file without folder and ending.
    pub name: String,
    /// How it was written down.
    pub form: Form,
    /// Its runs in the order of the file. Times of different runs must not be compared: see [`Run::events`].
    pub runs: Vec<Run>,
    /// What was odd in the file, and what was done about it.
    pub notes: Vec<Note>,
}

/// How a sensor log is written down; `docs/formats/sensor-log.md` describes each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// Footplate's own sensor log: a row an event, with its kind.
    SensorLog,
    /// Reports timed from the command that began their run, with the ticks of the timer behind them.
    SinceCommand,
    /// Reports of a train already running on the host's clock, and passes of light gates on a clock of theirs.
    LightGate,
}

impl Recording {
    /// The trains that its runs know, each once.
    pub fn trains(&self) -> impl Iterator<Item = TrainId> + '_ {
        let known: BTreeSet<TrainId> =
            self.runs.iter().flat_map(|run| run.trains.iter().map(|at_start| at_start.train)).collect();
        known.into_iter()
    }
}

impl Form {
    /// Its name in files and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::SensorLog => "sensor-log",
            Self::SinceCommand => "since-command",
            Self::LightGate => "light-gate",
        }
    }
}

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One stretch of a recording in which the clock is continuous and no train is lifted.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its number in the recording.
    pub id: RunId,
    /// When its clock stood at zero, since the Unix epoch, where the recording tells.
    pub began_at: Option<Timestamp>,
    /// The trains that take part, and what they did when the run began.
    pub trains: Vec<TrainAtStart>,
    /// What was reported and commanded, in order; times count from an origin that only this run has.
    pub events: Vec<RawEvent>,
    /// Passes of light gates: truth for a score, never for an estimator.
    pub gates: Vec<GatePass>,
}

impl Run {
    /// The train of a run in which there is only one.
    pub fn only_train(&self) -> Option<TrainAtStart> {
        match self.trains.as_slice() {
            [only] => Some(*only),
            _ => None,
        }
    }

    /// The trains that move, and what they did when the run began: those that stand all the time close no sensor.
    pub fn moving(&self) -> Vec<TrainAtStart> {
        let begin = self.trains.iter().copied();
        let mut moving: Vec<TrainAtStart> =
            begin.filter(|at_start| at_start.step != SpeedStep::STAND).collect();
        for raw in &self.events {
            if let EventKind::Speed { train, step } = raw.event.kind
                && step != SpeedStep::STAND
                && moving.iter().all(|known| known.train != train)
            {
                moving.push(TrainAtStart { train, step: SpeedStep::STAND });
            }
        }
        moving
    }

    /// The train that the reports of a run are of: the only one there is, or the only one that moves. A live session names no
    /// trains at its start, and one that stands all the time trips no sensor.
    pub fn reported_train(&self) -> Option<TrainAtStart> {
        self.only_train().or_else(|| match self.moving().as_slice() {
            [only] => Some(*only),
            _ => None,
        })
    }

    /// The sensors that were reported, repeats included.
    pub fn reports(&self) -> impl Iterator<Item = (Timestamp, Report)> + '_ {
        self.events.iter().filter_map(|raw| match raw.event.kind {
            EventKind::Sensor(report) => Some((raw.event.time, report)),
            _ => None,
        })
    }
}

/// What a train was doing when its run began.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TrainAtStart {
    /// The train.
    pub train: TrainId,
    /// The step it had been running at for long, or [`SpeedStep::STAND`] at rest.
    pub step: SpeedStep,
}

/// An event and the line of the file that tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawEvent {
    /// The line, counted from 1, the header included.
    pub line: u64,
    /// What happened; its time counts from the origin of the run.
    pub event: Event,
}

/// A train crossed a light gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GatePass {
    /// The line of the file that tells it.
    pub line: u64,
    /// The gate's number.
    pub gate: u8,
    /// When, on the clock of the gates: their origin is not the run's, and nothing ties the two together.
    pub time: Timestamp,
}

/// Something odd in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// The line that shows it, counted from 1.
    pub line: u64,
    /// What it is.
    pub oddity: Oddity,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.oddity)
    }
}

/// What can be odd in a file that is read all the same. Displayed, it says what was done about it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Oddity {
    /// Columns that no reader knows.
    UnknownColumns(Vec<String>),
    /// The timer behind the times began anew between two runs.
    TimerRestarted(RunId),
    /// Nothing was reported in a run.
    NoReports(RunId),
    /// The last line has all its columns but no end.
    LineNotEnded,
    /// The last line breaks off before its end.
    LineCutOff,
}

impl fmt::Display for Oddity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownColumns(names) => write!(f, "unknown columns are ignored: {}", names.join(", ")),
            Self::TimerRestarted(run) => {
                write!(f, "the timer restarts before run {run}; every run keeps its own clock")
            }
            Self::NoReports(run) => {
                write!(f, "run {run} has no report; kept, it tells that the train stood")
            }
            Self::LineNotEnded => f.write_str("the last line has no end of line; kept unchanged"),
            Self::LineCutOff => f.write_str("the last line is cut off; left out"),
        }
    }
}
