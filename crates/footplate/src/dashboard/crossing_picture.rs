//! Trains at rest near one level crossing, on either of its tracks: neither may start while the other is there.

use footplate_core::control::{CLEARANCE, Dispatcher, Reservation};
use footplate_core::track::{Crossing, Landmark, Layout, Position};
use footplate_core::{EdgeId, Length, Timestamp, TrainId};
use serde::Serialize;

/// Two trains that hold each other.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct HeldAtCrossing {
    trains: [u16; 2],
    /// The crossing, as a place on the track of each.
    at: [String; 2],
}

/// The trains that hold each other at a crossing.
pub(super) fn held_at_crossings(dispatcher: &Dispatcher, now: Timestamp) -> Vec<HeldAtCrossing> {
    let driver = dispatcher.driver();
    let layout = driver.layout();
    let resting_near = |crossed: Position| {
        let is_near = move |train: &TrainId| {
            let spans = dispatcher.reservation(*train).into_iter().flat_map(Reservation::spans);
            let mut crossed_by = spans.flat_map(|(stretch, span)| {
                layout.crossed_near(EdgeId(2 * stretch.0), span.from, span.to, CLEARANCE)
            });
            driver.is_at_rest(*train, now) && crossed_by.any(|at| at == crossed)
        };
        driver.trains().filter(is_near)
    };
    let pairs = layout.crossings().iter().flat_map(|Crossing { tracks: [one, other] }| {
        let at = [*one, *other].map(|at| name(layout, at));
        resting_near(*other).flat_map(move |first| {
            let at = at.clone();
            let others = resting_near(*one).filter(move |second| *second != first);
            others.map(move |second| HeldAtCrossing { trains: [first.0, second.0], at: at.clone() })
        })
    });
    pairs.collect()
}

/// A place on an edge, to a millimetre.
fn name(layout: &Layout, at: Position) -> String {
    let Some(edge) = layout.edge(at.edge) else { return String::new() };
    let offset = Length::from_mm(at.offset.as_mm().round());
    layout.display(Landmark { node: edge.from, offset }).to_string()
}
