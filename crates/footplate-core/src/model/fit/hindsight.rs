//! A model with known values, for oracles: forecasts as they would be with nothing left to learn.

use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::model::MotionModel;
use crate::model::parameters::{Answers, HYSTERESIS, hysteresis_at, speed_at, stride};
use crate::model::spread::Spread;
use crate::units::Speed;

impl MotionModel {
    /// The same model without uncertainty, neither of the train's numbers nor of lengths.
    #[must_use]
    pub fn taken_for_certain(&self) -> Self {
        let side = crate::model::parameters::count(self.steps());
        let mut certain = self.clone();
        certain.spread = Spread::of_lower_triangle(side, &alloc::vec![0.0; side * (side + 1) / 2]);
        for (_, variance) in certain.sections.values_mut() {
            *variance = 0.0;
        }
        for (_, variance) in certain.stop_offsets.of_edge.values_mut() {
            *variance = 0.0;
        }
        certain
    }

    /// Sets the steady speed at a step. Speeds that are not positive and steps that have no number of their own
    /// ([`knots`](Self::knots)) are ignored.
    pub fn tell_speed(&mut self, step: SpeedStep, approach: Approach, speed: Speed) {
        let (place, speed, stride) = (usize::from(step.get()), speed.as_m_per_s(), stride(self.steps()));
        if !(1..=self.steps()).contains(&place)
            || !place.is_multiple_of(stride)
            || speed.is_nan()
            || speed <= 0.0
        {
            return;
        }
        if approach != Approach::Above {
            if let Some(slot) = self.values.get_mut(speed_at(place / stride)) {
                *slot = libm::log(speed);
            }
            return;
        }
        let below = self.answers().speed(place, false);
        let common = self.values.get(HYSTERESIS).copied().unwrap_or(0.0);
        let own = (speed - below) / Answers::hysteresis_part(below).max(f64::MIN_POSITIVE) - common;
        let steps = self.steps();
        if let Some(slot) = self.values.get_mut(hysteresis_at(place / stride, steps)) {
            *slot = own;
        }
    }

    /// Sensors passed, over all steps.
    pub fn sensors_passed(&self) -> u32 {
        self.counts.iter().flatten().map(|counts| counts.contacts).sum()
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::ids::TrainId;

    /// Decoders of 14 steps have a number for each, those of 126 for every ninth.
    #[test]
    fn a_speed_that_was_given_is_the_speed_of_its_step_and_approach() {
        for highest in [14, 126] {
            let mut model = MotionModel::unknown(TrainId(24), SpeedStep::new(highest).unwrap());
            let given = |step: u8, approach: Approach| {
                let above = if approach == Approach::Above { 0.004 } else { 0.0 };
                Speed::from_m_per_s(0.2 + 0.5 * f64::from(step) / f64::from(highest) + above)
            };
            let knots: Vec<SpeedStep> =
                (1..=14).map(|knot| SpeedStep::new(knot * (highest / 14)).unwrap()).collect();
            for approach in [Approach::Below, Approach::Above] {
                knots.iter().for_each(|step| model.tell_speed(*step, approach, given(step.get(), approach)));
            }
            for approach in [Approach::Below, Approach::Above] {
                for step in &knots {
                    let (found, given) = (model.steady_speed(*step, approach), given(step.get(), approach));
                    assert!(
                        (found - given).as_m_per_s().abs() < 1e-9,
                        "{step:?} {approach:?}: {found:?}, not {given:?}"
                    );
                }
            }
        }
    }
}
