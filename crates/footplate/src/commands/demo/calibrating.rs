//! The first half: a train that nobody has measured teaches how it moves.

use footplate_core::control::learn::{
    CalibrationNotice, CalibratorSettings, Ending, Mishap, Phase, Progress, StepAccuracy,
};
use footplate_core::model::MotionFit;
use footplate_core::model::StepUse;
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::tracking::Locator;
use footplate_core::{Approach, SpeedStep, TimeSpan, TrainId};

use super::outcome::{Learnt, LearntStep, minutes};
use super::stage::Stage;
use crate::commands::calibrate::CalibrationBeginning;
use crate::commands::written_layout::WrittenLayout;
use crate::recorded::Recorded;

/// The decoder of the trains of the real-time courses.
const HIGHEST_STEP: u8 = 14;
/// How wide the bar of time is.
const BAR: usize = 16;

/// What came of it.
pub(super) struct Calibrated {
    pub(super) fit: MotionFit,
    pub(super) locator: Locator,
    pub(super) turnouts: TurnoutStates,
}

/// Calibrates a train. Nothing if it could not be found.
pub(super) fn calibrate(
    stage: &mut Stage<'_, '_, '_>,
    on: &WrittenLayout,
    train: TrainId,
    turnouts: &TurnoutStates,
) -> anyhow::Result<Option<Calibrated>> {
    let highest = SpeedStep::new(HIGHEST_STEP).unwrap_or(SpeedStep::STAND);
    let settings = CalibratorSettings::default();
    let budget = settings.budget;
    let beginning = CalibrationBeginning::new(on, settings, MotionFit::new(train, highest), turnouts);
    let scribe = stage.begin_machine(CalibrationBeginning::KIND, &beginning)?;
    let layout = &on.layout;
    let mut calibrator = Recorded::new(beginning.calibrator(layout), scribe);
    let began = stage.now();
    stage.works(train, "learns", "");
    while calibrator.machine().ending().is_none() {
        for notice in stage.go_on(&mut calibrator)? {
            let now = stage.now();
            if let Some(showing) = &mut stage.showing {
                let said = match &notice {
                    CalibrationNotice::Mishap(mishap) => what_happened(layout, mishap),
                    _ => String::new(),
                };
                showing.hear(now, train, &notice, &said);
            }
            tell(stage, layout, train, budget, &notice)?;
        }
        let now = stage.now();
        if let Some(showing) = &mut stage.showing {
            showing.calibrator(calibrator.machine(), now);
        }
        if stage.is_broken() {
            return Ok(None);
        }
    }
    let calibrator = calibrator.end(stage.now());
    if matches!(calibrator.ending(), Some(Ending::NotFound | Ending::WrongLayout { .. })) {
        stage.screen.mishap(
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
    let (contacts, stops) =
        both.fold((0, 0), |(contacts, stops), (more, stopped)| (contacts + more, stops + stopped));
    let learnt = Learnt { train, took: stage.now() - began, steps, stops, contacts };
    stage.learnt(learnt)?;
    let (locator, turnouts) = (calibrator.locator().clone(), calibrator.turnouts().clone());
    Ok(Some(Calibrated { fit: calibrator.into_fit(), locator, turnouts }))
}

/// The steps that can be relied upon, for a picture.
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

/// The steps of a model that can be relied upon, lowest first.
pub(super) fn usable(fit: &MotionFit) -> Vec<SpeedStep> {
    let model = fit.model();
    let steps = (1..=HIGHEST_STEP).filter_map(SpeedStep::new);
    steps.filter(|step| model.uses(*step) == StepUse::Moves).collect()
}

fn tell(
    stage: &mut Stage<'_, '_, '_>,
    layout: &Layout,
    train: TrainId,
    budget: TimeSpan,
    notice: &CalibrationNotice,
) -> std::io::Result<()> {
    match notice {
        CalibrationNotice::Found { node, step } => {
            let node = layout.node_name(*node);
            stage.screen.mention(&format!("  train {train}: found, it runs over {node} at step {step}"))
        }
        CalibrationNotice::Circuit(circuit) => stage.screen.mention(&format!(
            "  train {train}: uses a circuit of {} sensors and {:.1} m",
            circuit.lap.len(),
            circuit.length.as_m()
        )),
        CalibrationNotice::TurnsAround { node } => {
            let node = layout.node_name(*node);
            stage.screen.mention(&format!("  train {train}: reverses beyond {node}"))
        }
        CalibrationNotice::Progress(progress) => {
            let detail = detail(progress, budget);
            stage.shows(train, &detail, Some(known(&progress.accuracy)));
            Ok(())
        }
        CalibrationNotice::Mishap(mishap) => stage.screen.mishap(train, &what_happened(layout, mishap)),
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
        Phase::Finding => "waits for its first sensor".to_owned(),
        Phase::Joining => "goes to its circuit".to_owned(),
        Phase::Experiment(experiment) => experiment.to_string(),
        Phase::Paused => "waits".to_owned(),
        Phase::Ending | Phase::Finished => "comes to rest".to_owned(),
    };
    format!("{about:<32} {bar} {} of {}", minutes(progress.elapsed), minutes(budget))
}

fn what_happened(layout: &Layout, mishap: &Mishap) -> String {
    let sensor = |sensor| layout.sensor_name(sensor);
    match mishap {
        Mishap::Stalled { step } => format!("does not move reliably at step {step}"),
        Mishap::Missed { count, before } => {
            format!(
                "{count} sensor{} before {} did not report",
                if *count == 1 { "" } else { "s" },
                sensor(*before)
            )
        }
        Mishap::Unexplained { sensor: of } => {
            format!("{} reported, but it cannot have passed there", sensor(*of))
        }
        Mishap::WrongLeg { turnout, .. } => {
            format!("turnout {turnout} was not in the commanded position; commanded again")
        }
        Mishap::Moved { to, .. } => format!("is at {}, where it cannot have run to", layout.node_name(*to)),
        Mishap::Lost { .. } => "lost its position; it stops and is located again".to_owned(),
        Mishap::LengthsDiffer { hops } => {
            format!("takes times over {} hops that their lengths do not explain", hops.len())
        }
    }
}
