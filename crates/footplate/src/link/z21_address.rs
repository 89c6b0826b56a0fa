//! What a person writes to name a Z21: `z21:192.168.0.111` or `z21:HOST:PORT`, with
//! `[?steps=28&feedback=can&first-sensor=17&first-turnout=4&straight=first&sensor-delay=60&speed=20]`.

use footplate_core::{Ratio, TimeSpan};
use footplate_sim::{SpeedReports, Z21Switches};
use footplate_wire::z21::{Feedback, Settings};

use super::named_train::decoder_of;
use super::parameters::{number, times};
use super::port::host_and_port;

/// The port at which stations listen.
const PORT: u16 = 21_105;
/// The longest delay of a sensor that can be meant, in ms.
const LONGEST_DELAY_MS: u16 = 2_000;

/// A Z21.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Z21Address {
    /// Its name or address in the network.
    pub(crate) host: String,
    /// Its port.
    pub(crate) port: u16,
    /// Settings of the station, its sensors and its turnouts.
    pub(crate) settings: Settings,
    /// How many times faster than real time it runs; 1 for a real station.
    pub(crate) speed: f64,
}

impl Z21Address {
    /// Returns a station at a place in the network.
    ///
    /// # Errors
    /// When no place is named.
    pub(super) fn of(place: &str) -> Result<Self, String> {
        let wanted = || format!("`z21:{place}` names no station: write z21:192.168.0.111 or z21:HOST:{PORT}");
        let place = place.strip_prefix("//").unwrap_or(place);
        let (host, port) = host_and_port(place, PORT).ok_or_else(wanted)?;
        Ok(Self { host, port, settings: Settings::default(), speed: 1.0 })
    }

    pub(super) fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match (key, value) {
            ("steps", _) => self.settings.steps = decoder_of(value)?,
            ("feedback", _) => self.settings.feedback = feedback_named(value)?,
            ("first-sensor", _) => self.settings.first_sensor = number(key, value, "17")?,
            ("first-turnout", _) => self.settings.first_turnout = number(key, value, "4")?,
            ("straight", "first") => self.settings.second_is_straight = false,
            ("straight", "second") => self.settings.second_is_straight = true,
            ("straight", _) => {
                return Err(format!(
                    "`{value}` is no output of a turnout: use straight=first or straight=second"
                ));
            }
            ("sensor-delay", _) => {
                let ms: u16 = number(key, value, "60")?;
                if !(1..=LONGEST_DELAY_MS).contains(&ms) {
                    return Err(format!("sensor-delay {ms} is not between 1 and {LONGEST_DELAY_MS} ms"));
                }
                self.settings.sensor_delay = TimeSpan::from_ms(ms.into());
            }
            ("speed", _) => self.speed = times(value)?,
            _ => {
                return Err(format!(
                    "a Z21 link has no `{key}`; it has steps, feedback, first-sensor, first-turnout, straight, sensor-delay \
                     and speed"
                ));
            }
        }
        Ok(())
    }
}

fn feedback_named(value: &str) -> Result<Feedback, String> {
    match value {
        "r-bus" => Ok(Feedback::RBus),
        "can" => Ok(Feedback::Can),
        "loconet" => Ok(Feedback::LocoNet),
        _ => Err(format!(
            "`{value}` is no kind of feedback: use feedback=r-bus, feedback=can or feedback=loconet"
        )),
    }
}

/// How often a datagram is lost, comes twice or is overtaken in a simulated network that is bad: one in twenty.
const BAD: Ratio = Ratio::from_percent(5.0);

/// The quirks of a simulated Z21, as they are listed for people.
pub(super) const QUIRKS: &str = "lossy, twice and overtaken (datagrams are lost, come twice or are overtaken), slow (they take up to 60 ms), unsubscribed (the first \
                                 request for broadcasts is lost), strict (wrong XOR bytes are refused), wrong-xor (its own are wrong), \
                                 short (no functions from F29), first-only (only the first dataset of a datagram is read), locked (a \
                                 z21start without its code), can and loconet (detectors there in the place of the R-BUS), railcom and \
                                 railcom-nonsense (decoders report speeds, or any number)";

/// Sets a quirk of a simulated Z21; returns whether there is one of that name.
pub(super) fn set_quirk(switches: &mut Z21Switches, name: &str) -> bool {
    match name {
        "lossy" => switches.lost = BAD,
        "twice" => switches.duplicated = BAD,
        "overtaken" => switches.overtaken = BAD,
        "slow" => switches.is_slow = true,
        "unsubscribed" => switches.loses_first_subscription = true,
        "strict" => switches.strict_xor = true,
        "wrong-xor" => switches.wrong_xor = true,
        "short" => switches.short_states = true,
        "first-only" => switches.first_only = true,
        "locked" => switches.is_locked = true,
        "can" => switches.feedback = Feedback::Can,
        "loconet" => switches.feedback = Feedback::LocoNet,
        "railcom" => switches.speeds = SpeedReports::Speed,
        "railcom-nonsense" => switches.speeds = SpeedReports::Nonsense,
        _ => return false,
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::address::Address;
    use super::*;

    #[test]
    fn a_station_is_named_by_its_place_in_the_network() {
        let places = [
            ("z21:192.168.0.111", ("192.168.0.111", 21_105)),
            ("z21:127.0.0.1:3000", ("127.0.0.1", 3_000)),
            ("z21:z21.home", ("z21.home", 21_105)),
            ("z21:[::1]:3000", ("::1", 3_000)),
            ("z21:[fe80::1]", ("fe80::1", 21_105)),
        ];
        for (text, (host, port)) in places {
            let Ok(Address::Z21(z21)) = text.parse() else { panic!("{text}") };
            assert_eq!((z21.host.as_str(), z21.port), (host, port));
        }
        let written = "z21:192.168.0.111?steps=28&feedback=can&first-sensor=17&first-turnout=4&straight=first&sensor-delay=60";
        let Ok(Address::Z21(z21)) = written.parse() else { panic!("a Z21") };
        let expected = Settings {
            steps: footplate_core::DecoderSteps::TwentyEight,
            feedback: Feedback::Can,
            first_sensor: 17,
            first_turnout: 4,
            second_is_straight: false,
            sensor_delay: TimeSpan::from_ms(60),
            ..Settings::default()
        };
        assert_eq!(z21.settings, expected);
    }

    #[test]
    fn what_is_wrong_is_answered_with_what_would_be_right() {
        let cases = [
            ("z21:", "z21:192.168.0.111"),
            ("z21:host:many", "z21:HOST:21105"),
            ("z21:/dev/ttyUSB0", "z21:HOST:21105"),
            ("z21:host?steps=27", "14, 28 or 126"),
            ("z21:host?feedback=s88", "feedback=r-bus"),
            ("z21:host?straight=left", "straight=second"),
            ("z21:host?sensor-delay=0", "between 1 and 2000 ms"),
            ("z21:host?modules=5", "steps, feedback, first-sensor"),
        ];
        for (text, right) in cases {
            let refused = text.parse::<Address>().expect_err(text);
            assert!(refused.contains(right), "{text}: {refused}");
        }
    }
}
