//! What is known of a train, step by step, as a picture: speeds and stopping distances with their uncertainty.

use anyhow::bail;
use footplate_core::control::learn::StepAccuracy;
use footplate_core::{Approach, HALF_95, TrainId};
use footplate_store::{Findings, MotionStepForm, Quantity, TrainFindings};

use crate::commands::plot::{Ink, Layer, Panel, Picture, PictureFile, Shape};

/// Points of both sides of a step stand beside each other.
const APART: f64 = 0.09;

/// A value at a step, and half its 95 % interval.
#[derive(Debug, Clone, Copy)]
struct AtStep {
    step: u8,
    approach: Approach,
    value: f64,
    half: f64,
}

/// Draws what a calibration from recordings says of its one train.
///
/// # Errors
/// It is of several trains, or the file cannot be written.
pub(in crate::commands) fn draw_calibration(report: &Findings, plot: &PictureFile) -> anyhow::Result<()> {
    let [train] = report.trains.as_slice() else {
        bail!(
            "{}: a picture is of one train, and there are {}; choose one with --train",
            plot.path().display(),
            report.trains.len()
        );
    };
    plot.write(&of_report(report, train))
}

fn of_report(report: &Findings, train: &TrainFindings) -> Picture {
    let measured = train.steps.iter().filter(|form| form.is_measured());
    let at = |form: &MotionStepForm, number: &Quantity| AtStep {
        step: form.step.get(),
        approach: form.approach,
        value: number.value,
        half: HALF_95 * number.uncertainty,
    };
    let speeds: Vec<_> = measured.clone().map(|form| at(form, &form.speed)).collect();
    let stops: Vec<_> = measured.map(|form| at(form, &form.stop)).collect();
    let panels = vec![panel("steady speed (mm/s)", &speeds), panel("stopping distance (mm)", &stops)];
    picture(train.train, &report.layout, "from recordings; bars are 95 % intervals", panels)
}

/// What a calibration of a driven train says.
pub(super) fn of_session(train: TrainId, layout: &str, accuracy: &[StepAccuracy]) -> Picture {
    let speeds = accuracy.iter().map(|line| AtStep {
        step: line.step.get(),
        approach: line.approach,
        value: line.speed.value.as_mm_per_s(),
        half: HALF_95 * line.speed.uncertainty.as_mm_per_s(),
    });
    let distances = accuracy.iter().map(|line| AtStep {
        step: line.step.get(),
        approach: line.approach,
        value: line.stop.distance.as_mm(),
        half: line.stop_within().as_mm(),
    });
    let panels = vec![
        panel("steady speed (mm/s)", &speeds.collect::<Vec<_>>()),
        panel("stopping distance (mm)", &distances.collect::<Vec<_>>()),
    ];
    picture(train, layout, "bars: 95 % intervals of speeds, and of single stops", panels)
}

fn picture(train: TrainId, layout: &str, subtitle: &str, mut panels: Vec<Panel>) -> Picture {
    if let Some(last) = panels.last_mut() {
        "throttle step".clone_into(&mut last.x);
    }
    Picture { title: format!("Train {train} on {layout}"), subtitle: subtitle.to_owned(), panels }
}

fn panel(y: &str, all: &[AtStep]) -> Panel {
    let sides = [
        ("step reached from below", Ink::First, Approach::Below, -APART),
        ("step reached from above", Ink::Second, Approach::Above, APART),
        ("side not recorded", Ink::Third, Approach::Unknown, 0.0),
    ];
    let layer = |(label, ink, side, aside): (&str, Ink, Approach, f64)| {
        let own = all.iter().filter(|at| at.approach == side);
        let points: Vec<_> = own.map(|at| (f64::from(at.step) + aside, at.value, at.half)).collect();
        (!points.is_empty()).then(|| Layer::new(label, ink, Shape::Points(points)))
    };
    let layers = sides.into_iter().filter_map(layer).collect();
    Panel { y: y.to_owned(), from_zero: true, layers, ..Panel::default() }
}
