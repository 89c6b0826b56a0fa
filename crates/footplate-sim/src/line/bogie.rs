//! The bogie of the measured wheelsets: normally it does what the train does, in some scenarios its own will.
//!
//! Wheels that a converter drives or brakes turn as the converter wants, within its torque: a fault in its speed
//! control draws both wheelsets away together, without a jerk and without any difference between them.

use super::brake_cylinder::{BrakeCylinder, BrakeTimes, Valve};
use super::rotation::{Rotation, Torques};

/// Torque for each rad/s between wheel and converter (N m s): the controller of a traction motor is this stiff.
const STIFFNESS: f64 = 30e3;
/// The most that a converter brings to the rim, as part of the load of the wheelset.
const STRONGEST: f64 = 0.22;

/// What a bogie does from a time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Conduct {
    /// What the train does.
    Follows,
    /// The converter takes speed away from both wheelsets: by the deceleration commanded, and so much more (m/s²).
    DrawnAway(f64),
    /// The converter takes speed away by so much (m/s²).
    Falling(f64),
    /// Neither drive nor brake.
    Released,
    /// From the next brake or traction on, the converter takes both wheels to a creepage, keeps it for a time, and brings
    /// them back; sooner if the command ends.
    Creeps(Plateau),
    /// The friction brake, whose cylinder was filled before the converter let go, at a pressure and without protection.
    Held(f64),
}

/// A creepage that a converter keeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plateau {
    /// Positive in traction, negative under the brake.
    pub(crate) creepage: f64,
    /// How long it lasts (s).
    pub(crate) lasts: f64,
    /// How fast the wheels get there, and back to the train (m/s²).
    pub(crate) away: f64,
    pub(crate) back: f64,
}

/// Wheels are back with the train when they differ by less than this (m/s).
const BACK_M_PER_S: f64 = 0.01;

/// The bogie and what it will do.
#[derive(Debug, Clone)]
pub(crate) struct Bogie {
    /// From when on (s since the first sample) what, in order.
    acts: Vec<(f64, Conduct)>,
    conduct: Conduct,
    time: f64,
    /// The speed that the converter keeps at the treads (m/s).
    target: f64,
    /// How long it has crept (s), and how far its wheels are from the train (m/s).
    crept: f64,
    apart: f64,
}

impl Bogie {
    /// A bogie with a will of its own from given times on; none for one that follows the train.
    pub(crate) fn new(mut acts: Vec<(f64, Conduct)>, time: f64) -> Self {
        acts.reverse();
        Self { acts, conduct: Conduct::Follows, time, target: 0.0, crept: 0.0, apart: 0.0 }
    }

    /// Advances by `dt` seconds, with the commanded deceleration of the train (m/s²), its effort, and the speeds of the
    /// train and of the treads.
    pub(crate) fn step(&mut self, dt: f64, commanded: f64, effort: f64, train: f64, speeds: [f64; 2]) {
        self.time += dt;
        while let Some(&(from, conduct)) = self.acts.last()
            && from <= self.time
            && !matches!(conduct, Conduct::Creeps(plateau) if !plateau.is_asked_for(effort))
        {
            self.acts.pop();
            (self.crept, self.apart) = (0.0, 0.0);
            self.conduct = conduct;
            self.target = 0.5 * (speeds[0] + speeds[1]);
        }
        if let Conduct::Creeps(plateau) = self.conduct {
            self.creep(dt, plateau, effort, train);
            return;
        }
        let falls = match self.conduct {
            Conduct::DrawnAway(extra) => commanded + extra,
            Conduct::Falling(rate) => rate,
            _ => 0.0,
        };
        self.target = (self.target - falls * dt).max(0.0);
    }

    fn creep(&mut self, dt: f64, plateau: Plateau, effort: f64, train: f64) {
        self.crept = if plateau.is_asked_for(effort) { self.crept + dt } else { f64::INFINITY };
        let stays = self.crept < plateau.lasts;
        let (goal, rate) = if stays { (plateau.creepage * train, plateau.away) } else { (0.0, plateau.back) };
        self.apart += (goal - self.apart).clamp(-rate * dt, rate * dt);
        if !stays && self.apart.abs() < BACK_M_PER_S {
            self.conduct = Conduct::Follows;
        }
        self.target = (train + self.apart).max(0.0);
    }

    /// What it does.
    pub(crate) fn conduct(&self) -> Conduct {
        self.conduct
    }

    /// Whether it does otherwise than the train.
    pub(crate) fn is_disturbed(&self) -> bool {
        self.conduct != Conduct::Follows
    }

    /// The pressure in one of its cylinders after `dt` more seconds when the train asks for another, and the protection
    /// sets its valve.
    pub(crate) fn brake(
        &self,
        cylinder: &mut BrakeCylinder,
        dt: f64,
        of_train: f64,
        valve: Valve,
        times: &BrakeTimes,
    ) -> f64 {
        match self.conduct {
            Conduct::Follows => {}
            Conduct::Held(pressure) => {
                *cylinder = BrakeCylinder::settled(pressure);
                return pressure;
            }
            // The converter has taken the place of the brake.
            _ => return cylinder.step(dt, 0.0, Valve::Release, times),
        }
        cylinder.step(dt, of_train, valve, times)
    }

    /// What acts on an axle when drive and brake give these forces at the rim (N).
    pub(crate) fn torques(&self, wheel: &Rotation, pull: f64, brake: f64) -> Torques {
        let r = wheel.radius;
        let friction = Torques { brake: r * brake, ..Torques::default() };
        match self.conduct {
            Conduct::Follows => Torques { drive: r * pull, ..friction },
            Conduct::Released | Conduct::Held(_) => friction,
            Conduct::DrawnAway(_) | Conduct::Falling(_) | Conduct::Creeps(_) => {
                let most = STRONGEST * wheel.load * r;
                let drive = STIFFNESS * (self.target / r - wheel.omega);
                let drive_stiffness = if drive.abs() < most { STIFFNESS } else { 0.0 };
                Torques { drive: drive.clamp(-most, most), drive_stiffness, ..friction }
            }
        }
    }
}

impl Plateau {
    /// Whether the train is braked, or driven, so that wheels can creep like this.
    fn is_asked_for(&self, effort: f64) -> bool {
        effort * self.creepage > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::creep_force::Film;

    #[test]
    fn a_converter_draws_the_wheel_away_at_the_commanded_rate() {
        let mut bogie = Bogie::new(vec![(1.0, Conduct::DrawnAway(0.5)), (6.0, Conduct::Follows)], 0.0);
        let mut wheel =
            Rotation { inertia: 200.0, radius: 0.43, load: 140e3, angle: 0.0, omega: 30.0 / 0.43 };
        for step in 0..20_000 {
            let time = 0.0005 * f64::from(step);
            bogie.step(0.0005, 0.7, -0.7, 30.0, [wheel.speed(); 2]);
            let torques = bogie.torques(&wheel, 0.0, 0.0);
            wheel.step(0.0005, 30.0, &Film::LOW, torques);
            if time > 1.5 && time < 6.0 {
                let expected = 30.0 - 1.2 * (time - 1.0);
                assert!((wheel.speed() - expected).abs() < 0.1, "{} {expected}", wheel.speed());
            }
        }
        assert!((wheel.speed() - 30.0).abs() < 0.1, "rolls again");
    }

    #[test]
    fn a_plateau_waits_for_the_brake_and_ends_without_a_jerk() {
        let plateau = Plateau { creepage: -0.1, lasts: 8.0, away: 2.0, back: 0.5 };
        let mut bogie = Bogie::new(vec![(1.0, Conduct::Creeps(plateau))], 0.0);
        let mut targets = Vec::new();
        for step in 0..20_000 {
            let time = 0.001 * f64::from(step);
            bogie.step(0.001, 0.5, if time < 3.0 { 0.4 } else { -0.5 }, 20.0, [20.0; 2]);
            targets.push((time, bogie.conduct() != Conduct::Follows, bogie.target));
        }
        let at = |second: usize| targets[1000 * second];
        assert!(!at(2).1 && at(4).1 && !at(16).1, "from 3 s, 8 s long, and 4 s back");
        assert!((at(6).2 - 18.0).abs() < 1e-6, "{}", at(6).2);
        assert!((at(13).2 - 19.0).abs() < 0.01, "halfway back: {}", at(13).2);
    }
}
