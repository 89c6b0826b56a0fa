//! What a person writes to name a DCC-EX board: `dcc-ex:/dev/ttyACM0` or `dcc-ex:tcp://192.168.4.1:2560`, with
//! `[?turnouts=defined&first-sensor=100&reset=no&speed=20]`.

use footplate_wire::dcc_ex::{Settings, TurnoutRequests};

use super::parameters::{number, times};
use super::port::Port;

/// The port at which a board with a network connection listens.
const NETWORK_PORT: u16 = 2560;

/// A DCC-EX board.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BoardAddress {
    /// Where it is.
    pub(crate) port: Port,
    /// Its settings.
    pub(crate) settings: Settings,
    /// How many times faster than real time it runs; 1 for a real station.
    pub(crate) speed: f64,
}

impl BoardAddress {
    /// Returns a board at a port. Opening a serial port resets most boards; a network connection resets none.
    ///
    /// # Errors
    /// When no port is named.
    pub(super) fn of(port: &str) -> Result<Self, String> {
        let port = Port::named("dcc-ex:", port, "/dev/ttyACM0", NETWORK_PORT)?;
        let resets_on_open = matches!(port, Port::Device(_));
        Ok(Self { port, settings: Settings { resets_on_open, ..Settings::default() }, speed: 1.0 })
    }

    pub(super) fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match (key, value) {
            ("turnouts", "defined") => self.settings.turnouts = TurnoutRequests::Defined,
            ("turnouts", "accessory") => self.settings.turnouts = TurnoutRequests::Accessory,
            ("turnouts", _) => {
                return Err(format!(
                    "`{value}` is not a kind of turnouts: use turnouts=accessory for decoder addresses \
                     or turnouts=defined for turnouts that are defined on the board"
                ));
            }
            ("first-sensor", _) => self.settings.first_sensor = number(key, value, "100")?,
            ("reset", "yes") => self.settings.resets_on_open = true,
            ("reset", "no") => self.settings.resets_on_open = false,
            ("reset", _) => {
                return Err(format!("`{value}` is not a value of reset: use reset=yes or reset=no"));
            }
            ("speed", _) => self.speed = times(value)?,
            _ => {
                return Err(format!(
                    "a DCC-EX link has no `{key}`; it has turnouts, first-sensor, reset and speed"
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::address::Address;
    use super::*;

    #[test]
    fn a_board_is_named_by_its_port() {
        let Ok(Address::Board(network)) = "dcc-ex:tcp://127.0.0.1:2560?turnouts=defined&speed=20".parse()
        else {
            panic!("a board")
        };
        assert_eq!(network.port, Port::Tcp { host: "127.0.0.1".into(), port: 2560 });
        let turnouts = TurnoutRequests::Defined;
        assert_eq!(network.settings, Settings { resets_on_open: false, turnouts, first_sensor: 0 });
        let Ok(Address::Board(serial)) = "dcc-ex:/dev/ttyACM0?first-sensor=100".parse() else {
            panic!("a board")
        };
        assert!(serial.settings.resets_on_open && serial.settings.first_sensor == 100);
        let Ok(Address::Board(serial)) = "dcc-ex:/dev/ttyACM0?reset=no".parse() else { panic!("a board") };
        assert!(!serial.settings.resets_on_open);
    }

    #[test]
    fn what_is_wrong_is_answered_with_what_would_be_right() {
        let cases = [
            ("dcc-ex:", "dcc-ex:/dev/ttyACM0"),
            ("dcc-ex:tcp://host", "tcp://127.0.0.1:2560"),
            ("dcc-ex:/dev/ttyACM0?turnouts=all", "turnouts=defined"),
            ("dcc-ex:/dev/ttyACM0?reset=maybe", "reset=no"),
            ("dcc-ex:/dev/ttyACM0?first-sensor=-1", "first-sensor=100"),
            ("dcc-ex:/dev/ttyACM0?modules=5", "turnouts, first-sensor, reset and speed"),
        ];
        for (text, right) in cases {
            let refused = text.parse::<Address>().expect_err(text);
            assert!(refused.contains(right), "{text}: {refused}");
        }
    }
}
