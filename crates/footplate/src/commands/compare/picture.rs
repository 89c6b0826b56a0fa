//! Ours beside what others published, step by step, as a picture.

use footplate_core::HALF_95;
use footplate_store::{CheckedFigure, CrossCheck};

use crate::commands::plot::{Ink, Layer, Panel, Picture, Shape};

/// Step, value and half of what is not known of it.
type Point = (f64, f64, f64);

/// Theirs stand so far beside ours.
const BESIDE: f64 = 0.12;

/// All figures of one train; nothing where there are none, or some of another train.
pub(super) fn of(check: &CrossCheck) -> Option<Picture> {
    let mut trains = check.speeds.iter().chain(&check.stops).map(|figure| figure.train);
    let train = trains.next()?;
    if trains.any(|other| other != train) {
        return None;
    }
    let parts = [("steady speed (mm/s)", &check.speeds), ("stopping distance (mm)", &check.stops)];
    let shown = parts.into_iter().filter(|(_, figures)| !figures.is_empty());
    let mut panels: Vec<Panel> = shown.map(|(y, figures)| panel(y, figures)).collect();
    "throttle step".clone_into(&mut panels.last_mut()?.x);
    Some(Picture {
        title: format!("Train {train} beside what others published"),
        subtitle:
            "bars are 95 % intervals of ours; teams agree if they differ by no more than teams usually \
             do"
            .to_owned(),
        panels,
    })
}

fn panel(y: &str, figures: &[CheckedFigure]) -> Panel {
    let layer = |label, ink, point: &dyn Fn(&CheckedFigure) -> Option<Point>| {
        let points: Vec<_> = figures.iter().filter_map(point).collect();
        (!points.is_empty()).then(|| Layer::new(label, ink, Shape::Points(points)))
    };
    let step = |figure: &CheckedFigure| f64::from(figure.step.get());
    let theirs = |wanted: bool| {
        move |figure: &CheckedFigure| {
            (figure.agrees() == wanted).then(|| (step(figure) + BESIDE, figure.theirs, 0.0))
        }
    };
    let ours = |figure: &CheckedFigure| Some((step(figure), figure.ours[0], HALF_95 * figure.ours[1]));
    let layers = [
        layer("ours", Ink::First, &ours),
        layer("theirs, agrees", Ink::Second, &theirs(true)),
        layer("theirs, does not agree", Ink::Third, &theirs(false)),
    ];
    Panel {
        y: y.to_owned(),
        from_zero: true,
        layers: layers.into_iter().flatten().collect(),
        ..Panel::default()
    }
}
