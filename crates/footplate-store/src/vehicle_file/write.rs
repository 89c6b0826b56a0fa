//! Writes a vehicle as TOML that a person likes to read, and that reads back as the same vehicle.

use std::fmt::Write;

use footplate_core::Acceleration;
use footplate_core::odometry::wheels::{Axle, BrakeCommand, Thresholds};

use super::keys::{BRAKE_COMMAND, Key, SLIDE_PROTECTION, THRESHOLDS};
use super::read::VehicleFile;

/// The text of a vehicle file. What follows from the rest is left out.
pub fn write_vehicle(file: &VehicleFile) -> String {
    let VehicleFile { name, vehicle } = file;
    let mut text = format!("name = {}\n", toml::Value::String(name.clone()));
    line(&mut text, "period_s", vehicle.period.as_s(), "");
    line(&mut text, "max_speed_m_s", vehicle.max_speed.as_m_per_s(), "");
    let [traction, brake] = [vehicle.max_traction, vehicle.max_brake].map(Acceleration::as_m_per_s2);
    line(&mut text, "max_traction_m_s2", traction, "the most the train can do, grade included");
    line(&mut text, "max_brake_m_s2", brake, "emergency brake on dry rail, grade included");
    if vehicle.independent {
        text.push_str(
            "independent = true  # each wheelset has its own brake: both never slide alike for long\n",
        );
    }
    for (wheelset, pulses) in vehicle.wheelsets.iter().zip(["pulses_1", "pulses_2"]) {
        let _ = writeln!(text, "\n[[wheelset]]  # {pulses}\nteeth = {}", wheelset.teeth);
        line(&mut text, "diameter_m", wheelset.diameter.as_m(), "");
        line(
            &mut text,
            "diameter_tolerance",
            wheelset.diameter_tolerance,
            "relative; the true diameter lies within",
        );
        let axle = match wheelset.axle {
            Axle::Powered => "powered",
            Axle::Trailing => "trailing",
            Axle::Unbraked => "unbraked",
        };
        let _ = writeln!(text, "axle = \"{axle}\"");
    }
    let claimed = BrakeCommand::cautious(vehicle.max_brake);
    changed(&mut text, "brake_command", &BRAKE_COMMAND, [&vehicle.brake_command, &claimed]);
    if let Some(protection) = &vehicle.slide_protection {
        text.push_str("\n[slide_protection]\n");
        for key in &SLIDE_PROTECTION {
            line(&mut text, key.name, (key.get)(protection), "");
        }
    }
    let derived = Thresholds::derived(vehicle.max_traction, vehicle.max_brake);
    changed(&mut text, "thresholds", &THRESHOLDS, [&vehicle.thresholds, &derived]);
    text
}

/// A table of the numbers that are not what would hold without it, if there are any.
fn changed<T>(text: &mut String, table: &str, keys: &[Key<T>], [own, without]: [&T; 2]) {
    let changed = keys.iter().filter(|key| (key.get)(own) != (key.get)(without));
    for (at, key) in changed.enumerate() {
        if at == 0 {
            let _ = writeln!(text, "\n[{table}]");
        }
        line(text, key.name, (key.get)(own), "");
    }
}

/// A number as TOML knows it, with the fewest digits that read back as the same.
fn line(text: &mut String, key: &str, value: f64, comment: &str) {
    let gap = if comment.is_empty() { "" } else { "  # " };
    let _ = writeln!(text, "{key} = {value:?}{gap}{comment}");
}

#[cfg(test)]
mod tests {
    use super::super::read::parse_vehicle;
    use super::super::{VehicleFile, default_vehicle};
    use super::*;
    use footplate_core::TimeSpan;
    use footplate_core::odometry::wheels::SlideProtection;

    #[test]
    fn what_is_written_reads_back_as_the_same_vehicle() {
        let mut file: VehicleFile = default_vehicle().unwrap();
        file.name = "line \"7\"\nwith a tail".to_owned();
        assert_eq!(parse_vehicle("v.toml", write_vehicle(&file).as_bytes()).unwrap(), file);
        assert_eq!(write_vehicle(&file).matches('[').count(), 4, "what follows from the rest is left out");

        file.vehicle.brake_command = BrakeCommand {
            full: Acceleration::from_m_per_s2(1.0),
            tolerance: 0.3,
            gradient: Acceleration::from_m_per_s2(1e-7),
            resistance: Acceleration::from_m_per_s2(0.2),
            build_up: TimeSpan::from_ms(1500),
            release: TimeSpan::from_ms(2500),
        };
        file.vehicle.slide_protection =
            Some(SlideProtection { creepage: 0.2, longest: TimeSpan::from_ms(4000) });
        file.vehicle.independent = true;
        file.vehicle.thresholds.creepage = 0.07;
        file.vehicle.thresholds.rolling_creepage = 0.01;
        file.vehicle.thresholds.clear_after = TimeSpan::from_ms(700);
        let text = write_vehicle(&file);
        assert_eq!(parse_vehicle("v.toml", text.as_bytes()).unwrap(), file, "{text}");
    }
}
