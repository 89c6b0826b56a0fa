//! What has been reached, as a table and as JSON.

use std::io::{self, Write};

use footplate_core::control::learn::StepAccuracy;
use footplate_core::track::Layout;
use footplate_core::{Approach, TimeSpan, TrainId};
use serde_json::{Value, json};

use super::ended::Why;

/// What there is to tell.
pub(super) struct Figures<'a> {
    pub(super) layout: &'a Layout,
    pub(super) train: TrainId,
    pub(super) took: TimeSpan,
    pub(super) accuracy: &'a [StepAccuracy],
    pub(super) mishaps: u32,
    pub(super) why: &'a Why,
}

impl Figures<'_> {
    pub(super) fn write_table(&self, output: &mut dyn Write) -> io::Result<()> {
        writeln!(
            output,
            "Train {} on {}: {} of track time, {}",
            self.train,
            self.layout.name(),
            minutes(self.took),
            self.why
        )?;
        if self.accuracy.is_empty() {
            return writeln!(output, "no step has been measured");
        }
        writeln!(
            output,
            "\n  step  reached from   speed mm/s         stop mm     std dev   95 % of stops within   \
             stops"
        )?;
        for line in self.accuracy {
            writeln!(
                output,
                "  {:>4}  {:<10} {:>8.1} ± {:<5.1} {:>8.0} ± {:<5.1} {:>6.1} {:>18.0} mm {:>11}",
                line.step,
                approach(line.approach),
                line.speed.value.as_mm_per_s(),
                line.speed.uncertainty.as_mm_per_s(),
                line.stop.distance.as_mm(),
                line.stop.doubt.as_mm(),
                line.stop.scatter.as_mm(),
                line.stop_within().as_mm(),
                line.stops
            )?;
        }
        writeln!(
            output,
            "\nvalue ± one standard deviation of the estimate; std dev is the repeatability of a single \
             stop\nAll figures hold for this session. In a later one the train runs a little otherwise \
             (warmth, dirt, load), and intervals\nbegin wider until it has run past some sensors"
        )
    }

    pub(super) fn write_json(&self, output: &mut dyn Write) -> io::Result<()> {
        let steps: Vec<Value> = self.accuracy.iter().map(step).collect();
        let result = json!({
            "train": self.train.0,
            "layout": self.layout.name(),
            "ended": self.why.word(),
            "why": self.why.to_string(),
            "track_time_s": self.took.as_s(),
            "mishaps": self.mishaps,
            "steps": steps,
        });
        writeln!(output, "{result}")
    }
}

fn step(line: &StepAccuracy) -> Value {
    json!({
        "step": line.step.get(),
        "approach": approach(line.approach),
        "speed_mm_s": line.speed.value.as_mm_per_s(),
        "speed_uncertainty_mm_s": line.speed.uncertainty.as_mm_per_s(),
        "contacts": line.speed.count,
        "stop_mm": line.stop.distance.as_mm(),
        "stop_doubt_mm": line.stop.doubt.as_mm(),
        "stop_scatter_mm": line.stop.scatter.as_mm(),
        "stop_time_s": line.stop.time.as_s(),
        "stop_within_95_mm": line.stop_within().as_mm(),
        "stops": line.stops,
    })
}

const fn approach(approach: Approach) -> &'static str {
    match approach {
        Approach::Above => "above",
        Approach::Below | Approach::Unknown => "below",
    }
}

/// A span as minutes and seconds.
pub(in crate::commands) fn minutes(span: TimeSpan) -> String {
    let seconds = span.as_s().max(0.0).round() as u64;
    format!("{}:{:02}", seconds / 60, seconds % 60)
}
