//! How far two sessions of the same trains agree: another day, another team, the same engine.
//!
//! What one session measured is promised for a later one with what trains differ by from session to session
//! ([`MotionModel::for_later_session`]); the other's own uncertainty comes on top. If both are stated truly, differences in
//! these standard deviations have a root mean square of one.

use footplate_core::model::MotionModel;
use footplate_core::{Approach, SpeedStep, TrainId};

use crate::batch::{Batch, BatchTrain};

/// A number that two sessions measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SessionFigure {
    /// The train.
    pub train: TrainId,
    /// The throttle step.
    pub step: SpeedStep,
    /// From which side it was reached.
    pub approach: Approach,
    /// What the first session measured, and one standard deviation (mm/s or mm).
    pub ours: [f64; 2],
    /// What the other did.
    pub theirs: [f64; 2],
    /// One standard deviation of the difference that is expected between sessions.
    pub deviation: f64,
}

impl SessionFigure {
    /// How much more the first session measured, in standard deviations.
    pub fn sigmas(&self) -> f64 {
        (self.ours[0] - self.theirs[0]) / self.deviation
    }

    /// The same in percent of the other.
    pub fn difference_percent(&self) -> f64 {
        100.0 * (self.ours[0] / self.theirs[0] - 1.0)
    }
}

/// All numbers that two sessions measured of the same trains.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionCheck {
    /// Steady speeds (mm/s), where each session passed sensors at the step.
    pub speeds: Vec<SessionFigure>,
    /// Stopping distances (mm), where each session measured a stop from the step.
    pub stops: Vec<SessionFigure>,
}

impl SessionCheck {
    /// Compares the trains that are in both. `None` where they have no step of a train in common.
    pub fn of(ours: &Batch, theirs: &Batch) -> Option<Self> {
        let mut check = Self { speeds: Vec::new(), stops: Vec::new() };
        for train in &ours.trains {
            let number = model(train).train();
            let Some(other) = theirs.trains.iter().find(|other| model(other).train() == number) else {
                continue;
            };
            check.compare(model(train), model(other));
        }
        (!check.speeds.is_empty() || !check.stops.is_empty()).then_some(check)
    }

    fn compare(&mut self, ours: &MotionModel, theirs: &MotionModel) {
        let promised = ours.for_later_session();
        let highest = ours.highest().min(theirs.highest());
        for step in (1..=highest.get()).filter_map(SpeedStep::new) {
            for approach in [Approach::Below, Approach::Above] {
                let figure = |number: Number, least: u32| {
                    let [one, later, other] =
                        [ours, &promised, theirs].map(|model| number(model, step, approach));
                    (one.2 > least && other.2 > least).then(|| SessionFigure {
                        train: ours.train(),
                        step,
                        approach,
                        ours: [one.0, one.1],
                        theirs: [other.0, other.1],
                        deviation: libm::hypot(later.1, other.1),
                    })
                };
                // A single sensor shows where a train was, not how fast it ran.
                self.speeds.extend(figure(speed, 1));
                self.stops.extend(figure(stop, 0));
            }
        }
    }
}

/// Value, standard deviation and number of measurements of a step.
type Number = fn(&MotionModel, SpeedStep, Approach) -> (f64, f64, u32);

/// That of a speed (mm/s).
fn speed(model: &MotionModel, step: SpeedStep, approach: Approach) -> (f64, f64, u32) {
    let speed = model.speed(step, approach);
    (speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s(), speed.count)
}

/// That of a stopping distance (mm).
fn stop(model: &MotionModel, step: SpeedStep, approach: Approach) -> (f64, f64, u32) {
    let stop = model.stop(step, approach);
    (stop.distance.as_mm(), stop.doubt.as_mm(), stop.count)
}

/// Root mean square and largest size of differences in standard deviations; `None` of none.
pub fn standardised(figures: &[SessionFigure]) -> Option<[f64; 2]> {
    let sizes = || figures.iter().map(|figure| figure.sigmas().abs());
    let squares: f64 = sizes().map(|size| size * size).sum();
    (!figures.is_empty()).then(|| [(squares / figures.len() as f64).sqrt(), sizes().fold(0.0, f64::max)])
}

const fn model(train: &BatchTrain) -> &MotionModel {
    train.replay.fit.model()
}
