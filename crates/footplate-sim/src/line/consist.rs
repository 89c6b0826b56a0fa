//! A train of wheelsets: what it weighs, what drives and brakes it, and where its wheels are.

use core::ops::Range;

use footplate_core::Speed;

use super::resistance::{GRAVITY, Resistance};
use super::tractive_effort::TractiveEffort;
use super::train::Train;
use crate::draws::Draws;

/// The wheelsets that are not followed one by one are gathered in so many groups along the train.
const GROUPS: usize = 6;
/// The assumed diameter of all measured wheels (m): the usual size of multiple units, half worn.
pub(crate) const DIAMETER_M: f64 = 0.86;
/// A wheelset without and with a motor and its gear (kg m²): drawn from these.
const TRAILING_KG_M2: Range<f64> = 75.0..115.0;
const POWERED_KG_M2: Range<f64> = 160.0..260.0;
/// Between the wheelsets of a bogie (m).
const WHEELBASE_M: f64 = 2.5;
/// How far masses go from the design, part of it: empty to full. Drive and brake are weighed to the load.
const LOADING: Range<f64> = 0.9..1.1;
/// How far brake and drive go from the design, part of it. The claims of a vehicle leave more room than this.
const STRENGTH: Range<f64> = 0.93..1.07;
/// What a wheelset of a train carries of which only the mass is known (N), ...
const USUAL_LOAD_N: f64 = 150e3;
/// ... and how much of that its motors put on the rail at most: what dry and damp rails carry at low speed.
const USUAL_ADHESION: f64 = 0.2;
/// How fast the effort of such a train comes and goes (m/s³).
const USUAL_JERK: f64 = 0.7;

/// What the builder says of a train.
#[derive(Debug, Clone)]
pub(crate) struct Design {
    pub(crate) train: Train,
    /// How many wheelsets it has, and how many of them are driven.
    pub(crate) wheelsets: u32,
    pub(crate) driven: u32,
    /// How fast effort comes and goes (m/s³).
    pub(crate) jerk: f64,
}

impl Design {
    /// A train with unknown wheelsets and motors: as many as carry it, and as many driven as needed.
    pub(crate) fn of(train: Train) -> Self {
        let bogies = (train.mass_kg * GRAVITY / (2.0 * USUAL_LOAD_N)).ceil().clamp(2.0, 1e6);
        let load = train.mass_kg * GRAVITY / (2.0 * bogies);
        let driven = (train.tractive_effort.largest() / (2.0 * USUAL_ADHESION * load)).ceil();
        let driven = driven.clamp(1.0, bogies);
        Self { train, wheelsets: 2 * bogies as u32, driven: 2 * driven as u32, jerk: USUAL_JERK }
    }

    /// Acceleration on level track when it starts (m/s²), less resistance.
    pub(crate) fn start(&self) -> f64 {
        self.train.tractive_effort.largest() / self.train.inertia_kg()
    }

    /// Deceleration by its full brake (m/s²).
    pub(crate) fn full_brake(&self) -> f64 {
        self.train.brake.full_n / self.train.inertia_kg()
    }

    /// The largest resistance to motion as a deceleration (m/s²): empty, at full speed.
    pub(crate) fn strongest_resistance(&self) -> f64 {
        self.train.resistance.at(self.train.max_speed) / (self.train.mass_kg * LOADING.start)
    }
}

/// Where the measured wheelsets are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Placement {
    /// The first two of the train, on one bogie.
    OneBogie,
    /// The first of the train and the first of its second car.
    TwoCars,
}

impl Placement {
    /// Whether each measured wheelset is braked by itself: not on one bogie, whose converter feeds all its motors.
    pub(crate) const fn is_independent(self) -> bool {
        matches!(self, Self::TwoCars)
    }
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
    /// Of the whole train (m).
    pub(crate) length: f64,
    tractive_effort: TractiveEffort,
    /// What the design gives, and this train gives of it.
    strength: f64,
    /// Deceleration by its full brake (m/s²).
    full_brake: f64,
    resistance: Resistance,
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
    /// A train of a design with its two measured wheelsets.
    pub(crate) fn draw(design: &Design, powered: [bool; 2], placement: Placement, draws: &mut Draws) -> Self {
        let loading = draws.uniform(LOADING);
        let train = &design.train;
        let all = f64::from(design.wheelsets);
        let mass = train.mass_kg * loading;
        let radius = 0.5 * DIAMETER_M;
        let trailing = draws.uniform(TRAILING_KG_M2);
        let with_motor = draws.uniform(POWERED_KG_M2);
        let rotating = powered.map(|powered| if powered { with_motor } else { trailing });
        let inertia = train.inertia_kg() * loading;
        let length = train.length.as_m();
        let places = match placement {
            Placement::OneBogie => [(0.0, 0), (WHEELBASE_M, 1)],
            Placement::TwoCars => [(0.0, 0), (length * 4.0 / all, 4)],
        };
        let others = f64::from(design.driven) - powered.iter().filter(|powered| **powered).count() as f64;
        let each = (all - 2.0) / GROUPS as f64;
        let groups = core::array::from_fn(|at| Group {
            behind: length * (at as f64 + 0.5) / GROUPS as f64,
            before: 2 + (each * at as f64) as u32,
            wheelsets: each,
            driven: others.max(0.0) / GROUPS as f64,
        });
        Self {
            load: mass * GRAVITY / all,
            mass,
            inertia,
            rotating,
            followed_inertia: inertia - (rotating[0] + rotating[1]) / (radius * radius),
            powered,
            places,
            groups,
            length,
            tractive_effort: train.tractive_effort.clone(),
            strength: loading * draws.uniform(STRENGTH),
            full_brake: design.full_brake() * draws.uniform(STRENGTH),
            resistance: train.resistance,
            driven: f64::from(design.driven),
            braked: all,
        }
    }

    /// What each driven wheelset gives at its rim (N) at an effort from 0 to 1.
    pub(crate) fn traction(&self, effort: f64, speed: f64) -> f64 {
        effort * self.strength * self.tractive_effort.at(Speed::from_m_per_s(speed)) / self.driven
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
        self.resistance.at(Speed::from_m_per_s(speed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;
    use crate::line::kinds::Kind;
    use crate::line::train::tests::unit;

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
    fn a_train_of_which_only_the_mass_is_known_has_wheelsets_that_carry_it() {
        // 100 t on wheelsets of 15 t at most: eight with 123 kN each; 100 kN of traction on 0.2 of that: more than four.
        let design = Design::of(unit());
        assert_eq!((design.wheelsets, design.driven), (8, 6));
        // A wagon that is pulled by a giant still has four wheels.
        let light = Train { mass_kg: 5e3, ..unit() };
        let design = Design::of(light);
        assert_eq!((design.wheelsets, design.driven), (4, 4));
    }
}
