//! Accelerations by the two-sensor method, as text and as JSON, beside those of the motion model.

use std::io::Write;

use anyhow::bail;
use footplate_core::kinematics::TwoSensorVerdict;
use footplate_core::model::MotionModel;
use footplate_core::model::report::{TwoSensorChange, TwoSensorMean};
use footplate_core::track::Layout;
use footplate_core::{Acceleration, Estimate, TrainId};
use footplate_store::Batch;
use serde_json::{Value, json};

/// The changes of one train.
struct TrainChanges<'b> {
    model: &'b MotionModel,
    changes: Vec<TwoSensorChange>,
}

pub(super) fn write(
    layout: &Layout,
    batch: &Batch,
    is_json: bool,
    output: &mut dyn Write,
) -> anyhow::Result<()> {
    let trains: Vec<TrainChanges<'_>> = batch
        .trains
        .iter()
        .map(|train| {
            let model = train.replay.fit.model();
            let running = &train.review.running;
            let changes = TwoSensorChange::find(layout, &batch.sections, model, running, &batch.passages);
            TrainChanges { model, changes }
        })
        .collect();
    if trains.iter().all(|train| train.changes.is_empty()) {
        let numbers: Vec<String> = trains.iter().map(|train| train.model.train().to_string()).collect();
        bail!(
            "no change of speed between two sensors in {} runs of train {}: the train should run steadily at one step past a \
             sensor, be commanded to another step, and pass the next sensor; starts from standstill do not count",
            batch.runs.len(),
            numbers.join(", ")
        );
    }
    if is_json {
        let trains: Vec<Value> = trains.iter().map(|train| train.form(layout, batch)).collect();
        let form = json!({ "layout": layout.name(), "trains": trains });
        writeln!(output, "{}", serde_json::to_string_pretty(&form)?)?;
        return Ok(());
    }
    for train in &trains {
        train.write_text(layout, batch, output)?;
    }
    writeln!(
        output,
        "value ± one standard deviation. Scenario 1: the train reached its target speed before the second sensor; 2: it did not.\n\
         The method takes every change to be even: where the two means differ by more than twice their ±, the train changes its\n\
         speed by another law, which footplate calibrate without --method names"
    )?;
    Ok(())
}

impl TrainChanges<'_> {
    fn train(&self) -> TrainId {
        self.model.train()
    }

    fn write_text(&self, layout: &Layout, batch: &Batch, output: &mut dyn Write) -> anyhow::Result<()> {
        let best = TwoSensorChange::best(&self.changes);
        writeln!(output, "Train {}: changes of speed between two sensors", self.train())?;
        writeln!(
            output,
            "  step     sensors     distance mm  time s  verdict       target speed  acceleration mm/s²"
        )?;
        for change in &self.changes {
            let [from, to] = change.steps;
            let [first, second] = change.sensors.map(|sensor| layout.sensor_name(sensor).to_string());
            let measured = &change.measured;
            let (verdict, reached, shown) = words(change);
            let mark = if best.contains(change) { "*" } else { " " };
            writeln!(
                output,
                "{mark} {from:>2} → {to:<2}  {:<11} {:>11.0} {:>7.2}  {verdict:<13} {reached:<13} {shown}{}",
                format!("{first}–{second}"),
                measured.distance.value.as_mm(),
                (measured.before_command.value + measured.time.value).as_s(),
                run_name(batch, change).map_or_else(String::new, |run| format!("  ({run})")),
            )?;
        }
        let means = TwoSensorMean::of(&self.changes);
        writeln!(output, "* tells the acceleration of its change best, and is used below")?;
        if means.is_empty() {
            writeln!(output, "no pair of sensors decides on an acceleration\n")?;
            return Ok(());
        }
        writeln!(output, "\n  mean of changes     two sensors mm/s²   motion model mm/s²   changes")?;
        for mean in &means {
            let [from, to] = mean.steps;
            writeln!(
                output,
                "  step {from:>2} → {to:<2}     {:>19} {:>20} {:>9}",
                uncertain(mean.acceleration),
                self.model.ramp_acceleration(from, to).map_or_else(|| "at once".to_owned(), uncertain),
                mean.acceleration.count
            )?;
        }
        writeln!(output)?;
        Ok(())
    }

    fn form(&self, layout: &Layout, batch: &Batch) -> Value {
        let best = TwoSensorChange::best(&self.changes);
        let change = |change: &TwoSensorChange| {
            let [from, to] = change.steps;
            let [first, second] = change.sensors.map(|sensor| layout.sensor_name(sensor).to_string());
            let measured = &change.measured;
            let (verdict, _, _) = words(change);
            let (if_completed, if_unfinished) = either(change);
            json!({
                "run": run_name(batch, change),
                "line": batch.event(change.run, change.entry).map(|event| event.line),
                "from_step": from,
                "to_step": to,
                "first_sensor": first,
                "second_sensor": second,
                "distance_mm": quantity(measured.distance.value.as_mm(), measured.distance.uncertainty.as_mm()),
                "before_command_s": quantity(measured.before_command.value.as_s(), measured.before_command.uncertainty.as_s()),
                "time_s": quantity(measured.time.value.as_s(), measured.time.uncertainty.as_s()),
                "delay_s": quantity(measured.command_delay.value.as_s(), measured.command_delay.uncertainty.as_s()),
                "from_speed_mm_per_s": quantity(measured.from.value.as_mm_per_s(), measured.from.uncertainty.as_mm_per_s()),
                "to_speed_mm_per_s": quantity(measured.to.value.as_mm_per_s(), measured.to.uncertainty.as_mm_per_s()),
                "verdict": verdict.replace(' ', "_"),
                "reached_target_speed": reached(change),
                "acceleration_mm_per_s2": change.acceleration().map(acceleration),
                "if_reached_mm_per_s2": if_completed.map(acceleration),
                "if_not_reached_mm_per_s2": if_unfinished.map(acceleration),
                "refused": change.verdict.err().map(|refused| refused.to_string()),
                "used": best.contains(change),
            })
        };
        let mean = |mean: &TwoSensorMean| {
            let [from, to] = mean.steps;
            json!({
                "from_step": from,
                "to_step": to,
                "changes": mean.acceleration.count,
                "acceleration_mm_per_s2": acceleration(mean.acceleration),
                "motion_model_mm_per_s2": self.model.ramp_acceleration(from, to).map(acceleration),
            })
        };
        json!({
            "train": self.train(),
            "changes": self.changes.iter().map(change).collect::<Vec<_>>(),
            "means": TwoSensorMean::of(&self.changes).iter().map(mean).collect::<Vec<_>>(),
        })
    }
}

/// The verdict, whether the train reached its target speed, and the acceleration, in words.
fn words(change: &TwoSensorChange) -> (&'static str, String, String) {
    match change.verdict {
        Ok(TwoSensorVerdict::Completed { acceleration, duration }) => {
            ("scenario 1", format!("after {:.2} s", duration.as_s()), uncertain(acceleration))
        }
        Ok(TwoSensorVerdict::Unfinished { acceleration, speed }) => {
            ("scenario 2", format!("at {:.0} mm/s", speed.as_mm_per_s()), uncertain(acceleration))
        }
        Ok(TwoSensorVerdict::Undecided { if_completed, if_unfinished }) => (
            "cannot tell",
            "–".to_owned(),
            format!("{} if reached, {} if not", uncertain(if_completed), uncertain(if_unfinished)),
        ),
        Ok(TwoSensorVerdict::TooQuick) => {
            ("too quick", "reached".to_owned(), "over too soon: take a nearer sensor".to_owned())
        }
        Ok(TwoSensorVerdict::NotNoticed) => {
            ("not noticed", "–".to_owned(), "no change seen yet: take a sensor farther on".to_owned())
        }
        Err(refused) => ("refused", "–".to_owned(), refused.to_string()),
    }
}

/// Whether the train reached its target speed before the second sensor, where the data tell.
const fn reached(change: &TwoSensorChange) -> Option<bool> {
    match change.verdict {
        Ok(TwoSensorVerdict::Completed { .. } | TwoSensorVerdict::TooQuick) => Some(true),
        Ok(TwoSensorVerdict::Unfinished { .. }) => Some(false),
        _ => None,
    }
}

/// The two accelerations between which the data cannot decide.
const fn either(
    change: &TwoSensorChange,
) -> (Option<Estimate<Acceleration>>, Option<Estimate<Acceleration>>) {
    match change.verdict {
        Ok(TwoSensorVerdict::Undecided { if_completed, if_unfinished }) => {
            (Some(if_completed), Some(if_unfinished))
        }
        _ => (None, None),
    }
}

/// `recording:run` of a change.
fn run_name(batch: &Batch, change: &TwoSensorChange) -> Option<String> {
    batch.runs.get(change.run).map(|run| format!("{}:{}", run.recording, run.id))
}

fn uncertain(of: Estimate<Acceleration>) -> String {
    format!("{:.0} ± {:.0}", of.value.as_mm_per_s2(), of.uncertainty.as_mm_per_s2())
}

fn acceleration(of: Estimate<Acceleration>) -> Value {
    quantity(of.value.as_mm_per_s2(), of.uncertainty.as_mm_per_s2())
}

fn quantity(value: f64, uncertainty: f64) -> Value {
    json!({ "value": value, "uncertainty": uncertainty })
}
