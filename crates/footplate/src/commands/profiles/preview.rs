//! What an import changes: by step, the new speeds, the current ones and the merged ones.

use std::io::Write;

use footplate_core::model::{MotionFit, MotionModel, StatedFit};
use footplate_core::{Approach, SpeedStep, TrainId};
use footplate_store::{ProfileSpeed, SpeedProfile};
use serde_json::json;

/// A profile beside the models before and after it.
pub(super) struct Preview<'p> {
    pub(super) train: TrainId,
    pub(super) profile: &'p SpeedProfile,
    pub(super) current: &'p MotionModel,
    pub(super) merged: &'p MotionModel,
    /// The store that it is kept in, if it is.
    pub(super) kept_in: Option<String>,
}

/// One line of the table.
struct Line<'p> {
    step: SpeedStep,
    /// The entries nearest to this step.
    stated: Vec<&'p ProfileSpeed>,
    /// Speed and uncertainty (mm/s) of the models before and after.
    current: (f64, f64),
    merged: (f64, f64),
}

impl Preview<'_> {
    fn lines(&self) -> Vec<Line<'_>> {
        let highest = self.merged.highest().get();
        let is_nearest =
            |entry: &ProfileSpeed, step: u8| (entry.throttle * f64::from(highest)).round() == f64::from(step);
        let speed = |model: &MotionModel, step| {
            let speed = model.speed(step, Approach::Below);
            (speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s())
        };
        let all = (1..=highest).filter_map(SpeedStep::new).map(|step| Line {
            step,
            stated: self.profile.speeds.iter().filter(|entry| is_nearest(entry, step.get())).collect(),
            current: speed(self.current, step),
            merged: speed(self.merged, step),
        });
        // Of 126 steps only those that the profile is about.
        all.filter(|line| highest <= 28 || !line.stated.is_empty()).collect()
    }

    /// How each entry fits the others; the worse of its directions.
    fn fits(&self) -> Vec<(&ProfileSpeed, Option<StatedFit>)> {
        let (motion, of) = self.profile.stated();
        let mut fit = MotionFit::new(self.train, self.merged.highest());
        let fits = fit.take_stated(&motion);
        let worst = |place: usize| {
            let own = fits.iter().zip(&of).filter(|(_, of)| **of == place).filter_map(|(fit, _)| *fit);
            own.max_by(|one, other| one.sigmas.abs().total_cmp(&other.sigmas.abs()))
        };
        self.profile.speeds.iter().enumerate().map(|(place, entry)| (entry, worst(place))).collect()
    }

    pub(super) fn write(&self, output: &mut dyn Write) -> std::io::Result<()> {
        let Self { train, profile, kept_in, .. } = self;
        writeln!(output, "{} for train {train}: {} speeds", profile.source, profile.speeds.len())?;
        writeln!(
            output,
            "step  forward  reverse         current          merged  (mm/s, ± one standard deviation)"
        )?;
        for line in self.lines() {
            let shown = |of: &dyn Fn(&ProfileSpeed) -> Option<f64>| {
                let found: Vec<String> = line
                    .stated
                    .iter()
                    .filter_map(|entry| of(entry))
                    .map(|speed| format!("{speed:.0}"))
                    .collect();
                if found.is_empty() { "-".to_owned() } else { found.join(",") }
            };
            let model = |(speed, uncertainty): (f64, f64)| format!("{speed:.0} ± {uncertainty:.0}");
            writeln!(
                output,
                "{:>4} {:>8} {:>8} {:>15} {:>15}",
                line.step.get(),
                shown(&|entry| entry.forward_mm_s),
                shown(&|entry| entry.reverse_mm_s),
                model(line.current),
                model(line.merged),
            )?;
        }
        for note in &profile.notes {
            writeln!(output, "{note}")?;
        }
        for (entry, fit) in self.fits() {
            match fit {
                None => writeln!(
                    output,
                    "line {}: throttle {:.3} is below step 1 of this decoder; not used",
                    entry.line, entry.throttle
                )?,
                Some(fit) if fit.contradicts() => writeln!(
                    output,
                    "line {}: {} contradicts the other speeds, which predict {:.0} mm/s at throttle {:.3}; weight {:.2}",
                    entry.line,
                    directions(entry),
                    fit.predicted.as_mm_per_s(),
                    entry.throttle,
                    fit.weight,
                )?,
                Some(_) => {}
            }
        }
        writeln!(output, "stops and starts are not part of a profile: they are as uncertain as before")?;
        match kept_in {
            Some(store) => writeln!(output, "kept in {store}: drive and calibrate begin with it"),
            None => writeln!(output, "nothing was kept; --store FILE keeps it"),
        }
    }

    pub(super) fn write_json(&self, output: &mut dyn Write) -> std::io::Result<()> {
        let model =
            |(speed, uncertainty): (f64, f64)| json!({"speed_mm_s": speed, "uncertainty_mm_s": uncertainty});
        let lines = self.lines();
        let steps = lines.iter().map(|line| {
            json!({
                "step": line.step.get(),
                "forward_mm_s": line.stated.iter().filter_map(|entry| entry.forward_mm_s).collect::<Vec<f64>>(),
                "reverse_mm_s": line.stated.iter().filter_map(|entry| entry.reverse_mm_s).collect::<Vec<f64>>(),
                "current": model(line.current),
                "merged": model(line.merged),
            })
        });
        let entries = self.fits().into_iter().map(|(entry, fit)| {
            json!({
                "line": entry.line,
                "throttle": entry.throttle,
                "predicted_mm_s": fit.map(|fit| fit.predicted.as_mm_per_s()),
                "sigmas": fit.map(|fit| fit.sigmas),
                "weight": fit.map(|fit| fit.weight),
            })
        });
        let report = json!({
            "file": self.profile.source,
            "train": self.train.0,
            "kept_in": self.kept_in,
            "steps": steps.collect::<Vec<_>>(),
            "entries": entries.collect::<Vec<_>>(),
            "notes": self.profile.notes.iter().map(ToString::to_string).collect::<Vec<_>>(),
        });
        writeln!(output, "{report}")
    }
}

/// The speeds of an entry, in words.
fn directions(entry: &ProfileSpeed) -> String {
    let of = |name: &str, speed: Option<f64>| speed.map(|speed| format!("{name} {speed:.1} mm/s"));
    let both = [of("forward", entry.forward_mm_s), of("reverse", entry.reverse_mm_s)];
    both.into_iter().flatten().collect::<Vec<_>>().join(", ")
}
