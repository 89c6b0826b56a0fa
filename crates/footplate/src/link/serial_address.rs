//! The address of a 6050 or 6051: `marklin-serial:DEVICE` or `marklin-serial:tcp://HOST:PORT`, with
//! `[?pace=careful&cts=no&modules=5&speed=20]`.

use footplate_wire::marklin_serial::Pace;
use serialport::StopBits;

use super::place::Place;
use super::stream::SerialFormat;

/// The port that a served simulated 6051 is written with in examples.
const EXAMPLE_PORT: u16 = 2400;
/// How the interface's line is used (Märklin).
const FORMAT: SerialFormat = SerialFormat { baud: 2400, stop_bits: StopBits::Two, cts: None };

pub(super) fn read(port: &str) -> Result<Place, String> {
    Place::named("marklin-serial:", port, "/dev/ttyUSB0", EXAMPLE_PORT, FORMAT)
}

/// Changes a setting other than the number of modules.
pub(super) fn set(pace: &mut Option<Pace>, place: &mut Place, key: &str, value: &str) -> Result<(), String> {
    let uses_cts = match (key, value) {
        ("pace", "careful" | "fast") => {
            *pace = Some(if value == "fast" { Pace::FAST } else { Pace::CAREFUL });
            return Ok(());
        }
        ("pace", _) => return Err(format!("`{value}` is not a pace: use pace=careful or pace=fast")),
        ("cts", "yes") => true,
        ("cts", "no") => false,
        ("cts", _) => return Err(format!("`{value}` is not a value of cts: use cts=yes or cts=no")),
        _ => return Err(format!("a serial link has no `{key}`; it has pace, cts, modules and speed")),
    };
    // A connection over a network has no hand-shake line.
    if let Place::Device(_, format) = place {
        format.cts = Some(uses_cts);
    }
    Ok(())
}
