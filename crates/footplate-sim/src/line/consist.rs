//! A train of wheelsets: what it weighs, what drives and brakes it, and where its wheels are.

use core::ops::Range;

use crate::draws::Draws;

/// Standard gravity (m/s²).
pub(crate) const GRAVITY: f64 = 9.806_65;
/// The wheelsets that are not followed one by one are gathered in so many groups along the train.
pub(crate) const GROUPS: usize = 6;
/// A wheelset without and with a motor and its gear (kg m²): drawn from these.
const TRAILING_KG_M2: Range<f64> = 75.0..115.0;
const POWERED_KG_M2: Range<f64> = 160.0..260.0;
/// Between the wheelsets of a bogie (m).
const WHEELBASE_M: f64 = 2.5;
/// How far masses go from the design, part of it: empty to full.
const LOADING: Range<f64> = 0.9..1.1;
/// How far brake and drive go from the design, part of it. The claims of a vehicle leave more room than this.
const STRENGTH: Range<f64> = 0.93..1.07;

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

/// What the builder of a kind of train says.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Design {
    /// How many wheelsets it has; half of them are driven.
    pub(crate) wheelsets: u32,
    /// What each carries (N).
    load: f64,
    /// From the first wheelset to the last (m).
    length: f64,
    /// Acceleration on level track when it starts (m/s²).
    pub(crate) start: f64,
    /// Power by mass (W/kg).
    power: f64,
    /// Deceleration by its full brake (m/s²).
    pub(crate) full_brake: f64,
    /// How fast effort comes and goes (m/s³).
    pub(crate) jerk: f64,
    /// Resistance in N per kN of weight: constant, by km/h, by (km/h)².
    resistance: [f64; 3],
    /// It never runs faster (m/s).
    pub(crate) max_speed: f64,
    /// What its wheels are believed to measure (m).
    pub(crate) diameter: f64,
}

impl Kind {
    /// What its builder says. Resistance of the multiple units for 300 km/h is that of the CRH3 class; of the others,
    /// Sauthoff's form for coaches.
    pub(crate) const fn design(self) -> Design {
        match self {
            Self::HighSpeed => Design {
                wheelsets: 32,
                load: 140e3,
                length: 190.0,
                start: 0.55,
                power: 21.0,
                full_brake: 1.0,
                jerk: 0.6,
                resistance: [0.79, 0.0064, 0.000_115],
                max_speed: 95.0,
                diameter: 0.86,
            },
            Self::Suburban => Design {
                wheelsets: 16,
                load: 150e3,
                length: 92.0,
                start: 0.8,
                power: 13.0,
                full_brake: 1.0,
                jerk: 0.8,
                resistance: [2.0, 0.007_15, 0.000_364],
                max_speed: 45.0,
                diameter: 0.86,
            },
            Self::Metro => Design {
                wheelsets: 16,
                load: 115e3,
                length: 80.0,
                start: 1.0,
                power: 12.0,
                full_brake: 1.1,
                jerk: 0.8,
                resistance: [2.0, 0.007_15, 0.000_364],
                max_speed: 26.0,
                diameter: 0.86,
            },
        }
    }
}

impl Design {
    /// The largest resistance to motion as a deceleration (m/s²): at full speed.
    pub(crate) fn strongest_resistance(&self) -> f64 {
        per_weight(self.resistance, self.max_speed) * GRAVITY
    }
}

/// Resistance as part of the weight at a speed (m/s).
fn per_weight(resistance: [f64; 3], speed: f64) -> f64 {
    let v = 3.6 * speed.abs();
    let [constant, linear, square] = resistance;
    1e-3 * (constant + linear * v + square * v * v)
}

/// Where the measured wheelsets are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Placement {
    /// The first two of the train, on one bogie.
    OneBogie,
    /// The first of the train and the first of its second car.
    TwoCars,
}

/// One train with all that is not measured of it.
#[derive(Debug, Clone)]
pub(crate) struct Consist {
    /// Vertical load of a wheelset (N).
    pub(crate) load: f64,
    /// Mass (kg), without what turning adds.
    pub(crate) mass: f64,
    /// Mass with the rotation of all wheelsets (kg).
    inertia: f64,
    /// Moments of inertia of the measured wheelsets (kg m²).
    pub(crate) rotating: [f64; 2],
    /// Mass with the rotation of those wheelsets that are not followed one by one (kg).
    pub(crate) followed_inertia: f64,
    /// Which measured wheelsets are driven.
    pub(crate) powered: [bool; 2],
    /// How far the measured wheelsets are behind the first of the train (m), and how many are before them.
    pub(crate) places: [(f64, u32); 2],
    /// The others.
    pub(crate) groups: [Group; GROUPS],
    /// From the first wheelset to the last (m).
    pub(crate) length: f64,
    start: f64,
    power: f64,
    full_brake: f64,
    resistance: [f64; 3],
    driven: f64,
    braked: f64,
}

/// Wheelsets near each other of which only the sum of forces matters.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Group {
    /// How far behind the first wheelset of the train they are (m).
    pub(crate) behind: f64,
    /// How many wheelsets are before them.
    pub(crate) before: u32,
    /// How many they are.
    pub(crate) wheelsets: f64,
    /// How many of them are driven.
    pub(crate) driven: f64,
}

impl Consist {
    /// A train of a kind with its two measured wheelsets.
    pub(crate) fn draw(design: &Design, powered: [bool; 2], placement: Placement, draws: &mut Draws) -> Self {
        let load = design.load * draws.uniform(LOADING);
        let radius = 0.5 * design.diameter;
        let trailing = draws.uniform(TRAILING_KG_M2);
        let with_motor = draws.uniform(POWERED_KG_M2);
        let rotating = powered.map(|powered| if powered { with_motor } else { trailing });
        let all = f64::from(design.wheelsets);
        let driven = 0.5 * all;
        let mass = all * load / GRAVITY;
        let of_all = 0.5 * all * (trailing + with_motor) / (radius * radius);
        let of_measured = (rotating[0] + rotating[1]) / (radius * radius);
        let places = match placement {
            Placement::OneBogie => [(0.0, 0), (WHEELBASE_M, 1)],
            Placement::TwoCars => [(0.0, 0), (design.length * 4.0 / all, 4)],
        };
        let measured_driven = powered.iter().filter(|powered| **powered).count() as f64;
        let each = (all - 2.0) / GROUPS as f64;
        let groups = core::array::from_fn(|at| Group {
            behind: design.length * (at as f64 + 0.5) / GROUPS as f64,
            before: 2 + (each * at as f64) as u32,
            wheelsets: each,
            driven: (driven - measured_driven) / GROUPS as f64,
        });
        Self {
            load,
            mass,
            inertia: mass + of_all,
            rotating,
            followed_inertia: mass + of_all - of_measured,
            powered,
            places,
            groups,
            length: design.length,
            start: design.start * draws.uniform(STRENGTH),
            power: design.power * draws.uniform(STRENGTH),
            full_brake: design.full_brake * draws.uniform(STRENGTH),
            resistance: design.resistance,
            driven,
            braked: all,
        }
    }

    /// What each driven wheelset gives at its rim (N) at an effort from 0 to 1.
    pub(crate) fn traction(&self, effort: f64, speed: f64) -> f64 {
        let force = (self.start * self.inertia).min(self.power * self.mass / speed.abs().max(1.0));
        effort * force / self.driven
    }

    /// What each wheelset's brake gives at its rim (N) at a pressure from 0 to 1.
    pub(crate) fn braking(&self, pressure: f64) -> f64 {
        pressure * self.full_brake * self.inertia / self.braked
    }

    /// The deceleration that a brake effort from 0 to 1 gives on a rail that carries it (m/s²).
    pub(crate) fn deceleration(&self, effort: f64) -> f64 {
        effort * self.full_brake
    }

    /// Resistance to motion (N), against it.
    pub(crate) fn resistance(&self, speed: f64) -> f64 {
        per_weight(self.resistance, speed) * self.mass * GRAVITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    #[test]
    fn all_wheelsets_are_there_once() {
        for (powered, placement) in [([true, false], Placement::TwoCars), ([true, true], Placement::OneBogie)]
        {
            let mut draws = Draws::new(1, Purpose::Train);
            let consist = Consist::draw(&Kind::HighSpeed.design(), powered, placement, &mut draws);
            let others: f64 = consist.groups.iter().map(|group| group.wheelsets).sum();
            let driven: f64 = consist.groups.iter().map(|group| group.driven).sum();
            assert!((others + 2.0 - 32.0).abs() < 1e-9);
            assert!((driven + f64::from(u8::from(powered[0]) + u8::from(powered[1])) - 16.0).abs() < 1e-9);
            assert!((consist.mass * GRAVITY / 32.0 / consist.load - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn rotation_adds_what_is_usual_for_multiple_units() {
        for seed in 0..50 {
            let mut draws = Draws::new(seed, Purpose::Train);
            let design = Kind::HighSpeed.design();
            let consist = Consist::draw(&design, [true, false], Placement::TwoCars, &mut draws);
            let part = consist.inertia / consist.mass - 1.0;
            // Coaches 0.06, locomotives 0.09 and more.
            assert!((0.035..0.10).contains(&part), "{part}");
        }
    }

    #[test]
    fn resistance_at_300_km_h_is_that_of_its_class() {
        // 0.79 + 0.0064 * 300 + 0.000115 * 300² = 13.06 N/kN.
        let part = per_weight(Kind::HighSpeed.design().resistance, 300.0 / 3.6);
        assert!((part - 13.06e-3).abs() < 1e-9, "{part}");
    }
}
