//! A predictor takes over what a calibration file says.

use footplate_core::calibration::LawKind;
use footplate_core::estimation::Predictor;
use footplate_core::track::Layout;
use footplate_core::{Estimate, Speed, Timestamp};

use super::form::{CalibrationFile, ComparedLawForm, LawForm, TrainForm};

impl CalibrationFile {
    /// Makes a predictor know all trains of the file. Sections that the layout does not have are left out.
    pub fn prime(&self, layout: &Layout, predictor: &mut Predictor) {
        for train in &self.trains {
            prime_train(layout, predictor, train);
        }
    }
}

fn prime_train(layout: &Layout, predictor: &mut Predictor, form: &TrainForm) {
    let sections: Vec<(usize, f64, f64)> = form
        .sections
        .iter()
        .filter_map(|section| {
            let from = layout.node_named(&section.from)?;
            let to = layout.node_named(&section.to)?;
            let hop = layout.hops_from(from).find(|hop| hop.to == to)?;
            let stretch = predictor.sections().section(hop.id)?;
            let uncertainty = 1e-3 * section.correction.uncertainty;
            Some((stretch, 1e-3 * section.correction.value, uncertainty * uncertainty))
        })
        .collect();
    let Some(model) = predictor.train_mut(form.train) else { return };
    for (section, by, variance) in sections {
        model.lengths_mut().set(section, by, variance);
    }
    for speed in &form.speeds {
        let estimate = Estimate {
            value: Speed::from_mm_per_s(speed.speed.value),
            uncertainty: Speed::from_mm_per_s(speed.speed.uncertainty),
            count: speed.runs,
            date: Timestamp::ZERO,
        };
        model.speeds_mut().set(speed.step, speed.approach, estimate);
    }
    for law in &form.laws {
        for known in model.laws_mut().laws_mut(law.direction) {
            let Some(fitted) = all(law).find(|fitted| fitted.law == LawKind::Family(known.family)) else {
                continue;
            };
            let scale = if fitted.pace.unit == "mm/s²" { 1e-3 } else { 1.0 };
            // Akaike's criterion is twice a ln likelihood, up to a constant that all laws share.
            let evidence = -0.5 * (fitted.criterion - law.best.criterion);
            known.take_over(scale * fitted.pace.value, fitted.delay.value, fitted.covariance, evidence);
        }
    }
}

fn all(law: &LawForm) -> impl Iterator<Item = &ComparedLawForm> {
    std::iter::once(&law.best).chain(&law.others)
}
