//! What a person writes to name a Z21: `z21:192.168.0.111` or `z21:HOST:PORT`, with
//! `[?steps=28&feedback=can&first-sensor=17&first-turnout=4&straight=first&sensor-delay=60&speed=20]`.

use footplate_core::{Ratio, TimeSpan};
use footplate_sim::{SpeedReports, Z21Switches};
use footplate_wire::z21::{Feedback, Settings};

use super::datagrams::Correspondent;
use super::named_train::decoder_of;
use super::parameters::number;
use super::place::{Place, host_and_port};

/// The port at which stations listen.
const PORT: u16 = 21_105;
/// The longest delay of a sensor that can be meant, in ms.
const LONGEST_DELAY_MS: u16 = 2_000;

/// Returns a station at a place in the network.
///
/// # Errors
/// When no place is named.
pub(super) fn read(place: &str) -> Result<(Place, Settings), String> {
    let wanted = || format!("`z21:{place}` names no station: write z21:192.168.0.111 or z21:HOST:{PORT}");
    let place = place.strip_prefix("//").unwrap_or(place);
    let (host, port) = host_and_port(place, PORT).ok_or_else(wanted)?;
    Ok((Place::Datagrams(Correspondent { host, port, receive_at: None }), Settings::default()))
}

pub(super) fn set(settings: &mut Settings, key: &str, value: &str) -> Result<(), String> {
    match (key, value) {
        ("steps", _) => settings.steps = decoder_of(value)?,
        ("feedback", _) => settings.feedback = feedback_named(value)?,
        ("first-sensor", _) => settings.first_sensor = number(key, value, "17")?,
        ("first-turnout", _) => settings.first_turnout = number(key, value, "4")?,
        ("straight", "first") => settings.second_is_straight = false,
        ("straight", "second") => settings.second_is_straight = true,
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
            settings.sensor_delay = TimeSpan::from_ms(ms.into());
        }
        _ => {
            return Err(format!(
                "a Z21 link has no `{key}`; it has steps, feedback, first-sensor, first-turnout, straight, sensor-delay \
                     and speed"
            ));
        }
    }
    Ok(())
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
    use super::super::station_address::StationSettings;
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
            let Ok(Address::Station(z21)) = text.parse() else { panic!("{text}") };
            let station = Correspondent { host: host.into(), port, receive_at: None };
            assert_eq!(z21.cable.place, Place::Datagrams(station));
        }
        let written = "z21:192.168.0.111?steps=28&feedback=can&first-sensor=17&first-turnout=4&straight=first&sensor-delay=60";
        let Ok(Address::Station(z21)) = written.parse() else { panic!("a Z21") };
        let expected = Settings {
            steps: footplate_core::DecoderSteps::TwentyEight,
            feedback: Feedback::Can,
            first_sensor: 17,
            first_turnout: 4,
            second_is_straight: false,
            sensor_delay: TimeSpan::from_ms(60),
            ..Settings::default()
        };
        assert_eq!(z21.settings, StationSettings::Z21(expected));
    }
}
