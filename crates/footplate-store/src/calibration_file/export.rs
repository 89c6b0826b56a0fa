//! From a batch to a calibration file.

use footplate_core::calibration::{
    Constant, Direction, FittedLaw, LawComparison, LawKind, SpeedCurve, StopTable,
};
use footplate_core::kinematics::SpeedLaw;
use footplate_core::track::Layout;
use footplate_core::{Estimate, Length, Speed, TimeSpan, TrainId};

use super::form::{
    CalibrationFile, ComparedLawForm, HysteresisForm, LawForm, MODEL_VERSION, PollingForm, Quantity,
    SectionForm, SpeedForm, StopForm, StopLawForm, StopStepForm, SuspicionForm, TrainForm,
};
use crate::batch::Batch;

impl Quantity {
    fn new(unit: &str, value: f64, uncertainty: f64, measurements: u32) -> Self {
        Self { value, uncertainty, unit: unit.to_owned(), measurements, measured_at_s: None }
    }

    fn speed(speed: Estimate<Speed>) -> Self {
        let (value, uncertainty) = (speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s());
        Self::new("mm/s", value, uncertainty, speed.count)
    }

    fn length(length: Estimate<Length>) -> Self {
        Self::new("mm", length.value.as_mm(), length.uncertainty.as_mm(), length.count)
    }

    fn seconds(time: Estimate<TimeSpan>) -> Self {
        Self::new("s", time.value.as_s(), time.uncertainty.as_s(), time.count)
    }
}

impl CalibrationFile {
    /// What a batch found, for a file or a store.
    #[must_use]
    pub fn of(layout: &Layout, batch: &Batch) -> Self {
        let polling = batch
            .polling
            .iter()
            .map(|polling| PollingForm {
                recording: polling.recording.clone(),
                period: polling.period.map(|period| {
                    let (value, uncertainty) = (period.value.as_ms(), period.uncertainty.as_ms());
                    Quantity::new("ms", value, uncertainty, period.count)
                }),
                after_report_ms: polling.timing.after_report.as_ms(),
                jitter_ms: polling.timing.jitter.as_ms(),
            })
            .collect();
        Self {
            model_version: MODEL_VERSION.to_owned(),
            layout: layout.name().to_owned(),
            polling,
            trains: batch
                .calibration
                .trains()
                .into_iter()
                .map(|train| of_train(layout, batch, train))
                .collect(),
        }
    }

    /// The same with one train only, as a store keeps it.
    #[must_use]
    pub fn of_one(&self, train: TrainId) -> Self {
        let trains = self.trains.iter().filter(|form| form.train == train).cloned().collect();
        Self { trains, ..self.clone() }
    }
}

fn of_train(layout: &Layout, batch: &Batch, train: TrainId) -> TrainForm {
    let calibration = &batch.calibration;
    let fit = &calibration.fit;
    let speeds: Vec<SpeedForm> = fit
        .speeds
        .iter()
        .filter(|(key, _)| key.train == train)
        .map(|(key, speed)| {
            let newest = calibration
                .behind(*key)
                .filter_map(|passage| {
                    Some((batch.runs.get(passage.run)?.began_at?, passage.passage.window.until))
                })
                .map(|(began_at, until)| began_at.as_s() + until.as_s())
                .reduce(f64::max);
            SpeedForm {
                step: key.step,
                approach: key.approach,
                speed: Quantity { measured_at_s: newest, ..Quantity::speed(*speed) },
                runs: fit.stretches.get(key).copied().unwrap_or(0),
            }
        })
        .collect();
    let mut steps: Vec<_> = speeds.iter().map(|speed| speed.step).collect();
    steps.dedup();
    let hysteresis = steps.into_iter().filter_map(|step| {
        let found = calibration.hysteresis(train, step)?;
        Some(HysteresisForm {
            step,
            difference: Quantity::speed(found.difference),
            told_apart: found.told_apart,
        })
    });
    let laws = calibration
        .laws
        .iter()
        .filter(|((of, _), _)| *of == train)
        .filter_map(|((_, direction), comparison)| law_form(*direction, comparison));
    TrainForm {
        train,
        hysteresis: hysteresis.collect(),
        speeds,
        run_deviation_percent: 100.0 * fit.run_deviation.get(&train).copied().unwrap_or(0.0),
        contact_scatter_mm: calibration.contact_scatter(train).map_or(0.0, Length::as_mm),
        sections: sections(layout, batch, train),
        laws: laws.collect(),
        stops: calibration.stops.get(&train).map(stops),
        suspicious: suspicious(layout, batch, train),
    }
}

fn sections(layout: &Layout, batch: &Batch, train: TrainId) -> Vec<SectionForm> {
    let fit = &batch.calibration.fit;
    // The first hop of the table that runs over a section names it.
    let mut named: Vec<usize> = Vec::new();
    let mut forms = Vec::new();
    for hop in layout.hops() {
        let Some(section) = batch.sections.section(hop.id).filter(|section| !named.contains(section)) else {
            continue;
        };
        let Some(correction) = fit.sections.get(&(train, section)) else { continue };
        named.push(section);
        forms.push(SectionForm {
            from: layout.node_name(hop.from).to_owned(),
            to: layout.node_name(hop.to).to_owned(),
            surveyed_mm: hop.length.as_mm(),
            correction: Quantity::length(*correction),
        });
    }
    forms
}

fn law_form(direction: Direction, comparison: &LawComparison) -> Option<LawForm> {
    let changes = comparison.changes as u32;
    let form = |law: &FittedLaw| compared(law, changes);
    Some(LawForm {
        direction,
        changes,
        fits: comparison.fits,
        agreed: comparison.agreed,
        best: comparison.laws.get(comparison.best).map(form)?,
        others: comparison
            .laws
            .iter()
            .enumerate()
            .filter(|(place, _)| *place != comparison.best)
            .map(|(_, law)| form(law))
            .collect(),
    })
}

fn compared(law: &FittedLaw, changes: u32) -> ComparedLawForm {
    let [pace, pace_uncertainty] = law.pace;
    // A table's unit of time is that of the law that scales it.
    let constant = law.curve.as_ref().map(SpeedCurve::constant).or(law.kind.constant());
    let pace = match (law.kind, constant) {
        (LawKind::StepRamp, _) => Quantity::new("s a step", pace, pace_uncertainty, changes),
        (_, Some(Constant::Time)) => Quantity::new("s", pace, pace_uncertainty, changes),
        _ => Quantity::new("mm/s²", 1e3 * pace, 1e3 * pace_uncertainty, changes),
    };
    ComparedLawForm {
        law: law.kind,
        name: name(law.kind),
        pace,
        delay: Quantity::new("s", law.delay[0], law.delay[1], changes),
        covariance: law.covariance,
        chi_square_by_freedom: law.chi_square / law.freedom.max(1) as f64,
        criterion: law.criterion,
        held_out_mm: law.held_out_mm,
        table: law.curve.iter().flat_map(|curve| curve.knots().map(|(time, share)| [time, share])).collect(),
    }
}

/// What people call a law.
fn name(kind: LawKind) -> String {
    let family = match kind {
        LawKind::StepRamp => return "linear in the step (momentum)".to_owned(),
        LawKind::Table => return "look-up table".to_owned(),
        LawKind::Family(family) => family,
    };
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

fn stops(table: &StopTable) -> StopForm {
    let steps = table.steps.iter().map(|(step, entry)| StopStepForm {
        step: *step,
        speed_mm_per_s: entry.speed.as_mm_per_s(),
        distance: Quantity::length(entry.distance),
        time: entry.time.map(Quantity::seconds),
        scatter_mm: entry.scatter.map(Length::as_mm),
        residual_mm: entry.residual.map(Length::as_mm),
    });
    let law = table.law.map(|law| StopLawForm {
        delay: Quantity::seconds(law.delay),
        deceleration: Quantity::new(
            "mm/s²",
            law.deceleration.value.as_mm_per_s2(),
            law.deceleration.uncertainty.as_mm_per_s2(),
            law.deceleration.count,
        ),
        rms_mm: law.rms.as_mm(),
    });
    StopForm { counted: "from_command".to_owned(), steps: steps.collect(), law }
}

fn suspicious(layout: &Layout, batch: &Batch, train: TrainId) -> Vec<SuspicionForm> {
    let own = batch.calibration.suspicious().filter(|passage| passage.key.train == train);
    own.filter_map(|passage| {
        let run = batch.runs.get(passage.run)?;
        let event = batch.event(passage.run, passage.passage.entry)?;
        Some(SuspicionForm {
            recording: run.recording.clone(),
            run: run.id.0,
            line: event.line,
            stored_as: event.stored_as,
            sensor: layout.sensor_name(passage.passage.sensor).to_owned(),
            late_ms: passage.late.as_ms(),
            late_mm: passage.late_way.as_mm(),
            probability: passage.probability,
        })
    })
    .collect()
}
