//! The kinds of train that scenarios are made with.

use footplate_core::{Acceleration, Length, Ratio, Speed};

use super::consist::Design;
use super::resistance::{GRAVITY, PerMille, Resistance};
use super::tractive_effort::TractiveEffort;
use super::train::{Brake, Train};

/// What turning parts add to the mass of a multiple unit with half its wheelsets driven: 0.06 for coaches, 0.09 for
/// locomotives, less for wheels without discs.
const ROTATING: f64 = 0.06;
/// Service over full braking.
const SERVICE: f64 = 0.7;

/// The kind of train.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Eight cars, half the wheelsets driven.
    HighSpeed,
    /// Four cars for stopping services.
    Suburban,
    /// Four light cars with strong brakes.
    Metro,
}

/// What tells one kind from another, per mass.
struct Figures {
    name: &'static str,
    wheelsets: u32,
    /// What each carries (N).
    load: f64,
    length: f64,
    /// Acceleration on level track when it starts (m/s²), power (W/kg), deceleration by its full brake (m/s²).
    start: f64,
    power: f64,
    full_brake: f64,
    jerk: f64,
    resistance: PerMille,
    max_speed: f64,
}

impl Kind {
    /// What its builder says. Resistance of the unit for 300 km/h is that of the CRH3 class (general knowledge); of the
    /// others, Sauthoff's for double-deck coaches.
    pub(crate) fn design(self) -> Design {
        let coaches = PerMille { base: 2.0, rolling: 0.715, air: 3.64, head_wind: Speed::ZERO };
        let figures = match self {
            Self::HighSpeed => Figures {
                name: "high-speed unit",
                wheelsets: 32,
                load: 140e3,
                length: 200.0,
                start: 0.55,
                power: 21.0,
                full_brake: 1.0,
                jerk: 0.6,
                resistance: PerMille { base: 0.79, rolling: 0.64, air: 1.15, head_wind: Speed::ZERO },
                max_speed: 95.0,
            },
            Self::Suburban => Figures {
                name: "suburban unit",
                wheelsets: 16,
                load: 150e3,
                length: 100.0,
                start: 0.8,
                power: 13.0,
                full_brake: 1.0,
                jerk: 0.8,
                resistance: coaches,
                max_speed: 45.0,
            },
            Self::Metro => Figures {
                name: "metro train",
                wheelsets: 16,
                load: 115e3,
                length: 86.0,
                start: 1.0,
                power: 12.0,
                full_brake: 1.1,
                jerk: 0.8,
                resistance: coaches,
                max_speed: 26.0,
            },
        };
        figures.design()
    }
}

impl Figures {
    fn design(self) -> Design {
        let mass_kg = f64::from(self.wheelsets) * self.load / GRAVITY;
        let inertia = mass_kg * (1.0 + ROTATING);
        let length = Length::from_m(self.length);
        let train = Train {
            name: self.name.to_owned(),
            length,
            weight_length: length,
            mass_kg,
            rotating_mass: Ratio::from_parts(ROTATING),
            resistance: Resistance::per_mille(mass_kg, self.resistance),
            tractive_effort: TractiveEffort::ForceAndPower {
                force_n: self.start * inertia,
                power_w: self.power * mass_kg,
            },
            brake: Brake {
                service: Acceleration::from_m_per_s2(SERVICE * self.full_brake),
                full_n: self.full_brake * inertia,
            },
            max_speed: Speed::from_m_per_s(self.max_speed),
            max_acceleration: None,
        };
        Design { train, wheelsets: self.wheelsets, driven: self.wheelsets / 2, jerk: self.jerk }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_a_train() {
        for kind in [Kind::HighSpeed, Kind::Suburban, Kind::Metro] {
            assert!(kind.design().train.check().is_ok(), "{kind:?}");
        }
    }

    #[test]
    fn resistance_at_300_km_h_is_that_of_its_class() {
        // 0.79 + 0.0064 * 300 + 0.000115 * 300² = 13.06 N/kN.
        let train = Kind::HighSpeed.design().train;
        let per_mille =
            train.resistance.at(Speed::from_m_per_s(300.0 / 3.6)) / (train.mass_kg * GRAVITY) * 1e3;
        assert!((per_mille - 13.06).abs() < 1e-6, "{per_mille}");
    }
}
