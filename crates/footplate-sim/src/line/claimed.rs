//! What an operator claims of a train that a scenario set up.

use footplate_core::{Acceleration, TimeSpan};

use super::resistance::GRAVITY;
use super::setup::Setup;
use super::vehicle::{BRAKE_TOLERANCE, LineBrake, LineVehicle, LineWheelset};

/// What is left out of the sums behind a claim: steps of rounding, rotation, creepage (m/s²).
const ROOM_M_PER_S2: f64 = 0.05;
/// How much faster than it may a train can be while its driver corrects that (part of its speed).
const OVERSPEED: f64 = 0.03;
/// Filling times of a brake cylinder that come on top of the ramp of the command (s).
const BUILD_UP_S: f64 = 1.6;
/// Sixteen bits.
const COUNTER_MODULUS: i64 = 1 << 16;

impl LineVehicle {
    /// What is claimed of the train that was set up, on the steepest gradient of its line.
    pub(crate) fn claimed(name: &str, setup: &Setup, period: TimeSpan, wheelsets: [LineWheelset; 2]) -> Self {
        let design = &setup.design;
        let gradient = setup.steepest * GRAVITY + ROOM_M_PER_S2;
        let resistance = design.strongest_resistance();
        let hundredths = |value: f64| Acceleration::from_m_per_s2((100.0 * value).ceil() / 100.0);
        Self {
            name: name.to_owned(),
            period,
            max_speed: design.train.max_speed * (1.0 + OVERSPEED),
            max_traction: hundredths(design.start() * (1.0 + BRAKE_TOLERANCE) + gradient),
            max_brake: hundredths(design.full_brake() * (1.0 + BRAKE_TOLERANCE) + gradient + resistance),
            wheelsets,
            independent: setup.placement.is_independent(),
            brake_command: LineBrake {
                full: Acceleration::from_m_per_s2(design.full_brake()),
                tolerance: setup.brake_tolerance,
                gradient: hundredths(gradient),
                resistance: hundredths(resistance),
                build_up: TimeSpan::from_s(design.full_brake() / design.jerk + BUILD_UP_S),
                release: None,
            },
            slide_protection: None,
            counter_modulus: COUNTER_MODULUS,
        }
    }
}
