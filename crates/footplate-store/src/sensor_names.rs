//! What people call a sensor: the names that files use for the numbers inside.

use footplate_core::SensorId;
use footplate_core::track::Layout;

/// The names of a railway's sensors, in both directions.
pub trait SensorNames {
    /// The sensor of that name.
    fn sensor_named(&self, name: &str) -> Option<SensorId>;

    /// The detector of the block of that name.
    fn block_named(&self, _name: &str) -> Option<SensorId> {
        None
    }

    /// The name of a sensor, as [`sensor_named`](Self::sensor_named) reads it, or of the block of a detector.
    fn name_of(&self, sensor: SensorId) -> Option<String>;

    /// What a right name looks like, to end the sentence "this should be …".
    fn example(&self) -> String {
        "the name of a sensor of this layout".to_owned()
    }
}

/// Sensors named as on a layout.
impl SensorNames for Layout {
    fn sensor_named(&self, name: &str) -> Option<SensorId> {
        self.sensor_named(name)
    }

    fn block_named(&self, name: &str) -> Option<SensorId> {
        self.blocks().iter().find(|block| block.name == name).map(|block| block.detector)
    }

    fn name_of(&self, sensor: SensorId) -> Option<String> {
        let is_known = self.sensor_node(sensor).is_some() || self.block_of_detector(sensor).is_some();
        is_known.then(|| self.sensor_name(sensor).to_owned())
    }

    fn example(&self) -> String {
        let first = self.sensors().next().map(|(sensor, _)| self.sensor_name(sensor));
        first.map_or_else(
            || "a sensor, and this layout has none".to_owned(),
            |first| format!("the name of a sensor of {}, such as {first}", self.name()),
        )
    }
}

/// Sensors named by the letter of their module and their contact on it: A1 … A16, B1 … E16 are 0 … 79.
///
/// The rule of the S88 modules on the tracks of the real-time courses: five of them, 16 contacts each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ModuleLetters;

const FIRST_MODULE: u8 = b'A';
const MODULES: u8 = 5;
const CONTACTS_A_MODULE: u8 = 16;

impl SensorNames for ModuleLetters {
    fn sensor_named(&self, name: &str) -> Option<SensorId> {
        let (&letter, digits) = name.as_bytes().split_first()?;
        let module = letter.checked_sub(FIRST_MODULE).filter(|module| *module < MODULES)?;
        if digits.is_empty() || digits.len() > 2 || !digits.iter().all(u8::is_ascii_digit) {
            return None;
        }
        let contact = digits.iter().fold(0, |number, digit| number * 10 + (digit - b'0'));
        let index = contact.checked_sub(1).filter(|index| *index < CONTACTS_A_MODULE)?;
        Some(SensorId(u16::from(module * CONTACTS_A_MODULE + index)))
    }

    fn name_of(&self, sensor: SensorId) -> Option<String> {
        let number = u8::try_from(sensor.0).ok().filter(|number| *number < MODULES * CONTACTS_A_MODULE)?;
        let letter = char::from(FIRST_MODULE + number / CONTACTS_A_MODULE);
        Some(format!("{letter}{}", number % CONTACTS_A_MODULE + 1))
    }

    fn example(&self) -> String {
        "a sensor from A1 to E16".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_and_contacts_count_through() {
        for (name, number) in [("A1", 0), ("A16", 15), ("B1", 16), ("C13", 44), ("E16", 79)] {
            assert_eq!(ModuleLetters.sensor_named(name), Some(SensorId(number)));
            assert_eq!(ModuleLetters.name_of(SensorId(number)).as_deref(), Some(name));
        }
        assert_eq!(ModuleLetters.sensor_named("A01"), Some(SensorId(0)));
    }

    #[test]
    fn a_layout_names_its_sensors() {
        let layout: &dyn SensorNames = &crate::built_in("track-a").unwrap().layout;
        assert_eq!(layout.sensor_named("C13"), Some(SensorId(44)));
        assert_eq!(layout.name_of(SensorId(44)).as_deref(), Some("C13"));
        assert_eq!((layout.sensor_named("BR6"), layout.name_of(SensorId(80))), (None, None));
        assert_eq!(layout.example(), "the name of a sensor of track-a, such as A1");
    }

    #[test]
    fn what_lies_beyond_has_no_number() {
        for name in ["", "A", "A0", "A17", "F1", "a1", "A+1", "A1 ", "A001", "Ä1", "1A"] {
            assert_eq!(ModuleLetters.sensor_named(name), None, "{name}");
        }
        assert_eq!(ModuleLetters.name_of(SensorId(80)), None);
        assert_eq!(ModuleLetters.name_of(SensorId(u16::MAX)), None);
    }
}
