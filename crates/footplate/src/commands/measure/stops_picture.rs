//! All stops that were measured of a train, as a picture.

use anyhow::bail;
use footplate_core::model::report::TapedStop;
use footplate_core::track::Layout;
use footplate_core::{Approach, HALF_95, SpeedStep, TrainId};
use footplate_store::{Batch, BatchTrain, Store};

use crate::clock::LATEST;
use crate::commands::plot::{Ink, Layer, Panel, Picture, Shape};

/// Every stop, the stopping distances of the motion model, and the stops from `newest` pointed out.
///
/// # Errors
/// No stop can be counted from its command yet.
pub(super) fn measured_stops(
    layout: &Layout,
    store: &Store,
    train: TrainId,
    newest: SpeedStep,
) -> anyhow::Result<Picture> {
    let batch = Batch::of_store(layout, store, LATEST, Some(train))?;
    match batch.trains.as_slice() {
        [one] if !one.review.stops.is_empty() => Ok(picture(one, layout.name(), newest)),
        _ => bail!(
            "no stop of train {train} can be counted from its command yet: run it past two sensors at \
             one step"
        ),
    }
}

fn picture(train: &BatchTrain, layout: &str, newest: SpeedStep) -> Picture {
    let stops = &train.review.stops;
    let model = train.replay.fit.model();
    let point = |stop: &TapedStop| {
        let distance = stop.distance.length().as_mm();
        (stop.speed.as_mm_per_s(), distance, HALF_95 * stop.uncertainty.as_mm())
    };
    let (own, others): (Vec<_>, Vec<_>) = stops.iter().partition(|stop| stop.step == newest);
    let fastest = stops.iter().map(|stop| stop.step).max().unwrap_or(newest);
    let curve = (0..=fastest.get()).filter_map(SpeedStep::new).map(|step| {
        let stop = model.stop(step, Approach::Below);
        (model.speed(step, Approach::Below).value.as_mm_per_s(), stop.distance.as_mm())
    });
    let mut layers = vec![Layer::new("motion model", Ink::Plain, Shape::Dashed(curve.collect()))];
    let parts =
        [(others, "other steps".to_owned(), Ink::First), (own, format!("from step {newest}"), Ink::Second)];
    for (stops, label, ink) in parts.into_iter().filter(|(stops, ..)| !stops.is_empty()) {
        layers.push(Layer::new(&label, ink, Shape::Points(stops.into_iter().map(point).collect())));
    }
    let panel = Panel {
        x: "speed at the command (mm/s)".to_owned(),
        y: "stopping distance (mm)".to_owned(),
        from_zero: true,
        layers,
        ..Panel::default()
    };
    Picture {
        title: format!("Stops of train {} on {layout}", model.train()),
        subtitle: format!("{} measured with a tape; bars are 95 % intervals of each", stops.len()),
        panels: vec![panel],
    }
}
