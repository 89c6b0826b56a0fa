//! Laws of speed change outside every family of the estimators, each written as a rate at a speed.

use crate::draws::Draws;

/// The law of a decoder's set speed: speeds in mm/s, rates in mm/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OtherLaw {
    /// Accelerates at constant power and decelerates at a rate that grows with speed: `pull` applies below `knee`.
    ConstantPower {
        /// Acceleration below the knee.
        pull: f64,
        /// The speed above which the acceleration is inversely proportional to speed.
        knee: f64,
        /// Deceleration at the knee.
        brake: f64,
    },
    /// Rolls out against a resistance with a constant, a linear and a quadratic part (W. J. Davis, 1926).
    FreeRolling {
        /// Acceleration.
        pull: f64,
        /// Constant part.
        constant: f64,
        /// Part proportional to speed, per s.
        linear: f64,
        /// Part proportional to its square, per mm.
        quadratic: f64,
    },
    /// Brakes hard down to a speed and gently below it, as decoders with two braking stages do.
    TwoStage {
        /// Acceleration.
        pull: f64,
        /// Deceleration above the change of stages.
        hard: f64,
        /// Deceleration below it.
        gentle: f64,
        /// The speed at which the stages change.
        change: f64,
    },
    /// The speed changes in visible jumps, `every_s` seconds apart.
    Jumps {
        /// Mean acceleration.
        pull: f64,
        /// Mean deceleration.
        brake: f64,
        /// Time between two jumps, in s.
        every_s: f64,
    },
}

impl OtherLaw {
    /// One of the laws, with rates of real model trains (130 to 300 mm/s²).
    pub(crate) fn draw(draws: &mut Draws) -> Self {
        let pull = draws.uniform(130.0..300.0);
        let brake = draws.uniform(130.0..300.0);
        match draws.below(4) {
            0 => Self::ConstantPower { pull, knee: draws.uniform(150.0..300.0), brake },
            1 => Self::FreeRolling {
                pull,
                constant: draws.uniform(30.0..90.0),
                linear: draws.uniform(0.1..0.5),
                quadratic: draws.uniform(1e-4..6e-4),
            },
            2 => Self::TwoStage {
                pull,
                hard: draws.uniform(220.0..350.0),
                gentle: draws.uniform(60.0..140.0),
                change: draws.uniform(120.0..300.0),
            },
            _ => Self::Jumps { pull, brake, every_s: draws.uniform(0.15..0.4) },
        }
    }

    /// The set speed after `dt` towards a target; `phase_s` counts the time since the last jump.
    pub(crate) fn advance(&self, speed: f64, target: f64, dt: f64, phase_s: &mut f64) -> f64 {
        let rises = target > speed;
        let rate = match *self {
            Self::ConstantPower { pull, knee, .. } if rises => pull * (knee / speed.max(knee)),
            Self::ConstantPower { knee, brake, .. } => brake * (0.4 + 0.6 * speed / knee),
            Self::FreeRolling { pull, .. } | Self::TwoStage { pull, .. } if rises => pull,
            Self::FreeRolling { constant, linear, quadratic, .. } => {
                constant + speed * (linear + quadratic * speed)
            }
            Self::TwoStage { hard, gentle, change, .. } => {
                if speed > change {
                    hard
                } else {
                    gentle
                }
            }
            Self::Jumps { pull, brake, every_s } => {
                *phase_s += dt;
                if *phase_s < every_s {
                    return speed;
                }
                *phase_s = 0.0;
                (if rises { pull } else { brake }) * every_s / dt
            }
        };
        if rises { (speed + rate * dt).min(target) } else { (speed - rate * dt).max(target) }
    }
}
