//! All stops that were measured of a train, as a picture.

use anyhow::Context;
use footplate_core::calibration::{StopMeasurement, StopTable};
use footplate_core::track::Layout;
use footplate_core::{HALF_95, SpeedStep, TrainId};
use footplate_store::{Batch, Store};

use crate::clock::now;
use crate::commands::plot::{Ink, Layer, Panel, Picture, Shape};

/// Points of the curve of the law.
const SAMPLES: u32 = 120;
/// How far the curve goes beyond the fastest stop.
const BEYOND: f64 = 1.1;

/// Every stop with its step's mean, the law through all, and the stops from `newest` pointed out.
///
/// # Errors
/// No stop can be reckoned yet.
pub(super) fn measured_stops(
    layout: &Layout,
    store: &Store,
    train: TrainId,
    newest: SpeedStep,
) -> anyhow::Result<Picture> {
    let batch = Batch::of_store(layout, store, now(), Some(train))?;
    let table = batch.calibration.stops.get(&train).with_context(|| {
        format!("no stop of train {train} can be drawn before its speeds are known: let it pass two contacts at a step")
    })?;
    Ok(picture(train, layout.name(), table, newest))
}

fn picture(train: TrainId, layout: &str, table: &StopTable, newest: SpeedStep) -> Picture {
    let point = |stop: &StopMeasurement| {
        let [speed, _] = stop.speed;
        (speed.as_mm_per_s(), stop.distance.length().as_mm(), HALF_95 * stop.uncertainty.as_mm())
    };
    let (own, others): (Vec<_>, Vec<_>) = table.measurements.iter().partition(|stop| stop.step == newest);
    let mut layers = Vec::new();
    if let Some(law) = &table.law {
        let (delay, braking) = (law.delay.value.as_s(), law.deceleration.value.as_mm_per_s2());
        let fastest = table.steps.values().map(|entry| entry.speed.as_mm_per_s()).fold(0.0, f64::max);
        let at = |number: u32| BEYOND * fastest * f64::from(number) / f64::from(SAMPLES);
        let curve =
            (0..=SAMPLES).map(at).map(|speed| (speed, delay * speed + speed * speed / (2.0 * braking)));
        layers.push(Layer::new("law through all of them", Ink::Plain, Shape::Dashed(curve.collect())));
    }
    let stops =
        [(others, "other steps".to_owned(), Ink::First), (own, format!("from step {newest}"), Ink::Second)];
    for (stops, label, ink) in stops.into_iter().filter(|(stops, ..)| !stops.is_empty()) {
        layers.push(Layer::new(&label, ink, Shape::Points(stops.into_iter().map(point).collect())));
    }
    let panel = Panel {
        x: "speed at the command (mm/s)".to_owned(),
        y: "way to rest (mm)".to_owned(),
        from_nought: true,
        layers,
        ..Panel::default()
    };
    let count = table.measurements.len();
    Picture {
        title: format!("Stops of train {train} on {layout}"),
        subtitle: format!("{count} measured by hand; bars are 95 % of what is not known of each"),
        panels: vec![panel],
    }
}
