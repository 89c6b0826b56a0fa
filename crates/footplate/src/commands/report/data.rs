//! What a report shows: as JSON for its charts, and as it is for its tables.

use footplate_store::{PollingForm, TrainFindings};
use serde::Serialize;

use crate::commands::web_page::Language;

/// The whole report.
#[derive(Debug, Serialize)]
pub(super) struct ReportData {
    /// What has to be known before any figure.
    #[serde(skip)]
    pub(super) warning: Option<String>,
    pub(super) layout: String,
    pub(super) polling: Vec<PollingForm>,
    pub(super) trains: Vec<TrainReport>,
}

/// One train.
#[derive(Debug, Serialize)]
pub(super) struct TrainReport {
    pub(super) calibration: TrainFindings,
    pub(super) health: Health,
    pub(super) changes: Vec<ChangeChart>,
    /// Speed (mm/s) and stopping distance (mm) by the motion model, step by step.
    pub(super) stop_curve: Vec<[f64; 2]>,
    pub(super) forecasts: Vec<ForecastPoint>,
}

/// How a train fares.
#[derive(Debug, Serialize)]
pub(super) struct Health {
    pub(super) state: State,
    /// What a person should know first.
    pub(super) summary: String,
    pub(super) checks: Vec<Check>,
}

/// One look at a train.
#[derive(Debug, Serialize)]
pub(super) struct Check {
    pub(super) name: &'static str,
    pub(super) found: String,
    pub(super) state: State,
    /// What the state means here.
    pub(super) says: &'static str,
}

/// How well something is, the worst last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum State {
    Green,
    Amber,
    Red,
}

impl State {
    /// The state for those who see no colours.
    pub(super) const fn word(self, language: Language) -> &'static str {
        match self {
            Self::Green => language.pick("good", "gut"),
            Self::Amber => language.pick("look at it", "ansehen"),
            Self::Red => language.pick("wrong", "falsch"),
        }
    }

    /// The state as a class of the style sheet.
    pub(super) const fn class(self) -> &'static str {
        match self {
            Self::Green => "green",
            Self::Amber => "amber",
            Self::Red => "red",
        }
    }
}

/// A change of speed: its law as curves, and the detections measured.
#[derive(Debug, Serialize)]
pub(super) struct ChangeChart {
    /// From which step to which.
    pub(super) steps: [u8; 2],
    pub(super) recording: String,
    pub(super) run: u32,
    /// Seconds since the command, mm since the first detection, mm/s, mm/s².
    pub(super) time_s: Vec<f64>,
    pub(super) way_mm: Vec<f64>,
    pub(super) speed_mm_s: Vec<f64>,
    pub(super) acceleration_mm_s2: Vec<f64>,
    pub(super) contacts: Vec<DetectionPoint>,
}

/// A detection during a change of speed.
#[derive(Debug, Serialize)]
pub(super) struct DetectionPoint {
    pub(super) time_s: f64,
    /// One standard deviation of it, from the poll.
    pub(super) doubt_s: f64,
    pub(super) way_mm: f64,
    /// How far beyond the law.
    pub(super) residual_mm: f64,
    /// One standard deviation of that.
    pub(super) doubt_mm: f64,
    /// Mean speed since the detection before, at the time in the middle.
    pub(super) mean_speed: Option<[f64; 2]>,
    pub(super) told_by: String,
}

/// A forecast and what became of it.
#[derive(Debug, Serialize)]
pub(super) struct ForecastPoint {
    pub(super) recording: String,
    pub(super) run: u32,
    pub(super) line: u64,
    pub(super) sensor: String,
    pub(super) step: u8,
    /// Its name in files; the page's script words it.
    pub(super) phase: Option<&'static str>,
    pub(super) missed: usize,
    pub(super) drift: bool,
    /// Later than forecast, and half the width of the 90 % interval; none where nothing could be forecast.
    pub(super) late_ms: Option<f64>,
    pub(super) half_90_ms: Option<f64>,
    pub(super) late_mm: Option<f64>,
    pub(super) half_90_mm: Option<f64>,
}
