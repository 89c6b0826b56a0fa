//! What slows a train on straight, level track: a constant, a part that grows with speed, and a part with its square.
//!
//! Every form in use is such a quadratic. Davis writes it down as A + B v + C v²; Sauthoff (passenger) and Strahl
//! (freight) give per mille of the weight and let the air blow from ahead, which only spreads over the three
//! coefficients (Wende, Fahrdynamik des Schienenverkehrs, 2003, pages 151 and 153).

use core::ops::Add;

use footplate_core::Speed;

/// Standard acceleration of free fall (m/s²), by definition (CGPM, 1901).
pub(crate) const GRAVITY: f64 = 9.806_65;

/// The speed to which per-mille coefficients refer: 100 km/h, in m/s.
const REFERENCE_M_PER_S: f64 = 100.0 / 3.6;

/// The force against the motion of a train on straight and level track.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Resistance {
    /// The constant part (N).
    pub constant_n: f64,
    /// The part that grows with speed (N per m/s).
    pub linear_n_s_per_m: f64,
    /// The part that grows with its square, mostly air (N per m²/s²).
    pub square_n_s2_per_m2: f64,
}

/// Resistance in per mille of a weight: `base + rolling (v / 100) + air ((v + wind) / 100)²`, v in km/h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PerMille {
    /// At rest and without wind.
    pub base: f64,
    /// What 100 km/h add by rolling.
    pub rolling: f64,
    /// What 100 km/h of air against the train add.
    pub air: f64,
    /// Air that comes towards a standing train; 15 km/h by convention for locomotives and passenger trains.
    pub head_wind: Speed,
}

impl Resistance {
    /// A + B v + C v², v in m/s, A in N (Davis, 1926).
    pub const fn davis(a: f64, b: f64, c: f64) -> Self {
        Self { constant_n: a, linear_n_s_per_m: b, square_n_s2_per_m2: c }
    }

    /// The force on `mass_kg` of per-mille coefficients.
    pub fn per_mille(mass_kg: f64, per_mille: PerMille) -> Self {
        let PerMille { base, rolling, air, head_wind } = per_mille;
        let weight = mass_kg * GRAVITY / 1000.0;
        let wind = head_wind.as_m_per_s() / REFERENCE_M_PER_S;
        Self {
            constant_n: weight * (base + air * wind * wind),
            linear_n_s_per_m: weight * (rolling + 2.0 * air * wind) / REFERENCE_M_PER_S,
            square_n_s2_per_m2: weight * air / (REFERENCE_M_PER_S * REFERENCE_M_PER_S),
        }
    }

    /// The force (N) at a speed, against the motion; the sign of the speed does not matter.
    pub fn at(&self, speed: Speed) -> f64 {
        let v = speed.abs().as_m_per_s();
        self.constant_n + v * (self.linear_n_s_per_m + v * self.square_n_s2_per_m2)
    }
}

impl Add for Resistance {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            constant_n: self.constant_n + other.constant_n,
            linear_n_s_per_m: self.linear_n_s_per_m + other.linear_n_s_per_m,
            square_n_s2_per_m2: self.square_n_s2_per_m2 + other.square_n_s2_per_m2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIND: Speed = Speed::from_m_per_s(15.0 / 3.6);
    const FIFTEEN: Speed = Speed::from_m_per_s(15.0);

    #[test]
    fn a_locomotive_of_80_t_meets_the_published_force() {
        // 5461.127 N at 15 m/s: an example in the documentation of TrainRuns.jl, for the same coefficients.
        let coefficients = PerMille { base: 2.2, rolling: 0.0, air: 10.0, head_wind: WIND };
        let force = Resistance::per_mille(80e3, coefficients).at(FIFTEEN);
        assert!((force - 5_461.127_252).abs() < 1e-6, "{force}");
    }

    #[test]
    fn ten_loaded_ore_wagons_meet_the_published_force() {
        // 20900.733 N at 15 m/s, from the same place: freight without wind.
        let coefficients = PerMille { base: 1.4, rolling: 0.0, air: 3.9, head_wind: Speed::ZERO };
        let force = Resistance::per_mille(840e3, coefficients).at(FIFTEEN);
        assert!((force - 20_900.732_702_64).abs() < 1e-6, "{force}");
    }

    #[test]
    fn forces_of_vehicles_add_up_in_either_direction() {
        let train = Resistance::davis(1000.0, 20.0, 3.0) + Resistance::davis(500.0, 0.0, 1.0);
        assert_eq!(train.at(Speed::from_m_per_s(10.0)), 2100.0);
        assert_eq!(train.at(Speed::from_m_per_s(-10.0)), 2100.0);
    }
}
