//! The bogie of the measured wheelsets: normally it does what the train does, in some scenarios its own will.
//!
//! Wheels that a converter drives or brakes turn as the converter wants, within its torque: a fault in its speed
//! control draws both wheelsets away together, without a jerk and without any difference between them.

use super::brake_cylinder::{BrakeCylinder, Valve};
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
    /// The friction brake, whose cylinder was filled before the converter let go, at a pressure and without protection.
    Held(f64),
}

/// The bogie and what it will do.
#[derive(Debug, Clone)]
pub(crate) struct Bogie {
    /// From when on (s since the first sample) what, in order.
    acts: Vec<(f64, Conduct)>,
    conduct: Conduct,
    time: f64,
    /// The speed that the converter keeps at the treads (m/s).
    target: f64,
}

impl Bogie {
    /// A bogie with a will of its own from given times on; none for one that follows the train.
    pub(crate) fn new(mut acts: Vec<(f64, Conduct)>, time: f64) -> Self {
        acts.reverse();
        Self { acts, conduct: Conduct::Follows, time, target: 0.0 }
    }

    /// Goes on by `dt` seconds, with what the brake of the train is told to do (m/s²) and the speeds of the treads.
    pub(crate) fn step(&mut self, dt: f64, commanded: f64, speeds: [f64; 2]) {
        self.time += dt;
        while let Some(&(from, conduct)) = self.acts.last()
            && from <= self.time
        {
            self.acts.pop();
            self.conduct = conduct;
            self.target = 0.5 * (speeds[0] + speeds[1]);
        }
        let falls = match self.conduct {
            Conduct::DrawnAway(extra) => commanded + extra,
            Conduct::Falling(rate) => rate,
            _ => 0.0,
        };
        self.target = (self.target - falls * dt).max(0.0);
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
    pub(crate) fn brake(&self, cylinder: &mut BrakeCylinder, dt: f64, of_train: f64, valve: Valve) -> f64 {
        match self.conduct {
            Conduct::Follows => {}
            Conduct::Held(pressure) => {
                *cylinder = BrakeCylinder::settled(pressure);
                return pressure;
            }
            // The converter has taken the place of the brake.
            _ => return cylinder.step(dt, 0.0, Valve::Release),
        }
        cylinder.step(dt, of_train, valve)
    }

    /// What acts on an axle when drive and brake give these forces at the rim (N).
    pub(crate) fn torques(&self, wheel: &Rotation, pull: f64, brake: f64) -> Torques {
        let r = wheel.radius;
        let friction = Torques { brake: r * brake, ..Torques::default() };
        match self.conduct {
            Conduct::Follows => Torques { drive: r * pull, ..friction },
            Conduct::Released | Conduct::Held(_) => friction,
            Conduct::DrawnAway(_) | Conduct::Falling(_) => {
                let most = STRONGEST * wheel.load * r;
                let drive = STIFFNESS * (self.target / r - wheel.omega);
                let drive_stiffness = if drive.abs() < most { STIFFNESS } else { 0.0 };
                Torques { drive: drive.clamp(-most, most), drive_stiffness, ..friction }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::creep_force::Film;

    #[test]
    fn a_converter_draws_the_wheel_away_at_the_rate_it_is_told() {
        let mut bogie = Bogie::new(vec![(1.0, Conduct::DrawnAway(0.5)), (6.0, Conduct::Follows)], 0.0);
        let mut wheel =
            Rotation { inertia: 200.0, radius: 0.43, load: 140e3, angle: 0.0, omega: 30.0 / 0.43 };
        for step in 0..20_000 {
            let time = 0.0005 * f64::from(step);
            bogie.step(0.0005, 0.7, [wheel.speed(); 2]);
            let torques = bogie.torques(&wheel, 0.0, 0.0);
            wheel.step(0.0005, 30.0, &Film::LOW, torques);
            if time > 1.5 && time < 6.0 {
                let expected = 30.0 - 1.2 * (time - 1.0);
                assert!((wheel.speed() - expected).abs() < 0.1, "{} {expected}", wheel.speed());
            }
        }
        assert!((wheel.speed() - 30.0).abs() < 0.1, "rolls again");
    }
}
