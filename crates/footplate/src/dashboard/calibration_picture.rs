//! The state of a calibration: experiment, reason, remaining time and achieved accuracy.

use footplate_core::Approach;
use footplate_core::control::learn::{
    CalibrationNotice, CalibrationPhase, Experiment, Progress, StepAccuracy, Why,
};
use serde::Serialize;

use super::picture::tenths;

/// A calibration in progress.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct CalibrationPicture {
    /// `finding`, `joining`, `experiment`, `paused`, `ending` or `finished`.
    phase: &'static str,
    /// The experiment in words.
    experiment: Option<String>,
    /// The experiment as data, for translation.
    trial: Option<TrialPicture>,
    /// Its expected information gain (variance reduction relative to the scatter of stops) and its expected time;
    /// `None` if the step was never tried.
    gain: Option<f64>,
    takes_s: Option<f64>,
    elapsed_s: f64,
    left_s: f64,
    expected: Option<ExpectedPicture>,
}

/// An experiment.
#[derive(Debug, Clone, Copy, Serialize)]
struct TrialPicture {
    /// `speed`, `stop-past`, `stop-short` or `move`.
    what: &'static str,
    step: u8,
    /// The approach to the step: `below` or `above`; `None` from rest.
    side: Option<&'static str>,
    /// How long the train runs.
    run_s: Option<f64>,
}

impl TrialPicture {
    fn of(experiment: Experiment) -> Self {
        let side = |approach| match approach {
            Approach::Above => "above",
            Approach::Below | Approach::Unknown => "below",
        };
        let (what, from, run_s) = match experiment {
            Experiment::Speed { approach, .. } => ("speed", Some(side(approach)), None),
            Experiment::Stop { approach, is_past: true, .. } => ("stop-past", Some(side(approach)), None),
            Experiment::Stop { approach, is_past: false, .. } => ("stop-short", Some(side(approach)), None),
            Experiment::Move { run, .. } => ("move", None, Some(tenths(run.as_s()))),
        };
        Self { what, step: experiment.step().get(), side: from, run_s }
    }
}

/// The median accuracy over all steps, 95 %.
#[derive(Debug, Clone, Serialize)]
struct ExpectedPicture {
    step: u8,
    stop_within_mm: f64,
    speed_within_percent: f64,
}

impl CalibrationPicture {
    /// Takes in a notice of the calibrator.
    pub(super) fn hear(&mut self, notice: &CalibrationNotice) {
        match notice {
            CalibrationNotice::Begins { experiment, why } => self.begins(*experiment, *why),
            CalibrationNotice::Progress(progress) => self.advance_to(progress),
            _ => {}
        }
    }

    fn begins(&mut self, experiment: Experiment, why: Why) {
        self.experiment = Some(experiment.to_string());
        self.trial = Some(TrialPicture::of(experiment));
        (self.gain, self.takes_s) = match why {
            Why::NeverTried => (None, None),
            Why::MostPerSecond { gain, takes } => (Some(tenths(gain)), Some(tenths(takes.as_s()))),
        };
    }

    fn advance_to(&mut self, progress: &Progress) {
        self.phase = match progress.phase {
            CalibrationPhase::Finding => "finding",
            CalibrationPhase::Joining => "joining",
            CalibrationPhase::Experiment(_) => "experiment",
            CalibrationPhase::Ending => "ending",
            CalibrationPhase::Finished => "finished",
        };
        if !matches!(progress.phase, CalibrationPhase::Experiment(_)) {
            self.experiment = None;
            self.trial = None;
        }
        self.elapsed_s = tenths(progress.elapsed.as_s());
        self.left_s = tenths(progress.left.as_s());
        let middle = progress.accuracy.get(progress.accuracy.len() / 2);
        self.expected = middle.map(|line: &StepAccuracy| ExpectedPicture {
            step: line.step.get(),
            stop_within_mm: tenths(line.stop_within().as_mm()),
            speed_within_percent: tenths(line.speed_within().as_parts() * 100.0),
        });
    }
}
