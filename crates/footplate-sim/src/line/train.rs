//! A full-size train as one body: what it weighs, what slows it, how hard it pulls and brakes.
//!
//! ```text
//! m (1 + ρ) dv/dt = F - W(v) - m g (i + w_curve)
//! ```
//!
//! ρ is what turning wheels, axles and motors add to the inertia, F what traction and brake give, W the
//! resistance, i the gradient. Gradients count as per mille of the weight, as railways do: at the steepest, 150
//! per mille, that is 1.1 % more than the sine.

use core::fmt;

use footplate_core::{Acceleration, Length, Ratio, Speed};

use super::profile::{FASTEST_M_PER_S, LineProfile};
use super::resistance::{GRAVITY, Resistance};
use super::tractive_effort::TractiveEffort;

/// From a rail trolley to twice the heaviest train that ever ran (kg; 99 700 t in 2001).
const MASSES_KG: [f64; 2] = [100.0, 2e8];
/// From a point, where nothing is known of the length, to the longest train that ever ran (m; 7.35 km in 2001).
const LENGTHS_M: [f64; 2] = [0.0, 8000.0];
/// From nothing to an unladen rack locomotive (Wende: up to 0.3 for locomotives).
const ROTATING: [f64; 2] = [0.0, 0.5];
/// More than any adhesion gives (m/s²).
const STRONGEST_M_PER_S2: f64 = 5.0;
/// Ten times what the strongest locomotives pull together (N).
const STRONGEST_N: f64 = 1e8;

/// A train that runs as one body.
#[derive(Debug, Clone, PartialEq)]
pub struct Train {
    /// What people call it.
    pub name: String,
    /// From buffer to buffer; it keeps to a speed limit until its tail has passed.
    pub length: Length,
    /// The length behind the front over which its weight lies evenly: normally all of it. Zero makes it a point
    /// that feels the gradient under its front alone, as simple programs for running times have it.
    pub weight_length: Length,
    /// Its mass with its load (kg), without what turning adds.
    pub mass_kg: f64,
    /// What turning parts add to the inertia, as a share of the mass.
    pub rotating_mass: Ratio,
    /// What slows it on straight, level track.
    pub resistance: Resistance,
    /// How hard it can pull.
    pub tractive_effort: TractiveEffort,
    /// How it brakes.
    pub brake: Brake,
    /// It never runs faster.
    pub max_speed: Speed,
    /// It never accelerates more, if there is such a limit (for passengers, or set by the builder).
    pub max_acceleration: Option<Acceleration>,
}

/// How a train brakes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brake {
    /// What the driver plans with: the train then slows by this, whatever the gradient.
    pub service: Acceleration,
    /// All the brake can give, on a rail that holds it (N).
    pub full_n: f64,
}

impl Brake {
    /// Full over service braking where only the service deceleration is known. Chosen: service brakings of
    /// 0.6 to 0.9 m/s² and emergency brakings of 1.0 to 1.3 m/s² are usual.
    pub const FULL_OVER_SERVICE: f64 = 1.5;
}

impl Train {
    /// The mass that has to be accelerated (kg), turning parts included.
    pub fn inertia_kg(&self) -> f64 {
        self.mass_kg * (1.0 + self.rotating_mass.as_parts())
    }

    /// What the line does to it with its front at a place (N): positive against the motion, gradient and curves.
    pub fn line_force(&self, line: &LineProfile, front: Length) -> f64 {
        let per_mille = line.gradient().mean_behind(front, self.weight_length)
            + line.curve_resistance().mean_behind(front, self.weight_length);
        self.mass_kg * GRAVITY * per_mille / 1000.0
    }

    /// Its acceleration when traction and brake give `force_n` and the line `line_n` against it, while it moves.
    pub fn acceleration(&self, force_n: f64, line_n: f64, speed: Speed) -> Acceleration {
        let left = force_n - line_n - self.resistance.at(speed);
        Acceleration::from_m_per_s2(left / self.inertia_kg())
    }

    /// The force (N) of an effort: 1 is all traction that there is at this speed, −1 all of the brake.
    pub fn force(&self, effort: f64, speed: Speed) -> f64 {
        let effort = effort.clamp(-1.0, 1.0);
        if effort > 0.0 { effort * self.tractive_effort.at(speed) } else { effort * self.brake.full_n }
    }

    /// The effort of a force (N), −1 to 1: what [`force`](Self::force) turns back into it where it can.
    pub fn effort(&self, force_n: f64, speed: Speed) -> f64 {
        let all = if force_n > 0.0 { self.tractive_effort.at(speed) } else { self.brake.full_n };
        if all > 0.0 { (force_n / all).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// Whether every value is one that a train can have.
    ///
    /// # Errors
    /// The first value that no train has.
    pub fn check(&self) -> Result<(), TrainError> {
        let within = |what, value: f64, [lowest, highest]: [f64; 2]| {
            let fits = lowest <= value && value <= highest;
            if fits { Ok(()) } else { Err(TrainError { what, value, lowest, highest }) }
        };
        within("mass", self.mass_kg, MASSES_KG)?;
        within("length", self.length.as_m(), LENGTHS_M)?;
        within("weight length", self.weight_length.as_m(), [0.0, self.length.as_m()])?;
        within("rotating mass", self.rotating_mass.as_parts(), ROTATING)?;
        within("maximum speed", self.max_speed.as_m_per_s(), [1.0, FASTEST_M_PER_S])?;
        let resistance = self.resistance;
        within("constant resistance", resistance.constant_n, [0.0, STRONGEST_N])?;
        within("linear resistance", resistance.linear_n_s_per_m, [0.0, STRONGEST_N])?;
        within("square resistance", resistance.square_n_s2_per_m2, [0.0, STRONGEST_N])?;
        let strongest = [1e-3, STRONGEST_M_PER_S2];
        within("service braking", self.brake.service.as_m_per_s2(), strongest)?;
        let full =
            [self.inertia_kg() * self.brake.service.as_m_per_s2(), self.inertia_kg() * STRONGEST_M_PER_S2];
        // A rounding of the quotient that the force was made of is no fault.
        within("full brake force", self.brake.full_n, [full[0] * (1.0 - 1e-9), full[1]])?;
        if let Some(limit) = self.max_acceleration {
            within("maximum acceleration", limit.as_m_per_s2(), strongest)?;
        }
        match &self.tractive_effort {
            TractiveEffort::ForceAndPower { force_n, power_w } => {
                within("tractive effort", *force_n, [1.0, STRONGEST_N])?;
                within("power", *power_w, [1.0, STRONGEST_N * FASTEST_M_PER_S])?;
            }
            TractiveEffort::Table(points) => {
                let mut lowest = 0.0;
                for (speed, force) in points {
                    let speed = speed.as_m_per_s();
                    within("speed of a tractive effort", speed, [lowest, FASTEST_M_PER_S])?;
                    within("tractive effort", *force, [0.0, STRONGEST_N])?;
                    // The next one has to lie above, by however little.
                    lowest = speed.next_up();
                }
                within("largest tractive effort", self.tractive_effort.largest(), [1.0, STRONGEST_N])?;
            }
        }
        Ok(())
    }
}

/// A value that no train has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainError {
    /// What it is the value of, in SI units.
    pub what: &'static str,
    /// The value.
    pub value: f64,
    /// The least it can be.
    pub lowest: f64,
    /// The most it can be.
    pub highest: f64,
}

impl fmt::Display for TrainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, value, lowest, highest } = self;
        write!(f, "the {what} is {value}; it should lie between {lowest} and {highest}")
    }
}

impl core::error::Error for TrainError {}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::line::{LineParts, Stop};
    use footplate_core::TimeSpan;

    /// A multiple unit of 100 t and 100 m, 10 % of it turning, that pulls 100 kN up to 10 m/s.
    pub(crate) fn unit() -> Train {
        Train {
            name: "unit".to_owned(),
            length: Length::from_m(100.0),
            weight_length: Length::from_m(100.0),
            mass_kg: 100e3,
            rotating_mass: Ratio::from_percent(10.0),
            resistance: Resistance::davis(1000.0, 20.0, 4.0),
            tractive_effort: TractiveEffort::ForceAndPower { force_n: 100e3, power_w: 1e6 },
            brake: Brake { service: Acceleration::from_m_per_s2(0.8), full_n: 132e3 },
            max_speed: Speed::from_m_per_s(40.0),
            max_acceleration: None,
        }
    }

    fn slope() -> LineProfile {
        let place = Length::from_m;
        let stop = |name: &str, at| Stop { name: name.to_owned(), at: place(at), dwell: TimeSpan::ZERO };
        LineProfile::new(LineParts {
            name: "slope".to_owned(),
            gradients: vec![(place(0.0), 0.0), (place(500.0), 20.0)],
            curve_resistances: vec![(place(0.0), 0.0), (place(600.0), 2.0)],
            speed_limits: vec![(place(0.0), Speed::from_m_per_s(30.0))],
            stops: vec![stop("here", 0.0), stop("there", 1000.0)],
        })
        .unwrap()
    }

    #[test]
    fn a_slope_takes_hold_of_the_train_as_it_comes_onto_it() {
        let (train, line) = (unit(), slope());
        // 20 per mille of 980.665 kN under half the train; then with 2 per mille of curve under all of it.
        assert!((train.line_force(&line, Length::from_m(550.0)) - 9_806.65).abs() < 1e-6);
        assert!((train.line_force(&line, Length::from_m(700.0)) - 21_574.63).abs() < 1e-6);
        assert_eq!(line.height(Length::from_m(1000.0)), Length::from_m(10.0));
    }

    #[test]
    fn inertia_is_more_than_mass_and_weight_is_not() {
        // 100 kN less 1000 N over 110 t.
        let a = unit().acceleration(100e3, 0.0, Speed::ZERO);
        assert!((a.as_m_per_s2() - 0.9).abs() < 1e-12);
    }

    #[test]
    fn an_effort_is_a_share_of_what_there_is() {
        let train = unit();
        let fast = Speed::from_m_per_s(20.0);
        assert_eq!(train.force(1.0, fast), 50e3);
        assert_eq!(train.force(-0.5, fast), -66e3);
        assert_eq!(train.force(-7.0, fast), -132e3);
        assert_eq!(train.effort(25e3, fast), 0.5);
        assert_eq!(train.effort(-1e9, fast), -1.0);
    }

    #[test]
    fn the_value_that_no_train_has_is_named() {
        let wrong = |change: fn(&mut Train)| {
            let mut train = unit();
            change(&mut train);
            train.check().unwrap_err().to_string()
        };
        assert!(unit().check().is_ok());
        assert_eq!(
            wrong(|train| train.mass_kg = -5.0),
            "the mass is -5; it should lie between 100 and 200000000"
        );
        assert_eq!(
            wrong(|train| train.weight_length = Length::from_m(101.0)),
            "the weight length is 101; it should lie between 0 and 100"
        );
        assert!(
            wrong(|train| train.resistance.linear_n_s_per_m = f64::NAN).contains("linear resistance is NaN")
        );
        assert!(wrong(|train| train.brake.full_n = 10e3).starts_with("the full brake force is 10000;"));
        let twice = vec![(Speed::ZERO, 1e5), (Speed::ZERO, 1e4)];
        let table = TractiveEffort::Table(twice);
        assert!(Train { tractive_effort: table, ..unit() }.check().is_err());
        let none = TractiveEffort::Table(Vec::new());
        assert!(Train { tractive_effort: none, ..unit() }.check().is_err());
    }
}
