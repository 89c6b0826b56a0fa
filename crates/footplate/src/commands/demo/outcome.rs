//! The results of the demo: true places of rest beside the predicted intervals.

use footplate_core::{Length, SpeedStep, TimeSpan, TrainId};
use serde_json::{Value, json};

use crate::commands::calibrate::minutes;

/// One stop: target, prediction and truth.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MadeStop {
    pub(super) train: TrainId,
    /// The target.
    pub(super) target: String,
    /// The step that it stopped from.
    pub(super) step: SpeedStep,
    /// The true place of rest, past the sensor of the target.
    pub(super) rest: String,
    /// How far beyond the target that is; negative short of it.
    pub(super) error: Length,
    /// The predicted 95 % interval of `error`.
    pub(super) promised: [Length; 2],
    /// The program's own estimate of `error`.
    pub(super) estimated_error: Option<Length>,
}

/// The calibration of one train.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Learnt {
    pub(super) train: TrainId,
    /// Simulated time that it took.
    pub(super) took: TimeSpan,
    /// The steps that move the train.
    pub(super) steps: Vec<LearntStep>,
    /// Stops that it was measured with.
    pub(super) stops: u32,
    /// Detections that it was measured with.
    pub(super) detections: u32,
}

/// The calibration of one step: mean speed, and half the 95 % interval of stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LearntStep {
    pub(super) step: SpeedStep,
    pub(super) mm_per_s: f64,
    pub(super) stops_within: Length,
}

impl MadeStop {
    pub(super) fn is_inside(&self) -> bool {
        let [low, high] = self.promised;
        (low..=high).contains(&self.error)
    }

    pub(super) fn value(&self) -> Value {
        let [low, high] = self.promised;
        json!({
            "train": self.train.0,
            "target": self.target,
            "from_step": self.step.get(),
            "rest": self.rest,
            "error_mm": tenths(self.error),
            "promised_low_mm": tenths(low),
            "promised_high_mm": tenths(high),
            "believed_error_mm": self.estimated_error.map(tenths),
            "inside": self.is_inside(),
        })
    }

    /// The row of the table, without the last column.
    pub(super) fn row(&self) -> String {
        let [low, high] = self.promised;
        format!(
            "  {:>5}  {:<12} {:>9}   {:<12} {:>9}   {:>16}   ",
            self.train,
            self.target,
            self.step,
            self.rest,
            signed(self.error),
            format!("{} … {}", signed(low), signed(high)),
        )
    }

    /// The stop as a sentence.
    pub(super) fn sentence(&self) -> String {
        let mm = self.error.as_mm().round();
        let side = if mm < 0.0 { "short of" } else { "beyond" };
        let [low, high] = self.promised;
        format!(
            "train {} stopped {:.0} mm {side} {}, from step {} (predicted {} … {} mm)",
            self.train,
            mm.abs(),
            self.target,
            self.step,
            signed(low),
            signed(high)
        )
    }

    pub(super) fn verdict(&self) -> &'static str {
        if self.is_inside() { "inside" } else { "outside" }
    }
}

/// The header of the table.
pub(super) fn head() -> String {
    format!(
        "  {:>5}  {:<12} {:>9}   {:<12} {:>9}   {:>16}   {}",
        "train", "target", "from step", "rest at", "error mm", "predicted mm", "95 %"
    )
}

/// The results of all stops as a sentence; `None` without stops.
pub(super) fn summary(stops: &[MadeStop]) -> Option<String> {
    let mut errors: Vec<f64> = stops.iter().map(|stop| stop.error.as_mm().abs()).collect();
    errors.sort_by(f64::total_cmp);
    let (median, largest) = (errors.get(errors.len() / 2)?, errors.last()?);
    let inside = stops.iter().filter(|stop| stop.is_inside()).count();
    Some(format!(
        "{inside} of {} stops ended inside the predicted interval; half within {median:.0} mm of the \
         target, all within {largest:.0} mm.",
        stops.len()
    ))
}

impl Learnt {
    pub(super) fn value(&self) -> Value {
        let steps: Vec<Value> = self
            .steps
            .iter()
            .map(|known| {
                json!({
                    "step": known.step.get(),
                    "speed_mm_per_s": (10.0 * known.mm_per_s).round() / 10.0,
                    "stops_within_mm": tenths(known.stops_within),
                })
            })
            .collect();
        json!({
            "train": self.train.0,
            "track_time_s": (10.0 * self.took.as_s()).round() / 10.0,
            "stops": self.stops,
            "contacts": self.detections,
            "steps": steps,
        })
    }

    /// The calibration as a sentence.
    pub(super) fn sentence(&self) -> String {
        let within = |known: &LearntStep| known.stops_within.as_mm();
        let best = self.steps.iter().min_by(|one, other| within(one).total_cmp(&within(other)));
        let (Some(first), Some(last), Some(best)) = (self.steps.first(), self.steps.last(), best) else {
            return format!("train {} was not calibrated: no step moves it reliably", self.train);
        };
        let worst =
            self.steps.iter().max_by(|one, other| within(one).total_cmp(&within(other))).unwrap_or(last);
        format!(
            "train {} calibrated in {} ({} reports, {} stops): steps {} to {}, {:.0} to {:.0} mm/s, \
             stops to ±{:.0} … ±{:.0} mm",
            self.train,
            minutes(self.took),
            self.detections,
            self.stops,
            first.step,
            last.step,
            first.mm_per_s,
            last.mm_per_s,
            within(best),
            within(worst),
        )
    }
}

/// `+4`, `−12`, with a minus as wide as the plus.
pub(super) fn signed(length: Length) -> String {
    let mm = length.as_mm().round();
    if mm < 0.0 { format!("−{:.0}", -mm) } else { format!("+{:.0}", mm.abs()) }
}

fn tenths(length: Length) -> f64 {
    (10.0 * length.as_mm()).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stop(error_mm: f64) -> MadeStop {
        MadeStop {
            train: TrainId(24),
            target: "C13+120mm".to_owned(),
            step: SpeedStep::STAND,
            rest: "C13+124mm".to_owned(),
            error: Length::from_mm(error_mm),
            promised: [-9.0, 9.0].map(Length::from_mm),
            estimated_error: None,
        }
    }

    #[test]
    fn a_stop_is_inside_if_its_error_is_between_what_was_promised() {
        assert!([-9.0, 0.0, 9.0].iter().all(|error| stop(*error).is_inside()));
        assert!([-9.1, 9.1].iter().all(|error| !stop(*error).is_inside()));
        let all = summary(&[stop(2.0), stop(-4.0), stop(12.0)]).unwrap();
        assert!(
            all.starts_with("2 of 3 stops") && all.ends_with("within 4 mm of the target, all within 12 mm.")
        );
        assert_eq!(summary(&[]), None);
    }

    #[test]
    fn numbers_are_written_as_people_read_them() {
        assert_eq!([-0.4, 0.4, -1.6, 12.0].map(|mm| signed(Length::from_mm(mm))), ["+0", "+0", "−2", "+12"]);
    }
}
