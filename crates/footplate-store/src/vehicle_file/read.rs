//! Reads a vehicle from TOML.

use std::path::Path;

use footplate_core::odometry::wheels::{Axle, SlideProtection, Vehicle, VehicleError, Wheelset};
use footplate_core::{Acceleration, Length, Speed, TimeSpan};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::entries::{Entries, Fault, Number, kind, table, text};
use super::error::{VehicleFileError, VehicleProblem};
use super::keys::{BRAKE_COMMAND, Key, SLIDE_PROTECTION, THRESHOLDS};
use crate::text_file::{TextFile, TextPlace};

/// The largest file that is read, in bytes: a hundred times the built-in vehicle.
pub const LARGEST_VEHICLE: usize = 64 * 1024;

const VEHICLE: TextFile = TextFile { kind: "a vehicle", largest: LARGEST_VEHICLE };

/// A vehicle and what people call it.
#[derive(Debug, Clone, PartialEq)]
pub struct VehicleFile {
    /// What people call it; may be empty.
    pub name: String,
    /// What is known of it.
    pub vehicle: Vehicle,
}

/// Reads the vehicle file at `path`.
///
/// # Errors
/// What is wrong with it, with file, line and column.
pub fn read_vehicle(path: &Path) -> Result<VehicleFile, VehicleFileError> {
    let file = path.display().to_string();
    parse_vehicle(&file, &VEHICLE.read(path)?)
}

/// Reads a vehicle from the bytes of a file. `file` is what messages call it.
///
/// # Errors
/// As [`read_vehicle`].
pub fn parse_vehicle(file: &str, bytes: &[u8]) -> Result<VehicleFile, VehicleFileError> {
    let text = VEHICLE.text(file, bytes)?;
    read_text(text).map_err(|(byte, problem)| VehicleFileError::Wrong {
        place: TextPlace::of_byte(file, text, byte),
        problem,
    })
}

fn read_text(text: &str) -> Result<VehicleFile, Fault> {
    let document = DeTable::parse(text).map_err(|error| {
        let message = error.message().trim_end().replace('\n', "; ");
        (error.span().map_or(0, |span| span.start), VehicleProblem::Toml(message))
    })?;
    let mut entries = Entries::new(document.get_ref(), 0..0, "a vehicle");
    let mut numbers = Numbers::default();
    let name = entries.optional_text("name")?.unwrap_or_default().to_owned();
    let period = numbers.take(&mut entries, "period_s")?;
    let max_speed = numbers.take(&mut entries, "max_speed_m_s")?;
    let max_traction = numbers.take(&mut entries, "max_traction_m_s2")?;
    let max_brake = numbers.take(&mut entries, "max_brake_m_s2")?;
    let independent = entries.optional_truth("independent")?.unwrap_or(false);
    let wheelsets = wheelsets(entries.needs("wheelset")?, &mut numbers)?;
    let brake_command = entries.take("brake_command");
    let slide_protection = entries.take("slide_protection");
    let thresholds = entries.take("thresholds");
    entries.end()?;
    let mut vehicle = Vehicle::new(
        TimeSpan::from_s(period),
        Speed::from_m_per_s(max_speed),
        [max_traction, max_brake].map(Acceleration::from_m_per_s2),
        wheelsets,
    )
    .map_err(|error| numbers.fault(error))?;
    vehicle.independent = independent;
    if let Some(value) = brake_command {
        let table = table("brake_command", value, "a table `[brake_command]`")?;
        let entries = Entries::new(table, value.span(), "`[brake_command]`");
        numbers.replace(entries, &BRAKE_COMMAND, &mut vehicle.brake_command)?;
    }
    if let Some(value) = slide_protection {
        let table = table("slide_protection", value, "a table `[slide_protection]`")?;
        let mut entries = Entries::new(table, value.span(), "`[slide_protection]`");
        let mut protection = SlideProtection { creepage: 0.0, longest: TimeSpan::ZERO };
        for key in &SLIDE_PROTECTION {
            (key.set)(&mut protection, numbers.take(&mut entries, key.name)?);
        }
        entries.end()?;
        vehicle.slide_protection = Some(protection);
    }
    if let Some(value) = thresholds {
        let table = table("thresholds", value, "a table `[thresholds]`")?;
        let entries = Entries::new(table, value.span(), "`[thresholds]`");
        numbers.replace(entries, &THRESHOLDS, &mut vehicle.thresholds)?;
    }
    vehicle.check().map_err(|error| numbers.fault(error))?;
    Ok(VehicleFile { name, vehicle })
}

fn wheelsets(value: &Spanned<DeValue<'_>>, numbers: &mut Numbers) -> Result<[Wheelset; 2], Fault> {
    let begin = value.span().start;
    let DeValue::Array(tables) = value.get_ref() else {
        return Err(kind("wheelset", value.get_ref(), begin, "two tables, each below `[[wheelset]]`"));
    };
    let found = tables.len();
    let mut tables = tables.iter();
    match (tables.next(), tables.next(), tables.next()) {
        (Some(first), Some(second), None) => Ok([wheelset(first, numbers)?, wheelset(second, numbers)?]),
        _ => Err((begin, VehicleProblem::Wheelsets(found))),
    }
}

fn wheelset(value: &Spanned<DeValue<'_>>, numbers: &mut Numbers) -> Result<Wheelset, Fault> {
    const AXLES: &str = "\"powered\", \"trailing\" or \"unbraked\"";
    let written = table("wheelset", value, "a table below `[[wheelset]]`")?;
    let mut entries = Entries::new(written, value.span(), "`[[wheelset]]`");
    let teeth = numbers.take_whole(&mut entries, "teeth")?;
    let diameter = numbers.take(&mut entries, "diameter_m")?;
    let diameter_tolerance = numbers.take(&mut entries, "diameter_tolerance")?;
    let axle = entries.needs("axle")?;
    entries.end()?;
    let axle = match text("axle", axle, AXLES)? {
        "powered" => Axle::Powered,
        "trailing" => Axle::Trailing,
        "unbraked" => Axle::Unbraked,
        _ => return Err(kind("axle", axle.get_ref(), axle.span().start, AXLES)),
    };
    Ok(Wheelset { teeth, diameter: Length::from_m(diameter), diameter_tolerance, axle })
}

/// The numbers of a file and where they stand, so that one that no railway has can be pointed at.
#[derive(Default)]
struct Numbers(Vec<(&'static str, Number)>);

impl Numbers {
    fn take(&mut self, entries: &mut Entries<'_, '_>, key: &'static str) -> Result<f64, Fault> {
        let number = entries.number(key)?;
        self.0.push((key, number));
        Ok(number.value)
    }

    /// Puts what a table says in the place of what would hold without it.
    fn replace<T>(
        &mut self,
        mut entries: Entries<'_, '_>,
        keys: &[Key<T>],
        target: &mut T,
    ) -> Result<(), Fault> {
        for key in keys {
            if let Some(number) = entries.optional_number(key.name)? {
                self.0.push((key.name, number));
                (key.set)(target, number.value);
            }
        }
        entries.end()
    }

    /// A whole number; one that is too large or too small for a count becomes the nearest count, which is refused.
    fn take_whole(&mut self, entries: &mut Entries<'_, '_>, key: &'static str) -> Result<u32, Fault> {
        let number = entries.number(key)?;
        if number.value.fract() != 0.0 {
            let found = number.value.to_string();
            return Err((number.byte, VehicleProblem::Kind { key, found, expected: "a whole number" }));
        }
        self.0.push((key, number));
        Ok(number.value as u32)
    }

    /// Where the value stands that no railway has. Of two wheelsets it is the first whose value is out of range.
    fn fault(&self, error: VehicleError) -> Fault {
        let fits = |value: f64| error.lowest <= value && value <= error.highest;
        let of_key = || self.0.iter().filter(|(key, _)| *key == error.key).map(|(_, number)| *number);
        let found = of_key().find(|number| !fits(number.value)).or_else(|| of_key().next());
        let error = VehicleError { value: found.map_or(error.value, |number| number.value), ..error };
        (found.map_or(0, |number| number.byte), error.into())
    }
}
