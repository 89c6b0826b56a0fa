//! The force between wheel and rail at a given creepage, after Polach.
//!
//! ```text
//! mu(w) = mu0 ((1 - A) e^(-B w) + A)                        w = |wheel speed - train speed|
//! eps   = G pi a b c11 / 4  *  s / (Q mu)                   s = w / speed
//! F     = 2 Q mu / pi  *  (kA eps / (1 + (kA eps)^2) + atan(kS eps))
//! ```
//!
//! Letters: `mu0` coefficient of friction at no creepage, `A` the part of it that is left at large creepage, `B` how
//! fast it falls (s/m), `kA` and `kS` how much softer the area of adhesion and the area of slip are than steel on clean
//! steel, `Q` wheel load, `a`, `b` half axes of the Hertzian ellipse, `c11` Kalker's coefficient, `G` shear modulus.
//!
//! Source: O. Polach, Creep forces in simulations of traction vehicles running on adhesion limit, Wear 258 (2005).

use core::f64::consts::PI;

/// G pi a b c11 / 4 of a wheel of 0.86 to 0.92 m on a new rail (N): G = 84 GPa, a = 6.6 mm, b = 6 mm, c11 = 4.3.
const STIFFNESS_N: f64 = 8.4e10 * PI * 6.6e-3 * 6.0e-3 * 4.3 / 4.0;
/// Creepage is taken relative to no less than this speed (m/s), so that it stays finite at standstill.
const SLOWEST_M_PER_S: f64 = 0.5;

/// Below this the arc tangent is its argument to the last bit.
const LEAST_SLIPPING: f64 = 1e-8;

/// What lies between wheel and rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Film {
    /// `mu0`.
    pub(crate) friction: f64,
    /// `A`.
    pub(crate) kept: f64,
    /// `B` (s/m).
    pub(crate) fall: f64,
    /// `kA`.
    pub(crate) adhering: f64,
    /// `kS`.
    pub(crate) slipping: f64,
}

/// A force along the track and the creepage that makes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CreepForce {
    /// On the train (N); drives it forward if the wheel is faster than the train.
    pub(crate) force: f64,
    /// The force divided by the wheel's speed relative to the train (N s/m): what holds the wheel back when both are
    /// small, and still a number when there is no creepage.
    pub(crate) stiffness: f64,
}

impl Film {
    /// Clean and dry (Polach's fit).
    pub(crate) const DRY: Self = Self { friction: 0.55, kept: 0.4, fall: 0.6, adhering: 1.0, slipping: 0.4 };
    /// Wet with rain (Polach's fit).
    pub(crate) const WET: Self = Self { friction: 0.3, kept: 0.4, fall: 0.2, adhering: 0.3, slipping: 0.1 };
    /// Oil, soap or damp rust: the rail on which wheel slide protection is tested; softness as if wet.
    pub(crate) const LOW: Self = Self { friction: 0.06, ..Self::WET };
    /// Wet leaves: below all that a train needs; falls slowly with creepage.
    pub(crate) const LEAVES: Self = Self { friction: 0.03, fall: 0.1, ..Self::WET };

    /// The same with another coefficient of friction.
    pub(crate) const fn with_friction(self, friction: f64) -> Self {
        Self { friction, ..self }
    }

    /// What is between this and another when so much of the other shows, 0 to 1.
    pub(crate) fn towards(self, other: Self, share: f64) -> Self {
        let mix = |here: f64, there: f64| here + share * (there - here);
        Self {
            friction: mix(self.friction, other.friction),
            kept: mix(self.kept, other.kept),
            fall: mix(self.fall, other.fall),
            adhering: mix(self.adhering, other.adhering),
            slipping: mix(self.slipping, other.slipping),
        }
    }

    /// The force of one wheel that carries `load` (N), rolls at `wheel` and moves along at `train` (m/s).
    pub(crate) fn creep_force(&self, load: f64, wheel: f64, train: f64) -> CreepForce {
        let creep = wheel - train;
        let w = creep.abs();
        let mu = self.friction * ((1.0 - self.kept) * libm::exp(-self.fall * w) + self.kept);
        let eps_per_w = STIFFNESS_N / (train.abs().max(SLOWEST_M_PER_S) * load * mu);
        let scale = 2.0 * load * mu / PI;
        let adhering = self.adhering * eps_per_w * w;
        let slipping = self.slipping * eps_per_w * w;
        let adhesion = self.adhering * eps_per_w / (1.0 + adhering * adhering);
        // The arc tangent over its argument is 1 where both vanish.
        let arc = if slipping > LEAST_SLIPPING { libm::atan(slipping) / slipping } else { 1.0 };
        let stiffness = scale * (adhesion + self.slipping * eps_per_w * arc);
        CreepForce { force: stiffness * creep, stiffness }
    }

    /// The largest part of a wheel's load that goes into the rail at a speed, over all creepages; to 1 %.
    pub(crate) fn peak(&self, load: f64, train: f64) -> f64 {
        /// From below the peak on dry rail at 100 m/s to above it on wet rail at walking pace.
        const CREEPAGES: [f64; 12] =
            [0.006, 0.009, 0.013, 0.018, 0.025, 0.034, 0.046, 0.062, 0.085, 0.12, 0.18, 0.3];
        let speed = train.abs().max(SLOWEST_M_PER_S);
        let force = |creepage: f64| self.creep_force(load, speed * (1.0 + creepage), speed).force;
        CREEPAGES.into_iter().map(force).fold(0.0, f64::max) / load
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The load the targets were computed with (N).
    const LOAD: f64 = 140e3;

    /// Creepage and force over load at the peak, found on a fine grid, and force over load at 100 %.
    fn curve(film: Film, speed: f64) -> (f64, f64, f64) {
        let part = |creepage: f64| film.creep_force(LOAD, speed * (1.0 + creepage), speed).force / LOAD;
        let (mut at, mut most) = (0.0, 0.0);
        for step in 1..2000 {
            let creepage = f64::from(step) / 2000.0;
            if part(creepage) > most {
                (at, most) = (creepage, part(creepage));
            }
        }
        (at, most, part(1.0))
    }

    #[test]
    fn the_curves_of_an_independent_program_come_out() {
        // Film, speed, creepage and coefficient at the peak, coefficient at 100 %.
        let low = Film::LOW;
        let targets = [
            (Film::DRY, 20.0, 0.031, 0.377, Some(0.219)),
            (Film::WET, 20.0, 0.086, 0.212, Some(0.123)),
            (low, 20.0, 0.038, 0.051, Some(0.025)),
            (Film::DRY, 60.0, 0.016, 0.307, None),
            (Film::DRY, 5.0, 0.064, 0.448, None),
        ];
        for (film, speed, creepage, coefficient, sliding) in targets {
            let (at, most, full) = curve(film, speed);
            assert!((at - creepage).abs() <= 0.0015, "peak at {at}, should be {creepage}");
            assert!((most - coefficient).abs() <= 0.0006, "peak {most}, should be {coefficient}");
            assert!(sliding.is_none_or(|part| (full - part).abs() <= 0.001), "{full} at 100 %");
            assert!((film.peak(LOAD, speed) / most - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn small_creepage_is_linear_with_the_known_stiffness() {
        // (kA + kS) G a b c11 / 2 per unit of creepage, whatever the friction and the load.
        let known = 1.4 * 8.4e10 * 6.6e-3 * 6.0e-3 * 4.3 / 2.0;
        for creep in [0.0, 1e-9, -1e-6] {
            let stiffness = Film::DRY.creep_force(70e3, 20.0 + creep, 20.0).stiffness * 20.0;
            assert!((stiffness / known - 1.0).abs() < 1e-4, "{stiffness} {known}");
        }
        let force = Film::DRY.creep_force(70e3, 20.0 - 1e-6, 20.0).force;
        assert!((force * 20e6 / known + 1.0).abs() < 1e-4, "{force}");
    }
}
