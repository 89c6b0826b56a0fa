//! The first half of the demo: calibrates an unknown train.

use footplate_core::control::learn::{
    CalibrationNotice, CalibrationPhase, CalibratorSettings, Ending, Progress, StepAccuracy,
};
use footplate_core::model::MotionFit;
use footplate_core::model::StepUse;
use footplate_core::track::TurnoutStates;
use footplate_core::tracking::Locator;
use footplate_core::{Approach, SpeedStep, TimeSpan, TrainId};

use super::outcome::{Learnt, LearntStep};
use super::running_demo::Demo;
use crate::commands::calibrate::{CalibrationBeginning, calibration_line, minutes};
use crate::commands::written_layout::WrittenLayout;
use crate::recorded::Recorded;

/// The highest step of the decoders in the recorded trains.
const HIGHEST_STEP: u8 = 14;
/// The width of the time bar, in characters.
const BAR: usize = 16;

/// A calibrated train at rest.
pub(super) struct Calibrated {
    pub(super) fit: MotionFit,
    pub(super) locator: Locator,
    pub(super) turnouts: TurnoutStates,
}

/// Calibrates a train; `None` if it could not be located.
pub(super) fn calibrate(
    demo: &mut Demo<'_, '_, '_>,
    written: &WrittenLayout,
    train: TrainId,
    turnouts: &TurnoutStates,
) -> anyhow::Result<Option<Calibrated>> {
    let highest = SpeedStep::new(HIGHEST_STEP).unwrap_or(SpeedStep::STAND);
    let settings = CalibratorSettings::default();
    let budget = settings.budget;
    let fit = MotionFit::new(train, highest);
    let beginning = CalibrationBeginning::new(written, settings, fit, turnouts, true);
    let scribe = demo.begin_machine(CalibrationBeginning::KIND, &beginning)?;
    let layout = &written.layout;
    let mut calibrator = Recorded::new(beginning.calibrator(layout), scribe);
    let began = demo.now();
    demo.set_active(train, "learns", "");
    while calibrator.machine().ending().is_none() {
        for notice in demo.advance(&mut calibrator)? {
            let now = demo.now();
            let line = calibration_line(layout, &notice).unwrap_or_default();
            if let Some(dashboard_view) = &mut demo.dashboard_view {
                dashboard_view.hear(now, train, &notice, &line);
            }
            report(demo, train, budget, &notice, &line)?;
        }
        let now = demo.now();
        if let Some(dashboard_view) = &mut demo.dashboard_view {
            dashboard_view.calibrator(calibrator.machine(), now);
        }
        if demo.is_broken() {
            return Ok(None);
        }
    }
    let calibrator = calibrator.end(demo.now());
    if matches!(calibrator.ending(), Some(Ending::NotFound | Ending::WrongLayout { .. })) {
        demo.screen.fault(
            train,
            "could not be calibrated: its sensor reports fit no path of this \
                                    layout",
        )?;
        return Ok(None);
    }
    let steps = known(&calibrator.accuracy());
    let model = calibrator.fit().model();
    let both = (1..=HIGHEST_STEP).filter_map(SpeedStep::new).flat_map(|step| {
        [Approach::Below, Approach::Above]
            .map(|approach| (model.speed(step, approach).count, model.stop(step, approach).count))
    });
    let (detections, stops) =
        both.fold((0, 0), |(detections, stops), (more, stopped)| (detections + more, stops + stopped));
    let learnt = Learnt { train, took: demo.now() - began, steps, stops, detections };
    demo.learnt(learnt)?;
    let (locator, turnouts) = (calibrator.locator().clone(), calibrator.turnouts().clone());
    Ok(Some(Calibrated { fit: calibrator.into_fit(), locator, turnouts }))
}

/// The usable steps with their speeds and stop accuracies, for display.
fn known(accuracy: &[StepAccuracy]) -> Vec<LearntStep> {
    let below = accuracy.iter().filter(|line| line.approach == Approach::Below);
    below
        .map(|line| LearntStep {
            step: line.step,
            mm_per_s: line.speed.value.as_mm_per_s(),
            stops_within: line.stop_within(),
        })
        .collect()
}

/// The steps that move the train reliably, lowest first.
pub(super) fn usable(fit: &MotionFit) -> Vec<SpeedStep> {
    let model = fit.model();
    let steps = (1..=HIGHEST_STEP).filter_map(SpeedStep::new);
    steps.filter(|step| model.uses(*step) == StepUse::Moves).collect()
}

fn report(
    demo: &mut Demo<'_, '_, '_>,
    train: TrainId,
    budget: TimeSpan,
    notice: &CalibrationNotice,
    line: &str,
) -> std::io::Result<()> {
    match notice {
        CalibrationNotice::Found { .. } | CalibrationNotice::TurnsAround { .. } => {
            demo.screen.mention(&format!("  train {train}: {line}"))
        }
        CalibrationNotice::Circuit(circuit) => demo.screen.mention(&format!(
            "  train {train}: uses a circuit of {} sensors and {:.1} m",
            circuit.lap.len(),
            circuit.length.as_m()
        )),
        CalibrationNotice::Progress(progress) => {
            let detail = detail(progress, budget);
            demo.set_detail(train, &detail, Some(known(&progress.accuracy)));
            Ok(())
        }
        CalibrationNotice::Mishap(_) => demo.screen.fault(train, line.trim_start_matches("! ")),
        CalibrationNotice::Begins { .. }
        | CalibrationNotice::Done(_)
        | CalibrationNotice::Finished { .. } => Ok(()),
    }
}

fn detail(progress: &Progress, budget: TimeSpan) -> String {
    let part = (progress.elapsed.as_s() / budget.as_s()).clamp(0.0, 1.0);
    let full = (part * BAR as f64).round() as usize;
    let bar: String = (0..BAR).map(|at| if at < full { '━' } else { '─' }).collect();
    let about = match progress.phase {
        CalibrationPhase::Finding => "waits for its first sensor".to_owned(),
        CalibrationPhase::Joining => "goes to its circuit".to_owned(),
        CalibrationPhase::Experiment(experiment) => experiment.to_string(),
        CalibrationPhase::Ending | CalibrationPhase::Finished => "comes to rest".to_owned(),
    };
    format!("{about:<32} {bar} {} of {}", minutes(progress.elapsed), minutes(budget))
}
