//! Converts a motion model to its file form, and back.

use footplate_core::model::survey::SectionIndex;
use footplate_core::model::{MotionModel, MotionNumbers, NumbersError, StepUse};
use footplate_core::track::{Hop, Layout};
use footplate_core::{Approach, EdgeId, Length, SensorId, SpeedStep, Timestamp};

use super::form::{
    ExactForm, MOTION_MODEL_VERSION, MotionFile, MotionSectionForm, MotionStepForm, SensorScatterForm,
    StopOffsetForm, UseForm,
};
use crate::quantity::Quantity;

impl MotionFile {
    /// The file form of a model. `newest`: the time of the last event that it was fitted to, since the Unix epoch.
    pub fn of(layout: &Layout, model: &MotionModel, newest: Option<Timestamp>) -> Self {
        let sections = SectionIndex::of(layout);
        let numbers = model.numbers();
        let measured_at_s = newest.map(Timestamp::as_s);
        let steps = || (1..=model.highest().get()).filter_map(SpeedStep::new);
        let known = steps().filter(|step| model.uses(*step) == StepUse::Moves);
        Self {
            model_version: MOTION_MODEL_VERSION.to_owned(),
            layout: layout.name().to_owned(),
            train: model.train(),
            highest_step: model.highest(),
            unreliable_steps: steps().filter(|step| model.uses(*step) == StepUse::Unreliable).collect(),
            steps: known.flat_map(|step| both_approaches(model, step, measured_at_s)).collect(),
            sections: named(layout, &sections)
                .filter(|(_, section)| numbers.sections.iter().any(|(known, ..)| known == section))
                .map(|(hop, _)| section_form(layout, &sections, model, &hop, measured_at_s))
                .collect(),
            stop_offsets: numbers
                .stop_offsets
                .iter()
                .filter_map(|offset| stop_offset_form(layout, offset))
                .collect(),
            sensors: sensor_forms(layout, &numbers),
            exact: exact(&numbers, measured_at_s),
        }
    }

    /// The model. Sections that the layout does not have are left out.
    ///
    /// # Errors
    /// The numbers are not those of a model.
    pub fn model(&self, layout: &Layout) -> Result<MotionModel, NumbersError> {
        let index = SectionIndex::of(layout);
        let hop_between = |from: &str, to: &str| {
            let (from, to) = (layout.node_named(from)?, layout.node_named(to)?);
            layout.hops_from(from).find(|hop| hop.to == to)
        };
        let sections = self.sections.iter().filter_map(|form| {
            let hop = hop_between(&form.from, &form.to)?;
            // The layout may have been surveyed again since.
            let longer_mm = form.surveyed_mm + form.add.value - hop.length.as_mm();
            Some((index.section(hop.id)?, 1e-3 * longer_mm, 1e-6 * form.add.uncertainty.powi(2)))
        });
        let offsets = self.stop_offsets.iter().filter_map(|form| {
            let (from, to) = (layout.node_named(&form.from)?, layout.node_named(&form.to)?);
            let (edge, _) = layout.edges().find(|(_, edge)| (edge.from, edge.to) == (from, to))?;
            Some((usize::from(edge.0), 1e-3 * form.add.value, 1e-6 * form.add.uncertainty.powi(2)))
        });
        let sensors = self.sensors.iter().filter_map(|form| {
            let sensor = layout.sensor_at(layout.node_named(&form.sensor)?)?;
            Some((sensor, 1e-3 * form.scatter_mm))
        });
        let exact = &self.exact;
        MotionModel::from_numbers(&MotionNumbers {
            train: self.train,
            highest: self.highest_step,
            values: exact.values.clone(),
            covariance: exact.covariance.clone(),
            sections: sections.collect(),
            stop_offsets: offsets.collect(),
            stop_offset_deviation: exact.stop_offset_deviation,
            residual_scales: exact.residual_scales,
            uses: exact.uses.iter().map(|form| form.step_use()).collect(),
            counts: exact
                .counts
                .iter()
                .map(|[c, s, above_c, above_s]| [(*c, *s), (*above_c, *above_s)])
                .collect(),
            scatter_scale: exact.scatter_scale,
            scatter_floor: exact.scatter_floor,
            stop_delay_scatter: exact.stop_delay_scatter,
            start_scale: exact.start_scale,
            usual_sensor_scatter: exact.usual_sensor_scatter,
            sensor_scatter: sensors.collect(),
            scale: exact.scale.clone(),
            date: exact.measured_at_s.map_or(Timestamp::ZERO, Timestamp::from_s),
        })
    }
}

fn both_approaches(
    model: &MotionModel,
    step: SpeedStep,
    measured_at_s: Option<f64>,
) -> impl Iterator<Item = MotionStepForm> + '_ {
    [Approach::Below, Approach::Above].into_iter().map(move |approach| {
        let (speed, stop) = (model.speed(step, approach), model.stop(step, approach));
        MotionStepForm {
            step,
            approach,
            speed: Quantity::speed(speed).dated(measured_at_s),
            stop: Quantity::length(stop.distance, stop.doubt, stop.count).dated(measured_at_s),
            stop_scatter_mm: stop.scatter.as_mm(),
            stop_s: stop.time.as_s(),
        }
    })
}

/// Every section with the first hop over it, which names it.
fn named<'l>(layout: &'l Layout, sections: &'l SectionIndex) -> impl Iterator<Item = (Hop<'l>, usize)> {
    let mut seen: Vec<usize> = Vec::new();
    layout.hops().filter_map(move |hop| {
        let section = sections.section(hop.id).filter(|section| !seen.contains(section))?;
        seen.push(section);
        Some((hop, section))
    })
}

fn section_form(
    layout: &Layout,
    sections: &SectionIndex,
    model: &MotionModel,
    hop: &Hop<'_>,
    measured_at_s: Option<f64>,
) -> MotionSectionForm {
    let [length, uncertainty] = model.length(sections, hop);
    let add: Length = length - hop.length;
    MotionSectionForm {
        from: layout.node_name(hop.from).to_owned(),
        to: layout.node_name(hop.to).to_owned(),
        surveyed_mm: hop.length.as_mm(),
        add: Quantity {
            value: add.as_mm(),
            uncertainty: uncertainty.as_mm(),
            unit: "mm".to_owned(),
            // Sections are fitted together from the passages of all runs: none has measurements of its own.
            measurements: 0,
            measured_at_s,
        },
    }
}

fn stop_offset_form(layout: &Layout, offset: &(usize, f64, f64)) -> Option<StopOffsetForm> {
    let (edge, offset, variance) = offset;
    let edge = layout.edge(EdgeId(u16::try_from(*edge).ok()?))?;
    Some(StopOffsetForm {
        from: layout.node_name(edge.from).to_owned(),
        to: layout.node_name(edge.to).to_owned(),
        add: Quantity {
            value: 1e3 * offset,
            uncertainty: 1e3 * variance.sqrt(),
            unit: "mm".to_owned(),
            // As for sections.
            measurements: 0,
            measured_at_s: None,
        },
    })
}

fn sensor_forms(layout: &Layout, numbers: &MotionNumbers) -> Vec<SensorScatterForm> {
    let form = |(sensor, scatter): &(SensorId, f64)| {
        let sensor = layout.node_name(layout.sensor_node(*sensor)?).to_owned();
        Some(SensorScatterForm { sensor, scatter_mm: 1e3 * scatter })
    };
    numbers.sensor_scatter.iter().filter_map(form).collect()
}

fn exact(numbers: &MotionNumbers, measured_at_s: Option<f64>) -> ExactForm {
    let counts = numbers.counts.iter().map(|[below, above]| [below.0, below.1, above.0, above.1]);
    ExactForm {
        measured_at_s,
        scatter_scale: numbers.scatter_scale,
        scatter_floor: numbers.scatter_floor,
        stop_delay_scatter: numbers.stop_delay_scatter,
        stop_offset_deviation: numbers.stop_offset_deviation,
        residual_scales: numbers.residual_scales,
        start_scale: numbers.start_scale,
        usual_sensor_scatter: numbers.usual_sensor_scatter,
        scale: numbers.scale.clone(),
        counts: counts.collect(),
        uses: numbers.uses.iter().map(|found| UseForm::of(*found)).collect(),
        values: numbers.values.clone(),
        covariance: numbers.covariance.clone(),
    }
}

impl UseForm {
    const fn of(found: StepUse) -> Self {
        match found {
            StepUse::Untried => Self::Untried,
            StepUse::Moves => Self::Moves,
            StepUse::Unreliable => Self::Unreliable,
        }
    }

    const fn step_use(self) -> StepUse {
        match self {
            Self::Untried => StepUse::Untried,
            Self::Moves => StepUse::Moves,
            Self::Unreliable => StepUse::Unreliable,
        }
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::TrainId;

    use super::*;

    fn model() -> MotionModel {
        let mut numbers = MotionModel::unknown(TrainId(24), SpeedStep::new(14).unwrap()).numbers();
        numbers.uses[9] = StepUse::Moves;
        numbers.uses[1] = StepUse::Unreliable;
        numbers.counts[9] = [(31, 4), (12, 2)];
        numbers.sections = vec![(0, 0.012, 4e-6), (7, -0.003, 9e-6)];
        numbers.date = Timestamp::from_s(1_795_248_000.0);
        MotionModel::from_numbers(&numbers).unwrap()
    }

    #[test]
    fn a_file_says_what_the_model_says_and_makes_the_same_model() {
        let layout = crate::built_in("track-a").unwrap().layout;
        let model = model();
        let file = MotionFile::of(&layout, &model, Some(Timestamp::from_s(1_795_248_000.0)));
        // Step 9 moves the train, from either side; step 1 does not, and the others were never tried.
        assert_eq!(file.steps.len(), 2);
        assert_eq!((file.steps[0].stop.measurements, file.steps[1].speed.measurements), (4, 12));
        assert_eq!(file.unreliable_steps, [SpeedStep::new(1).unwrap()]);
        assert_eq!(file.sections.len(), 2);
        assert!((file.sections[0].add.value - 12.0).abs() < 1e-9);
        for text in [toml::to_string(&file).unwrap(), serde_json::to_string(&file).unwrap()] {
            let again: MotionFile = if text.starts_with('{') {
                serde_json::from_str(&text).unwrap()
            } else {
                toml::from_str(&text).unwrap()
            };
            assert_eq!(again, file);
            let back = again.model(&layout).unwrap();
            let step = SpeedStep::new(9).unwrap();
            assert_eq!(back.stop(step, Approach::Above), model.stop(step, Approach::Above));
            assert_eq!(back.speed(step, Approach::Below).value, model.speed(step, Approach::Below).value);
            let sections = SectionIndex::of(&layout);
            for hop in layout.hops() {
                let (one, other) = (back.length(&sections, &hop), model.length(&sections, &hop));
                assert!((one[0] - other[0]).as_mm().abs() < 1e-9 && (one[1] - other[1]).as_mm().abs() < 1e-9);
            }
        }
    }
}
