//! Laws of speed change that no estimator has a family for, each written as a rate at a speed.

use crate::draws::Draws;

/// How a decoder's set speed moves: speeds in mm/s, rates in mm/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OtherLaw {
    /// Speeds up at constant power and slows down at a rate that grows with speed: `pull` holds below `knee`.
    ConstantPower {
        /// Rate of speeding up below the knee.
        pull: f64,
        /// Above this speed the rate falls in inverse proportion to speed.
        knee: f64,
        /// Rate of slowing down at the knee.
        brake: f64,
    },
    /// Rolls out freely against a resistance with a constant, a linear and a quadratic part (W. J. Davis, 1926).
    FreeRolling {
        /// Rate of speeding up.
        pull: f64,
        /// Constant part.
        constant: f64,
        /// Part in proportion to speed, per s.
        linear: f64,
        /// Part in proportion to its square, per mm.
        quadratic: f64,
    },
    /// Brakes hard down to a speed and gently from there, as decoders with two braking stages do.
    TwoStage {
        /// Rate of speeding up.
        pull: f64,
        /// Rate of slowing down above the change of stages.
        hard: f64,
        /// And below it.
        gentle: f64,
        /// The speed at which stages change.
        change: f64,
    },
    /// Speed falls and rises in visible jumps, `every_s` seconds apart.
    Jumps {
        /// Rate of speeding up, on average.
        pull: f64,
        /// Rate of slowing down, on average.
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

    /// The set speed `dt` later on its way to a target; `phase_s` counts the time since the last jump.
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
