//! What is known of a train before it moves: its wheelsets, and what it can do at most.

use core::fmt;

use super::thresholds::Thresholds;
use super::wheelset::Wheelset;
use crate::time::TimeSpan;
use crate::units::{Acceleration, Speed};

/// Shortest and longest odometry period that makes sense (s): faster than any tachometer is read, slower than any
/// wheel that locks.
const PERIODS_S: (f64, f64) = (0.001, 1.0);
/// No wheel on rails ran faster (575 km/h in 2007, 160 m/s).
const FASTEST_M_PER_S: f64 = 200.0;
/// More than the best adhesion that was ever measured gives (0.5 g).
const STRONGEST_M_PER_S2: f64 = 5.0;
const TEETH: (u32, u32) = (1, 10_000);
/// From mine railways to driving wheels of steam engines (m).
const DIAMETERS_M: (f64, f64) = (0.1, 3.0);
const LARGEST_TOLERANCE: f64 = 0.1;

/// A train with two measured wheelsets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle {
    /// The odometry period.
    pub period: TimeSpan,
    /// The train never runs faster.
    pub max_speed: Speed,
    /// The train never accelerates more, downhill included.
    pub max_traction: Acceleration,
    /// The train never decelerates more, uphill included.
    pub max_brake: Acceleration,
    /// The wheelsets of the two tachometers.
    pub wheelsets: [Wheelset; 2],
    /// The two wheelsets are braked independently (in different bogies, each with its own cylinder and anti-slide
    /// valve), so that both sliding alike for seconds can be ruled out. Not so if one converter feeds both.
    pub independent: bool,
    /// What the slide protection is claimed to do; nothing if absent.
    pub slide_protection: Option<SlideProtection>,
    /// What the brake command is known to do.
    pub brake_command: BrakeCommand,
    /// Where detection and correction draw their lines.
    pub thresholds: Thresholds,
}

/// The deceleration that a brake command causes where adhesion suffices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrakeCommand {
    /// Deceleration at effort −1 on level track; proportional below.
    pub full: Acceleration,
    /// The true deceleration lies within this part of it, above or below.
    pub tolerance: f64,
    /// Largest acceleration by gradients, uphill or downhill.
    pub gradient: Acceleration,
    /// What running resistance adds to braking at most; it never drives.
    pub resistance: Acceleration,
    /// How long the brake takes from nothing to its full force.
    pub build_up: TimeSpan,
    /// How long after its command ends, brake or traction may still act on a wheel, and a wheel that slipped may take
    /// to turn with the train again.
    pub release: TimeSpan,
}

/// What the slide and slip protection of a train is claimed to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlideProtection {
    /// At least one of the two measured wheelsets has no more creepage than this, in either direction ...
    pub creepage: f64,
    /// ... but for times no longer than this.
    pub longest: TimeSpan,
}

impl BrakeCommand {
    /// What can be claimed of every brake that an emergency stop makes decelerate by `max_brake`: full service braking is
    /// three quarters of it, give or take 40 % for load and friction, on lines with gradients up to 40 mm/m, running
    /// resistance among them. Brakes of passenger trains release within 10 s.
    #[must_use]
    pub fn cautious(max_brake: Acceleration) -> Self {
        Self {
            full: max_brake * 0.75,
            tolerance: 0.4,
            gradient: Acceleration::from_m_per_s2(0.4),
            resistance: Acceleration::ZERO,
            build_up: TimeSpan::from_s(4.0),
            release: TimeSpan::from_s(10.0),
        }
    }
}

impl Vehicle {
    /// A vehicle whose thresholds follow from what it can do, and of whose brake command little is claimed.
    ///
    /// # Errors
    /// The first value that no railway has.
    pub fn new(
        period: TimeSpan,
        max_speed: Speed,
        [max_traction, max_brake]: [Acceleration; 2],
        wheelsets: [Wheelset; 2],
    ) -> Result<Self, VehicleError> {
        let thresholds = Thresholds::derived(max_traction, max_brake);
        let brake_command = BrakeCommand::cautious(max_brake);
        let vehicle = Self {
            period,
            max_speed,
            max_traction,
            max_brake,
            wheelsets,
            independent: false,
            slide_protection: None,
            brake_command,
            thresholds,
        };
        vehicle.check()?;
        Ok(vehicle)
    }

    /// Whether every value is one that a railway can have.
    ///
    /// # Errors
    /// The first value that no railway has.
    pub fn check(&self) -> Result<(), VehicleError> {
        let within = |key, value: f64, (lowest, highest): (f64, f64)| {
            let fits = lowest <= value && value <= highest;
            if fits { Ok(()) } else { Err(VehicleError { key, value, lowest, highest }) }
        };
        within("period_s", self.period.as_s(), PERIODS_S)?;
        within("max_speed_m_s", self.max_speed.as_m_per_s(), (1.0, FASTEST_M_PER_S))?;
        within("max_traction_m_s2", self.max_traction.as_m_per_s2(), (0.01, STRONGEST_M_PER_S2))?;
        within("max_brake_m_s2", self.max_brake.as_m_per_s2(), (0.01, STRONGEST_M_PER_S2))?;
        for wheelset in &self.wheelsets {
            let (fewest, most) = TEETH;
            within("teeth", f64::from(wheelset.teeth), (f64::from(fewest), f64::from(most)))?;
            within("diameter_m", wheelset.diameter.as_m(), DIAMETERS_M)?;
            within("diameter_tolerance", wheelset.diameter_tolerance, (0.0, LARGEST_TOLERANCE))?;
        }
        let command = &self.brake_command;
        within("full_brake_m_s2", command.full.as_m_per_s2(), (0.01, STRONGEST_M_PER_S2))?;
        within("full_brake_tolerance", command.tolerance, (0.0, 1.0))?;
        within("gradient_m_s2", command.gradient.as_m_per_s2(), (0.0, STRONGEST_M_PER_S2))?;
        within("resistance_m_s2", command.resistance.as_m_per_s2(), (0.0, STRONGEST_M_PER_S2))?;
        within("build_up_s", command.build_up.as_s(), (0.0, 60.0))?;
        within("release_s", command.release.as_s(), (0.0, 120.0))?;
        if let Some(protection) = &self.slide_protection {
            within("longest_s", protection.longest.as_s(), (0.0, 120.0))?;
            within("creepage", protection.creepage, (0.0, 0.9))?;
        }
        self.thresholds.check()
    }
}

/// A value that no railway has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleError {
    /// The key of the value in a vehicle file.
    pub key: &'static str,
    /// The value.
    pub value: f64,
    /// The least it can be.
    pub lowest: f64,
    /// The most it can be.
    pub highest: f64,
}

impl fmt::Display for VehicleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, value, lowest, highest } = self;
        write!(f, "{key} is {value}; it should lie between {lowest} and {highest}")
    }
}

impl core::error::Error for VehicleError {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::odometry::wheels::Axle;
    use crate::units::Length;

    fn wheelset(diameter: f64) -> Wheelset {
        let diameter = Length::from_m(diameter);
        Wheelset { teeth: 80, diameter, diameter_tolerance: 0.012, axle: Axle::Powered }
    }

    fn vehicle(diameter: f64) -> Result<Vehicle, VehicleError> {
        Vehicle::new(
            TimeSpan::from_ms(50),
            Speed::from_m_per_s(70.0),
            [1.2, 1.4].map(Acceleration::from_m_per_s2),
            [wheelset(0.86), wheelset(diameter)],
        )
    }

    #[test]
    fn the_example_of_the_contract_is_a_vehicle() {
        assert!(vehicle(0.86).is_ok());
    }

    #[test]
    fn an_absurd_diameter_is_named_with_what_would_be_right() {
        for absurd in [860.0, 0.0, -0.86, f64::NAN, f64::INFINITY] {
            let error = vehicle(absurd).expect_err("no wheel is like that");
            assert_eq!(error.key, "diameter_m");
            assert_eq!((error.lowest, error.highest), DIAMETERS_M);
        }
    }

    #[test]
    fn the_pitch_of_eighty_teeth_is_that_of_the_table() {
        // 33.8 mm, from the table of the field's usual sensors.
        assert!((wheelset(0.86).pulse_pitch().as_mm() - 33.8).abs() < 0.05);
    }
}
