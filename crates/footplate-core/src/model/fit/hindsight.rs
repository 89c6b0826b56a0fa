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
    #[must_use]
    pub fn sensors_passed(&self) -> u32 {
        self.counts.iter().flatten().map(|counts| counts.contacts).sum()
    }
}
