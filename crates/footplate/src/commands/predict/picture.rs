//! How far forecasts were off as a picture: for everybody the share of reports within so many millimetres, phase by phase.

use footplate_core::TimeSpan;
use footplate_core::track::Layout;
use footplate_store::score::{ReferenceForecaster, ScoredHit, ScoredRecording};

use super::figures::{Hits, PHASES, only};
use crate::commands::plot::{Ink, Layer, Panel, Picture, SHOWN, Shape, shares};

/// How a curve is drawn.
type Drawn = fn(Vec<(f64, f64)>) -> Shape;

/// Who stands beside us: what courses use, what clubs use, and what could be known at best.
const BESIDE: [(ReferenceForecaster, Ink, Drawn); 3] = [
    (ReferenceForecaster::ConstantTable, Ink::Second, Shape::Line),
    (ReferenceForecaster::MiddleAverage, Ink::Third, Shape::Line),
    (ReferenceForecaster::Oracle, Ink::Plain, Shape::Dashed),
];

/// The forecasts of all recordings; nothing where none could be made.
pub(super) fn of(layout: &Layout, recordings: &[ScoredRecording]) -> Option<Picture> {
    let all: Hits<'_> = recordings.iter().flat_map(|recording| &recording.hits).collect();
    let scored = only(&all, |hit| hit.late().is_some()).len();
    let phases = PHASES.iter().filter_map(|(phase, name, _)| {
        let hits = only(&all, |hit| hit.phase() == Some(*phase));
        (!hits.is_empty()).then(|| panel(name, &hits))
    });
    let panels: Vec<Panel> = phases.collect();
    if panels.is_empty() {
        return None;
    }
    let logs = match recordings {
        [only] => only.name.clone(),
        several => format!("{} logs", several.len()),
    };
    Some(Picture {
        title: format!("Predictions of the next sensor report, {logs} on {}", layout.name()),
        subtitle: format!("{scored} reports that were forecast; every curve ends at {SHOWN:.0} % of its own"),
        panels,
    })
}

/// One phase, with those who forecast at least half of what we did: of the others too little is known.
fn panel(phase: &str, hits: &[&ScoredHit]) -> Panel {
    let curve = |late: &dyn Fn(&ScoredHit) -> Option<TimeSpan>| {
        shares(hits.iter().filter_map(|hit| hit.distance_mm(late(hit)?)).map(f64::abs))
    };
    let often = |reference| 2 * only(hits, |hit| hit.late_by(reference).is_some()).len() >= hits.len();
    let references =
        BESIDE.iter().filter(|(reference, ..)| often(*reference)).map(|(reference, ink, shape)| {
            Layer::new(&reference.to_string(), *ink, shape(curve(&|hit| hit.late_by(*reference))))
        });
    let mut layers: Vec<Layer> = references.collect();
    layers.push(Layer::new("Footplate", Ink::First, Shape::Line(curve(&ScoredHit::late))));
    Panel {
        x: format!("{phase}: error at most (mm)"),
        y: "reports (%)".to_owned(),
        from_zero: true,
        layers,
        ..Panel::default()
    }
}
