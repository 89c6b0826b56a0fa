//! What a model does not know of single changes of speed.

use super::model::MotionModel;
use super::parameters::{Answers, START_DELAY, speed_at};
use super::segment::{Segment, Told};

impl MotionModel {
    /// Variance of ln of the steady speed at a step.
    pub(crate) fn ln_speed_variance(&self, step: u8, above: bool) -> f64 {
        let place = usize::from(step);
        let speed = self.answers().speed(place, above);
        if speed <= 0.0 {
            return 0.0;
        }
        if !above && place >= 1 {
            return self.spread.variance(speed_at(place));
        }
        let deviation = self.deviation(|answers| answers.speed(place, above)) / speed;
        deviation * deviation
    }

    /// Variance of the delay of a start (s²).
    pub(crate) fn start_delay_variance(&self) -> f64 {
        self.spread.variance(START_DELAY)
    }

    /// One standard deviation (m) of the way to rest from a speed (m/s), for what is not known of the law.
    pub(crate) fn stop_doubt(&self, speed: f64) -> f64 {
        let told = Told { sent: 0.0, from: self.step_near(speed), to: 0, at_rest: false };
        self.deviation(|answers| {
            let segment = Segment::of(&told, answers, speed);
            speed * segment.begins + segment.way_to_rest()
        })
    }

    /// The same of where a train is that has started to a speed; the delay of the start apart.
    pub(crate) fn start_doubt(&self, speed: f64) -> f64 {
        let told = Told { sent: 0.0, from: 0, to: self.step_near(speed), at_rest: true };
        self.displacement_doubt(&told, 0.0, speed)
    }

    /// The same of a change from one speed to another.
    pub(crate) fn change_doubt(&self, from: f64, to: f64) -> f64 {
        let told = Told { sent: 0.0, from: self.step_near(from), to: self.step_near(to), at_rest: false };
        self.displacement_doubt(&told, from, to)
    }

    fn displacement_doubt(&self, told: &Told, from: f64, to: f64) -> f64 {
        self.deviation(|answers: &Answers<'_>| {
            let segment = Segment::between(told, answers, from, to);
            let delay = if told.at_rest { 0.0 } else { (from - to) * segment.begins };
            delay + segment.displacement()
        })
    }

    /// The step whose speed is nearest.
    fn step_near(&self, speed: f64) -> u8 {
        let answers = self.answers();
        let off = |step: &u8| (answers.speed(usize::from(*step), false) - speed).abs();
        (1..=self.highest().get()).min_by(|one, other| off(one).total_cmp(&off(other))).unwrap_or(1)
    }
}
