//! What a person writes to name a DCC-EX board: `dcc-ex:/dev/ttyACM0` or `dcc-ex:tcp://192.168.4.1:2560`, with
//! `[?turnouts=defined&first-sensor=100&reset=no&speed=20]`.

use footplate_wire::dcc_ex::{Settings, TurnoutRequests};

use super::parameters::number;
use super::place::Place;
use super::stream::SerialFormat;

/// The port at which a board with a network connection listens.
const NETWORK_PORT: u16 = 2560;
/// The speed of a board's serial port.
const BAUD: u32 = 115_200;

/// Returns a board at a port. Opening a serial port resets most boards; a network connection resets none.
///
/// # Errors
/// When no port is named.
pub(super) fn read(port: &str) -> Result<(Place, Settings), String> {
    let place = Place::named("dcc-ex:", port, "/dev/ttyACM0", NETWORK_PORT, SerialFormat::of_baud(BAUD))?;
    let settings = Settings { resets_on_open: matches!(place, Place::Device(..)), ..Settings::default() };
    Ok((place, settings))
}

pub(super) fn set(settings: &mut Settings, key: &str, value: &str) -> Result<(), String> {
    match (key, value) {
        ("turnouts", "defined") => settings.turnouts = TurnoutRequests::Defined,
        ("turnouts", "confirmed") => settings.turnouts = TurnoutRequests::Confirmed,
        ("turnouts", "accessory") => settings.turnouts = TurnoutRequests::Accessory,
        ("turnouts", _) => {
            return Err(format!(
                "`{value}` is not a kind of turnouts: use turnouts=confirmed for decoder addresses, \
                     turnouts=accessory for the same without an answer of the board, or turnouts=defined for turnouts that you have defined there"
            ));
        }
        ("first-sensor", _) => settings.first_sensor = number(key, value, "100")?,
        ("reset", "yes") => settings.resets_on_open = true,
        ("reset", "no") => settings.resets_on_open = false,
        ("reset", _) => {
            return Err(format!("`{value}` is not a value of reset: use reset=yes or reset=no"));
        }
        _ => {
            return Err(format!(
                "a DCC-EX link has no `{key}`; it has turnouts, first-sensor, reset and speed"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::address::Address;
    use super::super::station_address::{StationAddress, StationSettings};
    use super::*;

    #[test]
    fn a_board_is_named_by_its_port() {
        let board = |text: &str| match text.parse() {
            Ok(Address::Station(StationAddress { cable, settings: StationSettings::Board(settings) })) => {
                (cable, settings)
            }
            other => panic!("{text}: {other:?}"),
        };
        let (cable, settings) = board("dcc-ex:tcp://127.0.0.1:2560?turnouts=defined&speed=20");
        assert_eq!(cable.place, Place::Tcp { host: "127.0.0.1".into(), port: 2560 });
        let turnouts = TurnoutRequests::Defined;
        assert_eq!(settings, Settings { resets_on_open: false, turnouts, first_sensor: 0 });
        let (_, serial) = board("dcc-ex:/dev/ttyACM0?first-sensor=100");
        assert!(serial.resets_on_open && serial.first_sensor == 100);
        assert!(!board("dcc-ex:/dev/ttyACM0?reset=no").1.resets_on_open);
    }
}
