//! What a person writes to name JMRI: `jmri:192.168.0.20` or `jmri:HOST:PORT`, with
//! `[?system=L&first-sensor=17&first-turnout=5&straight=thrown&sensor-delay=150&speed=20]`.

use footplate_sim::JmriSwitches;
use footplate_wire::jmri::Settings;

use super::loconet_address::{is_closed_straight, sensor_delay};
use super::parameters::number;
use super::place::{Place, host_and_port};

const SCHEME: &str = "jmri:";
/// The port of JMRI's web server.
const PORT: u16 = 12_080;

/// Returns JMRI at a place in the network.
///
/// # Errors
/// When no place is named.
pub(super) fn read(place: &str) -> Result<(Place, Settings), String> {
    let named = place.strip_prefix("tcp://").unwrap_or(place);
    let (host, port) = host_and_port(named, PORT).ok_or_else(|| {
            format!(
                "`{SCHEME}{place}` names no computer: write {SCHEME}192.168.0.20 or {SCHEME}HOST:{PORT}, where JMRI's web server runs"
            )
        })?;
    Ok((Place::WebSocket { host, port }, Settings::default()))
}

pub(super) fn set(settings: &mut Settings, key: &str, value: &str) -> Result<(), String> {
    match key {
        "system" => settings.prefix = Some(prefix_of(value)?),
        "first-sensor" => settings.first_sensor = number(key, value, "17")?,
        "first-turnout" => settings.first_turnout = number(key, value, "5")?,
        "straight" => settings.closed_is_straight = is_closed_straight(value)?,
        "sensor-delay" => settings.sensor_delay = sensor_delay(key, value)?,
        _ => {
            return Err(format!(
                "a JMRI link has no `{key}`; it has system, first-sensor, first-turnout, straight, sensor-delay and speed"
            ));
        }
    }
    Ok(())
}

/// The prefix of a system: a letter, and a number where there are several of one kind.
fn prefix_of(value: &str) -> Result<String, String> {
    let is_prefix = |text: &str| {
        let mut rest = text.chars();
        rest.next().is_some_and(|first| first.is_ascii_alphabetic()) && rest.all(|one| one.is_ascii_digit())
    };
    if is_prefix(value) {
        return Ok(value.to_owned());
    }
    Err(format!(
        "`{value}` is no prefix of a system: write system=L where JMRI's sensors are called LS1, LS2, …"
    ))
}

/// The quirks of a simulated JMRI, as they are listed for people.
pub(super) const QUIRKS: &str = "no-prefix (it does not state the prefix of its system), no-power (it does not know whether the track \
                                 has power), polled (its sensors are polled), one-throttle (its hardware drives one locomotive)";

/// Sets a quirk of a simulated JMRI; returns whether there is one of that name.
pub(super) fn set_quirk(switches: &mut JmriSwitches, name: &str) -> bool {
    match name {
        "no-prefix" => switches.has_prefix = false,
        "no-power" => switches.knows_power = false,
        "polled" => switches.polls = true,
        "one-throttle" => switches.throttles = 1,
        _ => return false,
    }
    true
}

#[cfg(test)]
mod tests {
    use footplate_core::TimeSpan;

    use super::super::address::Address;
    use super::super::station_address::StationSettings;
    use super::*;

    #[test]
    fn jmri_is_named_by_its_place_in_the_network() {
        for (text, place) in [
            ("jmri:192.168.0.20", ("192.168.0.20", 12_080)),
            ("jmri:attic.local:12081", ("attic.local", 12_081)),
            ("jmri:tcp://[::1]:12081", ("::1", 12_081)),
        ] {
            let Ok(Address::Station(jmri)) = text.parse() else { panic!("{text}") };
            assert_eq!(jmri.cable.place, Place::WebSocket { host: place.0.to_owned(), port: place.1 });
        }
        let written =
            "jmri:host?system=L2&first-sensor=17&first-turnout=5&straight=thrown&sensor-delay=150&speed=20";
        let Ok(Address::Station(jmri)) = written.parse() else { panic!("JMRI") };
        let expected = Settings {
            prefix: Some("L2".to_owned()),
            first_sensor: 17,
            first_turnout: 5,
            closed_is_straight: false,
            sensor_delay: TimeSpan::from_ms(150),
            ..Settings::default()
        };
        assert_eq!(jmri.settings, StationSettings::Jmri(expected));
        assert_eq!(jmri.cable.speed(), 20.0);
    }
}
