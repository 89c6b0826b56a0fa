//! The vehicle that stands in where none is given.

use super::error::VehicleFileError;
use super::read::{VehicleFile, parse_vehicle};

/// The text of the vehicle that stands in where none is given; a beginning for one's own.
pub const DEFAULT_VEHICLE: &str = include_str!("../../vehicles/two-measured-wheelsets.toml");

/// A metro train with two powered wheelsets of 80 teeth.
///
/// # Errors
/// None, as a test shows; that its text is read like any other is why it could.
pub fn default_vehicle() -> Result<VehicleFile, VehicleFileError> {
    parse_vehicle("the built-in vehicle", DEFAULT_VEHICLE.as_bytes())
}

#[cfg(test)]
mod tests {
    use footplate_core::Acceleration;
    use footplate_core::odometry::wheels::{Axle, BrakeCommand};

    use super::*;

    #[test]
    fn the_vehicle_that_stands_in_is_the_one_of_the_documentation() {
        let VehicleFile { name, vehicle } = default_vehicle().unwrap();
        assert_eq!(name, "two measured wheelsets");
        assert_eq!(vehicle.period.as_ms(), 50.0);
        let limits = [vehicle.max_traction, vehicle.max_brake].map(Acceleration::as_m_per_s2);
        assert_eq!((vehicle.max_speed.as_m_per_s(), limits), (70.0, [1.2, 1.4]));
        for wheelset in vehicle.wheelsets {
            assert_eq!((wheelset.teeth, wheelset.axle), (80, Axle::Powered));
            assert_eq!((wheelset.diameter.as_m(), wheelset.diameter_tolerance), (0.86, 0.012));
        }
        assert_eq!(vehicle.brake_command, BrakeCommand::cautious(vehicle.max_brake));
    }
}
