//! Converts a fitted batch to its report.

use footplate_core::TimeSpan;
use footplate_core::kinematics::SpeedLaw;
use footplate_core::model::report::{
    Constant, Direction, FittedLaw, LawComparison, LawKind, SettledPassage, TapedStop,
};
use footplate_core::track::Layout;

use super::form::{
    ComparedLawForm, Findings, LawForm, PollingForm, SuspicionForm, TapedStopForm, TrainFindings,
};
use crate::batch::{Batch, BatchTrain, Polling};
use crate::motion_file::{MOTION_MODEL_VERSION, MotionFile};
use crate::quantity::Quantity;

impl Findings {
    /// The report of a batch.
    pub fn of(layout: &Layout, batch: &Batch) -> Self {
        Self {
            model_version: MOTION_MODEL_VERSION.to_owned(),
            layout: layout.name().to_owned(),
            polling: batch.polling.iter().map(PollingForm::of).collect(),
            trains: batch.trains.iter().map(|train| TrainFindings::of(layout, batch, train)).collect(),
        }
    }
}

impl BatchTrain {
    /// The motion model of the train, for a file or a store.
    pub fn file(&self, layout: &Layout) -> MotionFile {
        MotionFile::of(layout, self.replay.fit.model(), self.replay.newest)
    }
}

impl PollingForm {
    fn of(polling: &Polling) -> Self {
        Self {
            recording: polling.recording.clone(),
            period: polling.period.map(Quantity::milliseconds),
            after_report_ms: polling.timing.after_report.as_ms(),
            jitter_ms: polling.timing.jitter.as_ms(),
        }
    }
}

impl TrainFindings {
    fn of(layout: &Layout, batch: &Batch, train: &BatchTrain) -> Self {
        let MotionFile { train: number, highest_step, steps, sections, .. } = train.file(layout);
        let review = &train.review;
        let own = || batch.passages.iter().filter(|run| run.train == number);
        let laws = review.laws.iter();
        let suspicious = review.running.suspicious();
        Self {
            train: number,
            highest_step,
            runs: own().count() as u32,
            silent_runs: own().filter(|run| run.passages.is_empty()).count() as u32,
            contacts: own().map(|run| run.passages.len() as u32).sum(),
            steps,
            run_deviation_percent: 100.0 * review.running.run_deviation,
            contact_scatter_mm: review.running.sensor_scatter.as_mm(),
            sections,
            laws: laws.filter_map(|(direction, comparison)| law_form(*direction, comparison)).collect(),
            stops: review.stops.iter().filter_map(|stop| taped_stop(batch, stop)).collect(),
            suspicious: suspicious.filter_map(|passage| suspicion(layout, batch, passage)).collect(),
        }
    }
}

fn law_form(direction: Direction, comparison: &LawComparison) -> Option<LawForm> {
    let changes = comparison.changes as u32;
    let mut forms = comparison.laws.iter().map(|law| compared(law, changes));
    Some(LawForm {
        direction,
        changes,
        fits: comparison.fits,
        agreed: comparison.agreed,
        best: forms.next()?,
        others: forms.collect(),
    })
}

fn compared(law: &FittedLaw, changes: u32) -> ComparedLawForm {
    let [pace, pace_uncertainty] = law.pace;
    let pace = match (law.kind, law.kind.constant()) {
        (LawKind::StepRamp, _) => Quantity::new("s a step", pace, pace_uncertainty, changes),
        (_, Constant::Time) => Quantity::new("s", pace, pace_uncertainty, changes),
        (_, Constant::Acceleration) => Quantity::new("mm/s²", 1e3 * pace, 1e3 * pace_uncertainty, changes),
    };
    ComparedLawForm {
        law: law.kind,
        name: name(law.kind),
        pace,
        delay: Quantity::new("s", law.delay[0], law.delay[1], changes),
        chi_square_by_freedom: law.chi_square / law.freedom.max(1) as f64,
        criterion: law.criterion,
        held_out_mm: law.held_out_mm,
    }
}

/// The name of a law.
fn name(kind: LawKind) -> String {
    let LawKind::Family(family) = kind else { return "linear in the step (momentum)".to_owned() };
    let shape = match family.law {
        SpeedLaw::MidStep => "step at mid-interval",
        SpeedLaw::ConstantAcceleration => "constant acceleration",
        SpeedLaw::ConstantJerk => "constant jerk (S-curve)",
        SpeedLaw::Smooth => "smooth (cubic speed)",
        SpeedLaw::Lag => "first-order lag",
    };
    match (family.law, family.constant) {
        (SpeedLaw::Lag, _) => shape.to_owned(),
        (_, Constant::Acceleration) => format!("{shape}, same rate for all changes"),
        (_, Constant::Time) => format!("{shape}, same time for all changes"),
    }
}

fn taped_stop(batch: &Batch, stop: &TapedStop) -> Option<TapedStopForm> {
    let run = batch.runs.get(stop.run)?;
    Some(TapedStopForm {
        recording: run.recording.clone(),
        run: run.id.0,
        step: stop.step,
        speed_mm_per_s: stop.speed.as_mm_per_s(),
        distance_mm: stop.distance.length().as_mm(),
        uncertainty_mm: stop.uncertainty.as_mm(),
        time_s: stop.time.map(TimeSpan::as_s),
    })
}

fn suspicion(layout: &Layout, batch: &Batch, passage: &SettledPassage) -> Option<SuspicionForm> {
    let run = batch.runs.get(passage.run)?;
    let event = batch.event(passage.run, passage.passage.entry)?;
    Some(SuspicionForm {
        recording: run.recording.clone(),
        run: run.id.0,
        line: event.line,
        stored_as: event.stored_as,
        sensor: layout.sensor_name(passage.passage.sensor).to_owned(),
        late_ms: passage.late.as_ms(),
        late_mm: passage.late_length.as_mm(),
        probability: passage.probability,
    })
}
