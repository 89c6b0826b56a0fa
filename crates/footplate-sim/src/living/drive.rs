//! Decoder and motor of a train on a living layout, by the usual model or the second one.

use std::sync::Arc;

use footplate_core::SpeedStep;

use crate::draws::Draws;
use crate::electric::{ElectricMotor, Surroundings};
use crate::motor::Motor;
use crate::train::Train;
use crate::traits::Session;

/// The deceleration of an undriven train of the usual model by a gradient, in mm/s² per unit of gradient and of the train's
/// sensitivity to it (chosen: gears take most of the 9810).
const SLOPE_MM_PER_S2: f64 = 1000.0;

/// Decoder and motor of one train.
#[derive(Debug, Clone)]
pub(crate) enum Drive {
    /// A set speed that moves by a law, and a motor behind it.
    Usual(Motor<Arc<Train>>),
    /// Voltages and forces.
    Electric(Box<ElectricMotor>),
}

impl Drive {
    pub(crate) fn at_rest(train: &Arc<Train>) -> Self {
        match train.traits.engine {
            Some(engine) => Self::Electric(Box::new(ElectricMotor::at_rest(engine))),
            None => Self::Usual(Motor::at_rest(Arc::clone(train))),
        }
    }

    /// Stops it; its decoder forgets its commands.
    pub(crate) fn reset(&mut self) {
        match self {
            Self::Usual(motor) => *motor = motor.reset(),
            Self::Electric(motor) => **motor = motor.reset(),
        }
    }

    pub(crate) fn begin_session(&mut self, session: Session) {
        match self {
            Self::Usual(motor) => motor.begin_session(session),
            Self::Electric(motor) => motor.begin_session(session),
        }
    }

    /// The next start from rest comes earlier by a time in s; the second model has no dead time to shorten.
    pub(crate) fn advance_next_start(&mut self, by: f64) {
        if let Self::Usual(motor) = self {
            motor.advance_next_start(by);
        }
    }

    /// Whether gradients, curves and sessions are in its speed already.
    pub(crate) const fn feels_the_rail(&self) -> bool {
        matches!(self, Self::Electric(_))
    }

    /// Speed of the wheels, in mm/s.
    pub(crate) fn speed(&self) -> f64 {
        match self {
            Self::Usual(motor) => motor.wheel_speed(),
            Self::Electric(motor) => motor.speed,
        }
    }

    pub(crate) fn is_at_rest(&self) -> bool {
        self.speed() == 0.0
    }

    /// None of its commands will move it.
    pub(crate) fn stays_at_rest(&self) -> bool {
        match self {
            Self::Usual(motor) => motor.stays_at_rest(),
            Self::Electric(motor) => motor.stays_at_rest(),
        }
    }

    pub(crate) fn command(&mut self, step: SpeedStep, draws: &mut Draws) {
        match self {
            Self::Usual(motor) => motor.command(step, draws),
            Self::Electric(motor) => motor.command(step, draws),
        }
    }

    /// Cuts its current until a higher step is commanded.
    pub(crate) fn cut_off(&mut self) {
        match self {
            Self::Usual(motor) => motor.stall(),
            Self::Electric(motor) => motor.cut_off(),
        }
    }

    /// Speed of the wheels one step later.
    pub(crate) fn advance(&mut self, around: Surroundings, draws: &mut Draws) -> f64 {
        match self {
            Self::Usual(motor) => {
                motor.slope = SLOPE_MM_PER_S2 * around.grade;
                motor.advance()
            }
            Self::Electric(motor) => motor.advance(around, draws),
        }
    }
}
